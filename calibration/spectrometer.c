// SPDX-License-Identifier: Apache-2.0
#include "calibration/spectrometer.h"

#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "calibration/commands.h"
#include "drivers/exposure.h"

enum { RAW_READINGS = 20, TRIES = 24, STEADY_READINGS = 1 };

// ---- exposure --------------------------------------------------------------

static double mains_hz(const struct spectrometer_command *c)
{
    return c->settings.spectrometer.options.mains_hz;
}

static struct exposure_seen seen_of(const struct raw_counts *r)
{
    double most = 0;
    for (int i = r->detector.active.first; i <= r->detector.active.last; i++)
        most = fmax(most, r->mean[i]);
    return (struct exposure_seen){r->integration_us, most / r->detector.saturation,
                                  raw_black(r) / r->detector.saturation, r->saturated};
}

bool spectrometer_expose(struct spectrometer_command *c, int longest_us, int *us, struct error *err)
{
    const struct exposure_limits limits = {mains_hz(c), 10, longest_us, 1};
    struct exposure exposure = {0};
    struct raw_counts *r = calloc(1, sizeof *r);
    int wanted = 10000;
    bool fine = r || fail(err, ERROR_SYSTEM, "no memory for counts"), there = false;
    for (int i = 0; fine && !there && i < TRIES; i++) {
        fine = bench_raw(&c->bench, wanted, STEADY_READINGS, r, err);
        const struct exposure_seen seen = seen_of(r);
        int next = fine ? exposure_next(&exposure, &seen, &limits) : wanted;
        there = fine && (next == r->integration_us || next == wanted);
        wanted = next;
    }
    if (fine && r->saturated)
        fine = fail(err, ERROR_DATA, "the light saturates the spectrometer even at %d us",
                    r->integration_us);
    else if (fine && !there)
        fine = fail(err, ERROR_DATA, "the light is not steady: no exposure is found for it");
    *us = fine ? r->integration_us : 0;
    free(r);
    return fine;
}

// ---- raw -------------------------------------------------------------------

static int readings_of(const struct spectrometer_command *c)
{
    return c->readings ? c->readings : RAW_READINGS;
}

static bool dark_of(struct spectrometer_command *c, const struct raw_counts *light,
                    struct raw_counts *dark, struct error *err)
{
    struct error later = {0};
    bool fine = bench_lid(&c->bench, true, err) &&
                bench_raw(&c->bench, light->integration_us, readings_of(c), dark, err);
    return bench_lid(&c->bench, false, fine ? err : &later) && fine;
}

bool spectrometer_raw(struct spectrometer_command *c, char *warning, struct error *err)
{
    struct raw_counts *r = calloc(2, sizeof *r), *dark = c->dark ? r + 1 : NULL;
    if (!r)
        return fail(err, ERROR_SYSTEM, "no memory for counts");
    bool fine =
        bench_raw(&c->bench, c->exposure_count ? c->exposures[0] : 0, readings_of(c), r, err) &&
        (!dark || dark_of(c, r, dark, err)) && raw_save(c->out, r, dark, err);
    if (fine) {
        double peak = seen_of(r).peak;
        printf("%s: %d pixels of %s, %d readings of %d us, highest count %.1f %% of saturation\n",
               c->out, r->detector.pixels, r->instrument, r->readings, r->integration_us,
               100 * peak);
        if (r->saturated)
            snprintf(warning, WARNING_SIZE, "%d pixels were saturated", r->saturated);
    }
    free(r);
    return fine;
}

// ---- the command line ------------------------------------------------------

struct part {
    const char *name;
    bool (*work)(struct spectrometer_command *c, char *warning, struct error *err);
    const char *options; // letters that it takes
    bool needs_out;
};

enum { EXPOSURES_LEAST_US = 10, EXPOSURES_MOST_US = 65535000 };

static const struct option LONG[] = {
    {"config", required_argument, NULL, 'c'},   {"socket", required_argument, NULL, 's'},
    {"booth", required_argument, NULL, 'b'},    {"lamp", required_argument, NULL, 'l'},
    {"counts", required_argument, NULL, 'k'},   {"lines", required_argument, NULL, 'L'},
    {"readings", required_argument, NULL, 'n'}, {"exposure", required_argument, NULL, 'e'},
    {"dark", no_argument, NULL, 'd'},           {"json", no_argument, NULL, 'j'},
    {"out", required_argument, NULL, 'o'},      {0},
};

static bool whole(const char *option, const char *text, int least, int most, int *out,
                  struct error *err)
{
    const char *end;
    double value;
    if (!number_parse(text, &end, &value) || *end || value != rint(value) ||
        !(value >= least && value <= most))
        return fail(err, ERROR_RANGE, "--%s: \"%s\" is no whole number in %d..%d", option, text,
                    least, most);
    *out = (int)value;
    return true;
}

static bool take_exposure(struct spectrometer_command *c, const char *text, struct error *err)
{
    if (c->exposure_count == LINEARITY_MOST)
        return fail(err, ERROR_RANGE, "--exposure: more than %d of them", LINEARITY_MOST);
    return whole("exposure", text, EXPOSURES_LEAST_US, EXPOSURES_MOST_US,
                 &c->exposures[c->exposure_count++], err);
}

static bool take(struct spectrometer_command *c, int option, struct error *err)
{
    switch (option) {
    case 'c':
        c->config = optarg;
        return true;
    case 's':
        c->socket = optarg;
        return true;
    case 'b':
        c->booth = optarg;
        return true;
    case 'l':
        c->lamp = optarg;
        return true;
    case 'k':
        c->counts = optarg;
        return true;
    case 'L':
        c->lines = optarg;
        return true;
    case 'n':
        return whole("readings", optarg, 1, RAW_READINGS_MOST, &c->readings, err);
    case 'e':
        return take_exposure(c, optarg, err);
    case 'd':
        return c->dark = true;
    case 'j':
        return c->json = true;
    case 'o':
        c->out = optarg;
        return true;
    }
    return false;
}

static bool parse(const struct part *p, int argc, char **argv, struct spectrometer_command *c,
                  struct error *err)
{
    optind = 0;
    opterr = 0;
    for (int option; (option = getopt_long(argc, argv, "o:", LONG, NULL)) != -1;) {
        if (option == '?' || !strchr(p->options, option))
            return fail(err, ERROR_CONFIG, "%s is no option of it, or its value is missing",
                        argv[optind - 1]);
        if (!take(c, option, err))
            return false;
    }
    if (optind < argc)
        return fail(err, ERROR_CONFIG, "\"%s\": no argument is expected", argv[optind]);
    return !p->needs_out || c->out || fail(err, ERROR_CONFIG, "-o FILE is needed");
}

static bool load_settings(struct spectrometer_command *c, struct error *err)
{
    if (c->config)
        return booth_load(c->config, NULL, 0, &c->settings, err);
    booth_preset(&c->settings);
    return true;
}

static int run(const struct part *p, int argc, char **argv)
{
    struct spectrometer_command c = {0};
    struct error err = {0};
    char warning[WARNING_SIZE] = "";
    if (!parse(p, argc, argv, &c, &err)) {
        fprintf(stderr, "boothcal spectrometer %s: %s; see --help\n", p->name, err.text);
        return COMMAND_USAGE;
    }
    bool fine = load_settings(&c, &err) &&
                (c.counts || bench_open(&c.bench, &c.settings, c.socket, c.booth, &err)) &&
                p->work(&c, warning, &err);
    bench_close(&c.bench);
    return fine ? command_warned(warning) : command_failed(&err);
}

#define PART(name, letters, needs_out)                                                             \
    static int run_##name(int argc, char **argv)                                                   \
    {                                                                                              \
        static const struct part part = {#name, spectrometer_##name, letters, needs_out};          \
        return run(&part, argc, argv);                                                             \
    }
PART(raw, "csbneod", true)
PART(dark, "csbneoj", true)
PART(wavelength, "csblkLneoj", false)
PART(linearity, "csblnej", false)

#define BENCH_OPTIONS                                                                              \
    "  --config FILE    boothd's settings: its socket, the mains (default: presets)\n"             \
    "  --socket PATH    boothd's control socket (default: the settings', else the user's)\n"       \
    "  --booth PATH     control socket of an emulated booth; without it you are asked\n"           \
    "  --help"

static const struct command COMMANDS[] = {
    {"dark", run_dark, "-o FILE [OPTION]...",
     "stored darks for the setting `darks`, under the closed lid\n\n"
     "  -o, --out FILE   where they go\n"
     "  --exposure US    an exposure, may be repeated (default: 1, 10, 50, 100 ms and the longest\n"
     "                   that boothd chooses itself)\n"
     "  --readings N     averaged, 2..1000 (20)\n"
     "  --json\n" BENCH_OPTIONS},
    {"wavelength", run_wavelength, "[--counts FILE] [OPTION]...",
     "new wavelength coefficients from a mercury-argon lamp\n\n"
     "  --counts FILE    counts at hand (CSV with nm, counts and perhaps dark; or .jaz)\n"
     "  --lines FILE     other lines than those of mercury and argon: nm, one a row, ascending\n"
     "  --lamp NAME      the line lamp's name in an emulated booth\n"
     "  --exposure US    instead of the best one\n"
     "  --readings N     averaged, 1..1000 (20)\n"
     "  -o, --out FILE   the settings lines too\n"
     "  --json\n" BENCH_OPTIONS},
    {"linearity", run_linearity, "[OPTION]...",
     "whether counts grow with the exposure as the unit's polynomial says\n\n"
     "  --lamp NAME      a lamp of an emulated booth (default: the one that is on)\n"
     "  --exposure US    an exposure, 3..16 of them (default: eighths of the best one)\n"
     "  --readings N     averaged, 2..500 (20)\n"
     "  --json\n" BENCH_OPTIONS},
    {"raw", run_raw, "-o FILE [OPTION]...",
     "raw counts of the light that is there, as CSV\n\n"
     "  -o, --out FILE   where they go\n"
     "  --exposure US    instead of the one boothd has come to\n"
     "  --readings N     averaged, 1..1000 (20)\n"
     "  --dark           and the dark under the closed lid\n" BENCH_OPTIONS},
    {NULL, NULL, NULL, NULL},
};

int command_spectrometer(int argc, char **argv)
{
    return command_run("boothcal spectrometer", COMMANDS, argc, argv);
}
