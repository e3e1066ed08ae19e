// SPDX-License-Identifier: Apache-2.0
// boothcal tilt: hinge, screen and inclinometer, from poses of the stand.
#include <getopt.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/number.h"
#include "calibration/bench_pose.h"
#include "calibration/commands.h"
#include "calibration/geometry_keep.h"
#include "calibration/pose_files.h"
#include "calibration/store_keep.h"

enum { LOOKS = 10, VALUES = STAND_PARAMETER_COUNT };

static const char USAGE[] =
    "usage: boothcal tilt --config FILE [--booth PATH] [OPTION]...\n"
    "       boothcal tilt --config FILE --poses FILE.csv [OPTION]...\n"
    "Finds the hinge, the screen's centre from it, and how the inclinometer is turned on the\n"
    "screen: from at least three tilts, each read by a protractor, or corners of the screen\n"
    "measured by tape, beside what the inclinometer says.\n"
    "\n"
    "  --config FILE        boothd's settings\n"
    "  --poses FILE.csv     poses measured before: columns tilt_deg (protractor), reading_deg\n"
    "                       (inclinometer), gravity_x, gravity_y, gravity_z, top_left_x_m,\n"
    "                       top_left_y_m ... (tape; also top_right, bottom_left, bottom_right,\n"
    "                       centre); any may be missing\n"
    "  --socket PATH        boothd's control socket (default: the settings', else the user's)\n"
    "  --booth PATH         control socket of an emulated booth\n"
    "  --at DEG,DEG,...     tilts to measure at (default: 15,30,45,60,75)\n"
    "  --places NAME,...    places to measure by tape (default: top_left,bottom_right; none)\n"
    "  --no-protractor      there is none\n"
    "  --protractor-u DEG   standard uncertainty of a reading of it (default: 0.1)\n"
    "  --inclinometer-u DEG likewise (default: 0.03)\n"
    "  --tape-u M           likewise (default: 0.001)\n"
    "  --keep FILE.csv      write the poses as measured\n"
    "  -o, --out FILE       write the rows into a geometry.ini, beside a tracker's in it\n"
    "  --store              make them a new version of the store of calibrations\n"
    "  --json               one JSON object\n"
    "  --help\n"
    "\n"
    "Ends with 0; 1 when it failed; 2 on wrong usage, or poses that decide nothing, with the\n"
    "reason; 3 when done, with a warning.";

struct options {
    struct geometry_options keep;
    double at[STAND_POSES_MOST];
    int count;
    bool places[PLACE_COUNT], no_protractor;
    struct stand_instruments instruments;
};

static bool take_tilts(const char *text, struct options *o, struct error *err)
{
    const char *end = text;
    o->count = 0;
    do {
        double deg;
        if (o->count == STAND_POSES_MOST || !number_parse(end + (o->count > 0), &end, &deg) ||
            !(fabs(deg) <= 180) || (*end && *end != ','))
            return fail(err, ERROR_CONFIG, "--at %s: tilts in degrees, -180..180, are expected",
                        text);
        o->at[o->count++] = deg;
    } while (*end);
    return true;
}

static bool take_places(const char *text, struct options *o, struct error *err)
{
    memset(o->places, 0, sizeof o->places);
    if (!strcmp(text, "none"))
        return true;
    for (const char *at = text; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL) {
        size_t length = strcspn(at, ",");
        int found = -1;
        for (int i = 0; i < PLACE_COUNT; i++)
            if (strlen(screen_place_name(i)) == length &&
                !strncmp(at, screen_place_name(i), length))
                found = i;
        if (found < 0)
            return fail(err, ERROR_CONFIG,
                        "--places: \"%.*s\" is not one of: centre, top_left, top_right, "
                        "bottom_left, bottom_right; or none",
                        (int)length, at);
        o->places[found] = true;
    }
    return true;
}

static bool take_uncertainty(const char *name, const char *text, double *out, struct error *err)
{
    const char *end;
    return (number_parse(text, &end, out) && !*end && *out > 0 && *out <= 100) ||
           fail(err, ERROR_CONFIG, "--%s %s: a number above 0 is expected", name, text);
}

static bool take_option(int c, struct options *o, struct error *err)
{
    if (geometry_take_option(c, optarg, &o->keep))
        return true;
    switch (c) {
    case 'n':
        o->no_protractor = true;
        return true;
    case 'a':
        return take_tilts(optarg, o, err);
    case 'p':
        return take_places(optarg, o, err);
    case 'A':
        return take_uncertainty("protractor-u", optarg, &o->instruments.protractor_deg, err);
    case 'B':
        return take_uncertainty("inclinometer-u", optarg, &o->instruments.inclinometer_deg, err);
    case 'C':
        return take_uncertainty("tape-u", optarg, &o->instruments.tape_m, err);
    default:
        return fail(err, ERROR_CONFIG, "an option is unknown, or its value is missing; see --help");
    }
}

static bool take_options(int argc, char **argv, struct options *o, struct error *err)
{
    static const struct option LONG[] = {{"config", required_argument, NULL, 'c'},
                                         {"socket", required_argument, NULL, 's'},
                                         {"booth", required_argument, NULL, 'b'},
                                         {"poses", required_argument, NULL, 'f'},
                                         {"keep", required_argument, NULL, 'k'},
                                         {"out", required_argument, NULL, 'o'},
                                         {"store", no_argument, NULL, 'S'},
                                         {"json", no_argument, NULL, 'j'},
                                         {"no-protractor", no_argument, NULL, 'n'},
                                         {"at", required_argument, NULL, 'a'},
                                         {"places", required_argument, NULL, 'p'},
                                         {"protractor-u", required_argument, NULL, 'A'},
                                         {"inclinometer-u", required_argument, NULL, 'B'},
                                         {"tape-u", required_argument, NULL, 'C'},
                                         {0}};
    *o = (struct options){.at = {15, 30, 45, 60, 75},
                          .count = 5,
                          .places = {[PLACE_TOP_LEFT] = true, [PLACE_BOTTOM_RIGHT] = true},
                          .instruments = STAND_INSTRUMENTS};
    optind = 0; // getopt starts anew
    opterr = 0;
    for (int c; (c = getopt_long(argc, argv, "o:", LONG, NULL)) != -1;)
        if (!take_option(c, o, err))
            return false;
    return (optind == argc && o->keep.config) ||
           fail(err, ERROR_CONFIG, "--config is needed, and nothing but options; see --help");
}

// ---- measuring ------------------------------------------------------------------

static bool look(struct bench *b, struct stand_pose_read *out, struct error *err)
{
    struct tilt_look seen;
    if (!bench_look_tilt(b, LOOKS, &seen, err))
        return false;
    out->inclinometer_deg = seen.reading_deg;
    if (seen.has_gravity)
        out->lateral = seen.gravity.x / vec3_length(seen.gravity);
    return true;
}

static bool measure_pose(struct bench *b, const struct options *o, const struct screen *screen,
                         double tilt_deg, struct stand_pose_read *out, struct error *err)
{
    *out = stand_pose_unread();
    if (!bench_tilt(b, tilt_deg, err) || !look(b, out, err) ||
        (!o->no_protractor && !bench_protractor(b, &out->protractor_deg, err)))
        return false;
    for (int i = 0; i < PLACE_COUNT; i++) {
        struct vec3 p = screen_place_at(screen, i), at;
        if (!o->places[i])
            continue;
        if (!bench_tape(b, screen_place_name(i), p.x, p.y, &at, err))
            return false;
        memcpy(out->at[i], (double[]){at.x, at.y, at.z}, sizeof out->at[i]);
    }
    return true;
}

static bool measure(const struct options *o, const struct booth_settings *booth,
                    struct stand_problem *p, struct error *err)
{
    struct bench bench = {0};
    bool fine = bench_open(&bench, booth, o->keep.socket, o->keep.booth, err);
    for (int i = 0; fine && i < o->count; i++) {
        fine = measure_pose(&bench, o, &booth->screen, o->at[i], &p->poses[i], err) ||
               while_doing(err, "tilt %.1f", o->at[i]);
        p->count += fine;
        if (fine)
            bench_progress(&bench, "poses", i + 1, o->count);
    }
    bench_close(&bench);
    return fine;
}

// ---- saying what was found --------------------------------------------------------

static void take(const struct stand_fit *f, int first, int count, double *values,
                 double *uncertainties)
{
    for (int i = 0; i < count; i++) {
        values[i] = geometry_rounded(f->value[first + i], stand_parameter_unit(first + i));
        uncertainties[i] =
            geometry_rounded(f->uncertainty[first + i], stand_parameter_unit(first + i));
    }
}

static struct geometry geometry_of(const struct stand_fit *f)
{
    struct geometry g = {.rows = 0};
    const bool *found = f->fitted;
    if (found[STAND_HINGE_Y] || found[STAND_HINGE_Z])
        g.rows |= 1u << STORED_HINGE;
    if (found[STAND_CENTRE_X] || found[STAND_CENTRE_Y])
        g.rows |= 1u << STORED_CENTRE;
    if (found[STAND_TURN_X] || found[STAND_TURN_Y])
        g.rows |= 1u << STORED_TURNED;
    g.booth.stand.stand.hinge_m[0] = f->stand.hinge_m[0];
    take(f, STAND_HINGE_Y, 2, g.booth.stand.stand.hinge_m + 1, g.uncertainty.hinge_m + 1);
    take(f, STAND_CENTRE_X, 3, g.booth.stand.stand.centre_from_hinge_m,
         g.uncertainty.centre_from_hinge_m);
    take(f, STAND_TURN_X, 3, g.booth.accelerometer.turned_deg, g.uncertainty.turned_deg);
    g.origin.stand_poses = f->poses;
    clock_utc(g.origin.stand_at);
    snprintf(g.origin.software, sizeof g.origin.software, "boothcal %s", BOOTHD_VERSION);
    return g;
}

static void values_of(const struct stand_fit *f, struct geometry_value values[VALUES])
{
    for (int i = 0; i < VALUES; i++)
        values[i] = (struct geometry_value){stand_parameter_name(i), stand_parameter_unit(i),
                                            f->value[i], f->uncertainty[i]};
}

static void print_pose(int index, double tilt_deg, const struct stand_pose_read *d)
{
    printf("  pose %d at %.2f:", index + 1, tilt_deg);
    if (isfinite(d->protractor_deg))
        printf(" protractor %+.2f", d->protractor_deg);
    if (isfinite(d->inclinometer_deg))
        printf(" inclinometer %+.3f", d->inclinometer_deg);
    for (int i = 0; i < PLACE_COUNT; i++)
        for (int k = 0; k < 3; k++)
            if (isfinite(d->at[i][k]))
                printf("%s%s%s %+.1f", k ? "" : " ", k ? "" : screen_place_name(i), k ? "" : " mm",
                       1000 * d->at[i][k]);
    putchar('\n');
}

static void print_fit(const struct stand_fit *f)
{
    struct geometry_value values[VALUES];
    values_of(f, values);
    printf("%d poses, %d readings, %d unknowns; residuals %.2f times their uncertainties\n",
           f->poses, f->readings, f->unknowns, f->rms);
    geometry_values_print(values, VALUES);
    printf("read less found, degrees and mm:\n");
    for (int i = 0; i < f->poses; i++)
        print_pose(i, f->tilt_deg[i], &f->residuals[i]);
}

static json_t *number_or_null(double v)
{
    return isfinite(v) ? json_real(v) : json_null();
}

static json_t *fit_json(const struct stand_fit *f)
{
    struct geometry_value values[VALUES];
    json_t *poses = json_array();
    values_of(f, values);
    for (int i = 0; i < f->poses; i++) {
        const struct stand_pose_read *d = &f->residuals[i];
        json_t *places = json_object();
        for (int k = 0; k < PLACE_COUNT; k++)
            json_object_set_new(places, screen_place_name(k),
                                json_pack("[o,o,o]", number_or_null(d->at[k][0]),
                                          number_or_null(d->at[k][1]),
                                          number_or_null(d->at[k][2])));
        json_array_append_new(poses,
                              json_pack("{s:f, s:o, s:o, s:o, s:o}", "tilt_deg", f->tilt_deg[i],
                                        "protractor_deg", number_or_null(d->protractor_deg),
                                        "inclinometer_deg", number_or_null(d->inclinometer_deg),
                                        "lateral", number_or_null(d->lateral), "places_m", places));
    }
    return json_pack("{s:i, s:i, s:i, s:f, s:o, s:o}", "poses", f->poses, "readings", f->readings,
                     "unknowns", f->unknowns, "rms", f->rms, "values",
                     geometry_values_json(values, VALUES), "residuals", poses);
}

// ---- the command --------------------------------------------------------------------

static bool find(const struct options *o, struct booth_settings *booth, struct stand_fit *f,
                 struct error *err)
{
    struct stand_problem p = {.instruments = o->instruments};
    bool placed;
    if (!store_settings(o->keep.config, booth, &placed, err) ||
        (o->keep.store && !geometry_can_store(booth, err)))
        return false;
    p.screen = booth->screen;
    p.stand = booth->stand.stand;
    memcpy(p.turned_deg, booth->accelerometer.turned_deg, sizeof p.turned_deg);
    bool measured = o->keep.in ? poses_load(o->keep.in, &p, err) : measure(o, booth, &p, err);
    return measured && (!o->keep.keep || poses_save(o->keep.keep, &p, err)) &&
           stand_fit(&p, f, err);
}

int command_tilt(int argc, char **argv)
{
    struct options o;
    struct booth_settings booth;
    struct stand_fit f;
    struct error err = {0};
    for (int i = 1; i < argc; i++)
        if (!strcmp(argv[i], "--help") || !strcmp(argv[i], "-h"))
            return puts(USAGE), COMMAND_FINE;
    if (!take_options(argc, argv, &o, &err) || !find(&o, &booth, &f, &err))
        return command_failed(&err);
    struct geometry found = geometry_of(&f);
    json_t *report = fit_json(&f);
    if (!o.keep.json)
        print_fit(&f);
    int code = geometry_deliver(&o.keep, &booth, &found, true, f.warning, report);
    json_decref(report);
    return code;
}
