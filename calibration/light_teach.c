// SPDX-License-Identifier: Apache-2.0
#include <getopt.h>
#include <jansson.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/number.h"
#include "calibration/commands.h"
#include "calibration/light.h"
#include "calibration/store_keep.h"
#include "calibration/teach.h"
#include "config/booth_store.h"
#include "config/paths.h"

struct options {
    const char *name, *config, *socket, *booth, *map;
    struct teach_plan plan;
    bool json;
};

static bool number_in(double least, double most, double *out)
{
    const char *end;
    return number_parse(optarg, &end, out) && !*end && *out >= least && *out <= most;
}

static bool take(int option, struct options *o)
{
    double value;
    switch (option) {
    case 'c':
        o->config = optarg;
        return true;
    case 's':
        o->socket = optarg;
        return true;
    case 'b':
        o->booth = optarg;
        return true;
    case 'm':
        o->map = optarg;
        return true;
    case 'r':
        if (!number_in(1, 10000, &value) || value != (int)value)
            return false;
        o->plan.readings = (int)value;
        return true;
    case 'd':
        if (!number_in(1e-3, 1000, &value))
            return false;
        o->plan.drift = value / 100;
        return true;
    case 'w':
        return number_in(0, 86400, &o->plan.patience_s);
    case 'j':
        o->json = true;
        return true;
    default:
        return false;
    }
}

static int parse(int argc, char **argv, struct options *o)
{
    static const struct option LONG[] = {
        {"config", required_argument, NULL, 'c'},
        {"socket", required_argument, NULL, 's'},
        {"booth", required_argument, NULL, 'b'},
        {"map", required_argument, NULL, 'm'},
        {"readings", required_argument, NULL, 'r'},
        {"drift", required_argument, NULL, 'd'},
        {"wait", required_argument, NULL, 'w'},
        {"json", no_argument, NULL, 'j'},
        {0},
    };
    *o = (struct options){.plan = TEACH_WHOLE};
    optind = 0;
    for (int c; (c = getopt_long(argc, argv, ":", LONG, NULL)) != -1;)
        if (!take(c, o))
            return command_bad_usage("boothcal light teach: %s is unknown, lacks its value or "
                                     "cannot have that one; see --help",
                                     argv[optind - 1]);
    if (optind + 1 != argc || !o->config)
        return command_bad_usage("boothcal light teach: one NAME and --config are needed; see "
                                 "--help");
    o->name = argv[optind];
    return COMMAND_FINE;
}

static void print_text(const struct options *o, const struct booth_settings *s,
                       const struct teaching *t)
{
    struct xy xy = xy_of(xyz_absolute(&t->taught.irradiance, OBSERVER_1931_2));
    struct cct cct = cct_of(xy);
    printf("%s/%s.ini: %.1f lx, x %.4f y %.4f, CCT %.0f K, Duv %+.4f\n", s->lamps.folder, o->name,
           t->taught.lux, xy.x, xy.y, cct.kelvin, cct.duv);
    printf("%d readings of %s, spread %.2f %%\n", o->plan.readings, t->taught.instrument,
           100 * t->taught.spread);
    printf("stood still after %.0f s: %+.2f %% a minute, uncertainty %.2f, over %.0f s\n",
           t->steadiness.waited_s, 100 * t->steadiness.per_minute, 100 * t->steadiness.per_minute_u,
           t->steadiness.window_s);
    if (t->spots.count)
        printf("%s: scaled by %.4f, %d spot readings\n", o->map, t->map_scale, t->spots.count);
    else if (t->map_kept)
        printf("its luminance map stays, now scaled by %.4f\n", t->map_scale);
    else
        printf("it has no luminance map yet: see boothcal light map --help\n");
}

static void print_json(const struct options *o, const struct teaching *t)
{
    struct xy xy = xy_of(xyz_absolute(&t->taught.irradiance, OBSERVER_1931_2));
    struct cct cct = cct_of(xy);
    json_t *ratios = json_array();
    for (int i = 0; i < t->spots.count; i++)
        json_array_append_new(ratios, json_real(t->spots.ratios[i]));
    json_t *all = json_pack(
        "{s:s, s:f, s:[f,f], s:f, s:f, s:i, s:f, s:s, s:f, s:f, s:f, s:b, s:f, s:o, s:s}", "name",
        o->name, "lux", t->taught.lux, "xy", xy.x, xy.y, "cct_k", cct.kelvin, "duv", cct.duv,
        "readings", o->plan.readings, "spread", t->taught.spread, "instrument",
        t->taught.instrument, "waited_s", t->steadiness.waited_s, "drift_per_minute",
        t->steadiness.per_minute, "drift_u", t->steadiness.per_minute_u, "map_kept", t->map_kept,
        "map_scale", t->map_scale, "spot_ratios", ratios, "close_to", t->close);
    json_dumpf(all, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(all);
}

// In a draft of the store, beside the lamps that are there.
static bool teach_in_draft(const struct options *o, struct booth_settings *s, struct bench *bench,
                           struct store_draft *d, struct teaching *t, struct error *err)
{
    char folder[PATH_MAX], ini[PATH_MAX];
    snprintf(folder, sizeof folder, "%s/" STORE_LAMPS, d->folder);
    return path_absolute(folder, s->lamps.folder, sizeof s->lamps.folder, err) &&
           teach_lamp(bench, s, o->name, o->map, &o->plan, t, err) &&
           snprintf(ini, sizeof ini, "%s/%s.ini", s->lamps.folder, o->name) > 0 &&
           store_keep_lamp(d, ini, err);
}

static bool teach_into_store(const struct options *o, struct booth_settings *s, struct bench *bench,
                             struct teaching *t, struct error *err)
{
    struct store_place place;
    struct store_draft d;
    char note[128], folder[PATH_MAX];
    int number;
    if (!booth_store_place(s, &place, err) || !store_begin(&place, true, &d, err))
        return false;
    snprintf(note, sizeof note, "lamp %s taught", o->name);
    struct store_manifest facts = store_facts(s, &d, false, note);
    if (!teach_in_draft(o, s, bench, &d, t, err)) {
        store_abandon(&d);
        return false;
    }
    if (!store_commit(&d, &facts, &number, err))
        return false;
    snprintf(folder, sizeof folder, "%s/%04d/" STORE_LAMPS, place.folder, number);
    return path_absolute(folder, s->lamps.folder, sizeof s->lamps.folder, err);
}

static bool teach(const struct options *o, struct booth_settings *s, struct bench *bench,
                  struct teaching *t, struct error *err)
{
    if (!booth_load(o->config, NULL, 0, s, err) || !bench_open(bench, s, o->socket, o->booth, err))
        return false;
    bool stored = *s->calibration.store && !(s->given & 1u << STORED_LAMPS);
    return (stored ? teach_into_store(o, s, bench, t, err)
                   : teach_lamp(bench, s, o->name, o->map, &o->plan, t, err)) &&
           bench_reload(bench, err);
}

int light_teach_command(int argc, char **argv)
{
    struct options o;
    struct error err = {0};
    struct bench bench = {0};
    struct teaching t;
    int code = parse(argc, argv, &o);
    if (code)
        return code;
    struct booth_settings *settings = malloc(sizeof *settings);
    bool fine = settings ? teach(&o, settings, &bench, &t, &err)
                         : fail(&err, ERROR_SYSTEM, "out of memory");
    bench_close(&bench);
    if (!fine)
        code = command_failed(&err);
    else if (o.json)
        print_json(&o, &t);
    else
        print_text(&o, settings, &t);
    free(settings);
    if (!fine || !*t.close)
        return code;
    fflush(stdout);
    fprintf(stderr,
            "boothcal: warning: %s is close to %s: a noisy reading could be taken for "
            "either\n",
            o.name, t.close);
    return COMMAND_WARNED;
}
