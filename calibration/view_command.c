// SPDX-License-Identifier: Apache-2.0
// boothcal display view.
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "calibration/commands.h"
#include "calibration/store_keep.h"
#include "calibration/view_measure.h"

static const double LEFT_WARN_DE00 = 1;

struct options {
    const char *config, *socket, *booth, *from, *out;
    struct view_plan plan;
    bool json;
};

static bool number_in(const char *name, const char *text, char until, double least, double most,
                      const char **end, double *out)
{
    if (number_parse(text, end, out) && **end == until && *out >= least && *out <= most)
        return true;
    command_bad_usage("boothcal display view: --%s: \"%s\" is outside %g..%g", name, text, least,
                      most);
    return false;
}

static bool take_angles(const char *text, double angles[3])
{
    const char *end;
    if (!number_in("angles", text, ',', 5, 75, &end, &angles[0]) ||
        !number_in("angles", end + 1, ',', 5, 75, &end, &angles[1]) ||
        !number_in("angles", end + 1, 0, 5, 75, &end, &angles[2]))
        return false;
    if (angles[1] - angles[0] >= 5 && angles[2] - angles[1] >= 5)
        return true;
    command_bad_usage("boothcal display view: --angles: %s: rising, at least 5 degrees apart",
                      text);
    return false;
}

static bool take_azimuths(const char *text, int *azimuths)
{
    const char *end;
    double v;
    if (!number_in("azimuths", text, 0, 4, 36, &end, &v))
        return false;
    *azimuths = (int)v;
    return v == rint(v) ||
           (command_bad_usage("boothcal display view: --azimuths: %s is no whole number", text),
            false);
}

static bool take(int c, struct options *o)
{
    const char *end;
    switch (c) {
    case 'c':
        o->config = optarg;
        return true;
    case 's':
        o->socket = optarg;
        return true;
    case 'b':
        o->booth = optarg;
        return true;
    case 'f':
        o->from = optarg;
        return true;
    case 'o':
        o->out = optarg;
        return true;
    case 'j':
        return o->json = true;
    case 'p':
        o->plan.places = false;
        return true;
    case 'a':
        return take_angles(optarg, o->plan.angles_deg);
    case 'z':
        return take_azimuths(optarg, &o->plan.azimuths);
    case 'd':
        return number_in("distance", optarg, 0, 0.1, 3, &end, &o->plan.distance_m);
    default:
        return false;
    }
}

static int parse(int argc, char **argv, struct options *o)
{
    static const struct option ALL[] = {{"config", required_argument, NULL, 'c'},
                                        {"socket", required_argument, NULL, 's'},
                                        {"booth", required_argument, NULL, 'b'},
                                        {"angles", required_argument, NULL, 'a'},
                                        {"azimuths", required_argument, NULL, 'z'},
                                        {"distance", required_argument, NULL, 'd'},
                                        {"no-places", no_argument, NULL, 'p'},
                                        {"from", required_argument, NULL, 'f'},
                                        {"json", no_argument, NULL, 'j'},
                                        {"out", required_argument, NULL, 'o'},
                                        {0}};
    *o = (struct options){.plan = VIEW_PLAN};
    bool fine = true;
    optind = 0;
    for (int c; fine && (c = getopt_long(argc, argv, "o:", ALL, NULL)) != -1;)
        fine = take(c, o);
    if (!fine)
        return COMMAND_USAGE;
    if (optind != argc || !o->out || !(o->config || o->from))
        return command_bad_usage(
            "usage: boothcal display view --config FILE|--from JOURNAL -o VIEW.ini");
    return COMMAND_FINE;
}

static bool live(const struct options *o, struct view_measured *m, struct error *err)
{
    char journal[1024];
    bool placed;
    struct bench bench = {0};
    struct booth_settings *settings = calloc(1, sizeof *settings);
    snprintf(journal, sizeof journal, "%s.journal", o->out);
    bool fine = settings || fail(err, ERROR_SYSTEM, "out of memory");
    fine = fine && store_settings(o->config, settings, &placed, err) &&
           bench_open(&bench, settings, o->socket, o->booth, err) &&
           bench_lamp(&bench, "none", err) && bench_await_lamp(&bench, "", 30, err) &&
           view_measured(&bench, settings, &o->plan, journal, m, err);
    bench_close(&bench);
    free(settings);
    return fine;
}

static void print_found(const struct view_measured *m, const struct options *o)
{
    const struct view_fit *f = &m->fit;
    if (o->json) {
        json_t *facts =
            json_pack("{s:i,s:i,s:i,s:s,s:f,s:f,s:f,s:f,s:f,s:f}", "directions", f->directions,
                      "places", f->places, "kept", m->kept, "instrument", m->origin.instrument,
                      "before_de00", f->before_de00, "after_de00", f->after_de00, "before_percent",
                      f->before_percent, "after_percent", f->after_percent, "place_de00",
                      f->place_de00, "place_percent", f->place_percent);
        json_dumpf(facts, stdout, JSON_REAL_PRECISION(9));
        putchar('\n');
        json_decref(facts);
        return;
    }
    printf("%d directions, %d places (%d readings were there already); %s\n", f->directions,
           f->places, m->kept, m->origin.instrument);
    printf("white by direction: up to %+.1f %%, %.2f CIEDE2000; the fit leaves %+.2f %%, %.2f\n",
           f->before_percent, f->before_de00, f->after_percent, f->after_de00);
    if (f->places)
        printf("white by place: up to %+.1f %%, %.2f CIEDE2000\n", f->place_percent, f->place_de00);
    printf("%s\n", o->out);
}

int view_measure(int argc, char **argv)
{
    struct options o;
    struct error err = {0};
    int misuse = parse(argc, argv, &o);
    if (misuse)
        return misuse;
    struct view_measured *m = calloc(1, sizeof *m);
    bool fine = m || fail(&err, ERROR_SYSTEM, "out of memory");
    fine = fine && (o.from ? view_from_journal(o.from, m, &err) : live(&o, m, &err)) &&
           view_save(o.out, &m->view, &m->origin, &err);
    int code = fine ? COMMAND_FINE : command_failed(&err);
    if (fine) {
        print_found(m, &o);
        if (m->fit.after_de00 > LEFT_WARN_DE00) {
            fprintf(stderr,
                    "boothcal: warning: white is left %.2f CIEDE2000 off in some direction (sound "
                    "below %g)\n",
                    m->fit.after_de00, LEFT_WARN_DE00);
            code = COMMAND_WARNED;
        }
    }
    free(m);
    return code;
}
