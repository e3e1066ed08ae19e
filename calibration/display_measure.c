// SPDX-License-Identifier: Apache-2.0
#include "calibration/display_measure.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/number.h"
#include "calibration/commands.h"
#include "calibration/measuring.h"

struct options {
    const char *config, *socket, *booth, *out;
    struct measuring_plan plan;
    bool json;
};

// ---- command line ----------------------------------------------------------

// A numeric option: where it goes, and its range.
struct number_option {
    const char *name;
    double least, most;
    int *whole;
    double *real;
};

static bool take_number(const struct number_option *o, const char *text)
{
    const char *end = "";
    double v = NAN;
    if (!number_parse(text, &end, &v) || *end || !(v >= o->least && v <= o->most) ||
        (o->whole && v != rint(v))) {
        command_bad_usage("boothcal display measure: --%s: %s is outside %g..%g", o->name, text,
                          o->least, o->most);
        return false;
    }
    if (o->whole)
        *o->whole = (int)v;
    else
        *o->real = v;
    return true;
}

static bool take_seed(const char *text, uint64_t *seed)
{
    char *end;
    errno = 0;
    *seed = strtoull(text, &end, 10);
    if (!errno && end != text && !*end && *text != '-' && *seed <= INT64_MAX)
        return true;
    command_bad_usage("boothcal display measure: --seed: %s is no whole number, 0..2^63-1", text);
    return false;
}

static int parse(int argc, char **argv, struct options *o)
{
    *o = (struct options){.plan = MEASURING_WHOLE};
    struct measuring_plan *p = &o->plan;
    const struct number_option numbers[] = {
        {"steps", 4, 64, &p->sizes.ramp_steps, NULL},
        {"near-black", 0, 200, &p->sizes.near_black, NULL},
        {"random", 0, 2000, &p->sizes.random, NULL},
        {"verify", 1, 1000, &p->verify, NULL},
        {"white-every", 5, 200, &p->sizes.white_every, NULL},
        {"warm-up", 0, 14400, NULL, &p->warm_up_s},
        {"warm-up-window", 1, 3600, NULL, &p->warm_up_window_s},
        {"settle", 0, 10, NULL, &p->settle_s},
    };
    enum { NUMBERS = sizeof numbers / sizeof *numbers, FIRST = 256 };
    struct option all[NUMBERS + 7] = {
        {"config", required_argument, NULL, 'c'}, {"socket", required_argument, NULL, 's'},
        {"booth", required_argument, NULL, 'b'},  {"seed", required_argument, NULL, 'r'},
        {"json", no_argument, NULL, 'j'},         {"out", required_argument, NULL, 'o'},
    };
    for (int i = 0; i < NUMBERS; i++)
        all[6 + i] = (struct option){numbers[i].name, required_argument, NULL, FIRST + i};
    bool fine = true;
    optind = 0; // the family's own words went through getopt before
    for (int c; fine && (c = getopt_long(argc, argv, "o:", all, NULL)) != -1;) {
        if (c >= FIRST)
            fine = take_number(&numbers[c - FIRST], optarg);
        else if (c == 'c')
            o->config = optarg;
        else if (c == 's')
            o->socket = optarg;
        else if (c == 'b')
            o->booth = optarg;
        else if (c == 'o')
            o->out = optarg;
        else if (c == 'j')
            o->json = true;
        else if (c == 'r')
            fine = take_seed(optarg, &p->seed);
        else
            fine = false;
    }
    if (fine && (optind != argc || !o->config || !o->out))
        return command_bad_usage(
            "usage: boothcal display measure --config FILE -o FOLDER [OPTION]...");
    return fine ? COMMAND_FINE : COMMAND_USAGE;
}

// ---- what was found --------------------------------------------------------

static json_t *facts_of(const struct measuring *m)
{
    return json_pack(
        "{s:s,s:s,s:i,s:i,s:i,s:[f,f,f],s:{s:f,s:f,s:b},s:{s:f,s:b,s:b},s:{s:f,s:f,s:f,s:f,s:i}}",
        "instrument", m->instrument, "started", m->started, "patches", m->fit.count, "verify",
        m->verify.count, "kept", m->kept, "white_cdm2", m->white.X, m->white.Y, m->white.Z,
        "warm_up", "seconds", m->warm_up_s, "slope_per_hour", m->warm_up_slope, "warm", m->warm,
        "settle", "seconds", m->settle.seconds, "found", m->settle_found, "settled",
        m->settle.settled, "drift", "white", m->drift.white, "white_per_hour",
        m->drift.white_per_hour, "white_per_hour_u", m->drift.white_per_hour_u, "black_cdm2",
        m->drift.black_cdm2, "whites", m->drift.whites);
}

static void print_found(const struct measuring *m, const struct options *o)
{
    if (o->json) {
        json_t *facts = facts_of(m);
        json_dumpf(facts, stdout, JSON_REAL_PRECISION(9) | JSON_INDENT(1));
        putchar('\n');
        json_decref(facts);
        return;
    }
    printf("%d patches to fit, %d to check with (%d of the readings were there already); %s\n",
           m->fit.count, m->verify.count, m->kept, m->instrument);
    printf(
        "white %.5g cd/m2; over %d whites it moved by %.2f %%, %+.2f %%/h (k = 1: %.2f); black by "
        "%.2g cd/m2\n",
        m->white.Y, m->drift.whites, 100 * m->drift.white, 100 * m->drift.white_per_hour,
        100 * m->drift.white_per_hour_u, m->drift.black_cdm2);
    printf("waited %.0f s for white (slope at the end %+.2f %%/h); settles within %.3g s (%s)\n",
           m->warm_up_s, 100 * m->warm_up_slope, m->settle.seconds,
           m->settle_found ? "measured" : "given");
    printf("%s/display.ti3\n%s/verify.ti3\n", o->out, o->out);
}

static int warn(const struct measuring *m)
{
    bool drifted = m->drift.white > MEASURING_DRIFT_WARN;
    if (!m->warm)
        fprintf(stderr,
                "boothcal: warning: white did not stand still within %.0f s (%+.2f %%/h): let the "
                "display warm up\n",
                m->warm_up_s, 100 * m->warm_up_slope);
    if (!m->settle.settled)
        fprintf(stderr, "boothcal: warning: the display does not settle within %g s\n",
                SETTLE_LONGEST_S);
    if (drifted)
        fprintf(
            stderr,
            "boothcal: warning: white drifted by %.1f %% over %d readings (sound below %g %%)\n",
            100 * m->drift.white, m->drift.whites, 100 * MEASURING_DRIFT_WARN);
    return !m->warm || !m->settle.settled || drifted ? COMMAND_WARNED : COMMAND_FINE;
}

// ---- the work --------------------------------------------------------------

static bool save(const struct measuring *m, const char *folder, const json_t *readings,
                 struct error *err)
{
    char fit[1024], verify[1024];
    snprintf(fit, sizeof fit, "%s/display.ti3", folder);
    snprintf(verify, sizeof verify, "%s/verify.ti3", folder);
    return patch_set_save(&m->fit, fit, m->white, m->instrument, readings, err) &&
           patch_set_save(&m->verify, verify, m->white, m->instrument, readings, err);
}

static bool measure(struct bench *b, const struct booth_settings *settings, const struct options *o,
                    struct measuring *m, struct error *err)
{
    char journal[1024];
    snprintf(journal, sizeof journal, "%s/display.journal", o->out);
    return bench_lamp(b, "none", err) && bench_await_lamp(b, "", 30, err) &&
           bench_aim_screen(b, settings->screen.width_px / 2.0, settings->screen.height_px / 2.0,
                            err) &&
           measuring_run(b, &o->plan, settings->booth.name, journal, m, err) &&
           save(m, o->out, b->readings, err);
}

int display_measure(int argc, char **argv)
{
    struct options o;
    int misuse = parse(argc, argv, &o);
    if (misuse)
        return misuse;
    struct error err = {0};
    struct bench bench = {0};
    struct measuring m = {0};
    struct booth_settings *settings = calloc(1, sizeof *settings);
    bool fine = settings || fail(&err, ERROR_SYSTEM, "out of memory");
    if (fine && mkdir(o.out, 0777) && errno != EEXIST)
        fine = fail_errno(&err, "%s", o.out);
    fine = fine && booth_load(o.config, NULL, 0, settings, &err) &&
           bench_open(&bench, settings, o.socket, o.booth, &err) &&
           measure(&bench, settings, &o, &m, &err);
    if (fine)
        print_found(&m, &o);
    int code = fine ? warn(&m) : command_failed(&err);
    measuring_fini(&m);
    bench_close(&bench);
    free(settings);
    return code;
}
