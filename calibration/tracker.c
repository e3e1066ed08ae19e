// SPDX-License-Identifier: Apache-2.0
// boothcal tracker: where the head tracker is, from its marker held at known
// places before the screen.
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

enum { LOOKS = 25, VALUES = TRACKER_PARAMETER_COUNT, STANDOFFS_MOST = TRACKER_POINTS_MOST / 5 };

static const char USAGE[] =
    "usage: boothcal tracker --config FILE [--booth PATH] [OPTION]...\n"
    "       boothcal tracker --config FILE --points FILE.csv [OPTION]...\n"
    "Finds the place of the head tracker and where it looks: its marker is held before the\n"
    "centre and the corners of the screen, at given distances from it. What is held there is\n"
    "the point that the tracker takes for the eye: the tip of a rod fixed to the marker at\n"
    "[tracker] eye_from_marker_m, or the marker itself where that is 0 0 0.\n"
    "\n"
    "  --config FILE        boothd's settings; the stand must be known (boothcal tilt)\n"
    "  --points FILE.csv    points measured before: columns screen_x_m, screen_y_m (from the\n"
    "                       screen's centre), standoff_m, tracker_x_m, tracker_y_m,\n"
    "                       tracker_z_m, and tilt_deg of the screen (default: the settings')\n"
    "  --socket PATH        boothd's control socket (default: the settings', else the user's)\n"
    "  --booth PATH         control socket of an emulated booth\n"
    "  --tilt DEG           tilt of the screen meanwhile (default: 70)\n"
    "  --stand-off M,M,...  distances from the screen (default: 0.7,0.9)\n"
    "  --point-u M          standard uncertainty of a point, as held and as seen (default: 0.003)\n"
    "  --keep FILE.csv      write the points as measured\n"
    "  -o, --out FILE       write the rows into a geometry.ini, beside a stand's in it\n"
    "  --store              make them a new version of the store of calibrations\n"
    "  --json               one JSON object\n"
    "  --help\n"
    "\n"
    "A place where the tracker does not see the marker is left out. Ends with 0; 1 when it\n"
    "failed; 2 on wrong usage, or points that decide nothing, with the reason; 3 when done,\n"
    "with a warning.";

struct options {
    struct geometry_options keep;
    double tilt_deg, point_m;
    double standoffs[STANDOFFS_MOST];
    int count;
};

static bool take_standoffs(const char *text, struct options *o, struct error *err)
{
    const char *end = text;
    o->count = 0;
    do {
        double m;
        if (o->count == STANDOFFS_MOST || !number_parse(end + (o->count > 0), &end, &m) ||
            !(m >= 0 && m <= 5) || (*end && *end != ','))
            return fail(err, ERROR_CONFIG, "--stand-off %s: metres, 0..5, are expected", text);
        o->standoffs[o->count++] = m;
    } while (*end);
    return true;
}

static bool take_number(const char *name, const char *text, double least, double most, double *out,
                        struct error *err)
{
    const char *end;
    return (number_parse(text, &end, out) && !*end && *out >= least && *out <= most) ||
           fail(err, ERROR_CONFIG, "--%s %s: a number in %g..%g is expected", name, text, least,
                most);
}

static bool take_option(int c, struct options *o, struct error *err)
{
    if (geometry_take_option(c, optarg, &o->keep))
        return true;
    switch (c) {
    case 't':
        return take_number("tilt", optarg, -180, 180, &o->tilt_deg, err);
    case 'u':
        return take_number("point-u", optarg, 1e-6, 1, &o->point_m, err);
    case 'd':
        return take_standoffs(optarg, o, err);
    default:
        return fail(err, ERROR_CONFIG, "an option is unknown, or its value is missing; see --help");
    }
}

static bool take_options(int argc, char **argv, struct options *o, struct error *err)
{
    static const struct option LONG[] = {
        {"config", required_argument, NULL, 'c'},  {"socket", required_argument, NULL, 's'},
        {"booth", required_argument, NULL, 'b'},   {"points", required_argument, NULL, 'f'},
        {"keep", required_argument, NULL, 'k'},    {"out", required_argument, NULL, 'o'},
        {"store", no_argument, NULL, 'S'},         {"json", no_argument, NULL, 'j'},
        {"tilt", required_argument, NULL, 't'},    {"stand-off", required_argument, NULL, 'd'},
        {"point-u", required_argument, NULL, 'u'}, {0}};
    *o = (struct options){.tilt_deg = 70, .point_m = 0.003, .standoffs = {0.7, 0.9}, .count = 2};
    optind = 0; // getopt starts anew
    opterr = 0;
    for (int c; (c = getopt_long(argc, argv, "o:", LONG, NULL)) != -1;)
        if (!take_option(c, o, err))
            return false;
    return (optind == argc && o->keep.config) ||
           fail(err, ERROR_CONFIG, "--config is needed, and nothing but options; see --help");
}

// ---- measuring ------------------------------------------------------------------

struct points {
    struct held_point of[TRACKER_POINTS_MOST];
    int count, unseen;
};

static bool measure_point(struct bench *b, const struct booth_settings *booth,
                          enum screen_place place, double standoff_m, double tilt_deg,
                          struct points *p, struct error *err)
{
    struct vec3 at = screen_place_at(&booth->screen, place);
    struct held_point *point = &p->of[p->count];
    struct eye_look eye;
    char where[96];
    *point = (struct held_point){at.x, at.y, standoff_m, tilt_deg, {0, 0, 0}};
    snprintf(where, sizeof where, "%.3f m before the screen's %s", standoff_m,
             screen_place_name(place));
    if (!bench_hold(b, where, held_at(&booth->stand.stand, point), err))
        return false;
    if (!bench_look_eye(b, LOOKS, &eye, err)) {
        p->unseen++;
        return err->code == ERROR_RETRY;
    }
    point->tracker_m = eye.at;
    p->count++;
    return true;
}

static bool measure_all(struct bench *b, const struct options *o,
                        const struct booth_settings *booth, struct points *p, struct error *err)
{
    struct tilt_look tilt;
    double tilt_deg = o->tilt_deg;
    int all = o->count * PLACE_COUNT;
    if (!bench_tilt(b, o->tilt_deg, err))
        return false;
    if (bench_look_tilt(b, LOOKS, &tilt, err))
        tilt_deg = tilt_of_turned(tilt.reading_deg, booth->accelerometer.turned_deg);
    else if (err->code != ERROR_GONE) // without an inclinometer the asked one counts
        return false;
    for (int i = 0; i < all; i++) {
        if (!measure_point(b, booth, i % PLACE_COUNT, o->standoffs[i / PLACE_COUNT], tilt_deg, p,
                           err))
            return false;
        bench_progress(b, "points", i + 1, all);
    }
    return true;
}

static bool measure(const struct options *o, const struct booth_settings *booth, struct points *p,
                    struct error *err)
{
    struct bench bench = {0};
    bool fine = bench_open(&bench, booth, o->keep.socket, o->keep.booth, err) &&
                measure_all(&bench, o, booth, p, err);
    bench_close(&bench);
    return fine;
}

// ---- saying what was found --------------------------------------------------------

static struct geometry geometry_of(const struct tracker_fit *f)
{
    struct geometry g = {.rows = 1u << STORED_PLACE | 1u << STORED_PITCH | 1u << STORED_YAW |
                                 1u << STORED_ROLL};
    double *values[VALUES] = {&g.booth.tracker.place_m[0], &g.booth.tracker.place_m[1],
                              &g.booth.tracker.place_m[2], &g.booth.tracker.pitch_deg,
                              &g.booth.tracker.yaw_deg,    &g.booth.tracker.roll_deg};
    double *uncertainties[VALUES] = {&g.uncertainty.place_m[0], &g.uncertainty.place_m[1],
                                     &g.uncertainty.place_m[2], &g.uncertainty.pitch_deg,
                                     &g.uncertainty.yaw_deg,    &g.uncertainty.roll_deg};
    for (int i = 0; i < VALUES; i++) {
        *values[i] = geometry_rounded(f->value[i], tracker_parameter_unit(i));
        *uncertainties[i] = geometry_rounded(f->uncertainty[i], tracker_parameter_unit(i));
    }
    g.origin.tracker_points = f->points;
    clock_utc(g.origin.tracker_at);
    snprintf(g.origin.software, sizeof g.origin.software, "boothcal %s", BOOTHD_VERSION);
    return g;
}

static void values_of(const struct tracker_fit *f, struct geometry_value values[VALUES])
{
    for (int i = 0; i < VALUES; i++)
        values[i] = (struct geometry_value){tracker_parameter_name(i), tracker_parameter_unit(i),
                                            f->value[i], f->uncertainty[i]};
}

static void print_fit(const struct tracker_fit *f, const struct points *p)
{
    struct geometry_value values[VALUES];
    values_of(f, values);
    printf("%d points; residuals %.1f mm; an eye among them is placed to +- %.1f mm (k = 2)\n",
           f->points, 1000 * f->rms_m, 1000 * f->eye_m);
    geometry_values_print(values, VALUES);
    printf("held less found, mm:\n");
    for (int i = 0; i < f->points; i++) {
        const struct vec3 *d = &f->residuals[i];
        printf("  point %d (%+.3f %+.3f on the screen, %.3f m before it): %+.1f %+.1f %+.1f\n",
               i + 1, p->of[i].screen_x_m, p->of[i].screen_y_m, p->of[i].standoff_m, 1000 * d->x,
               1000 * d->y, 1000 * d->z);
    }
    if (p->unseen)
        printf("%d places where the tracker did not see the marker were left out\n", p->unseen);
}

static json_t *transform_json(struct rigid t)
{
    const double at[3] = {t.translation.x, t.translation.y, t.translation.z};
    json_t *rows = json_array();
    for (int i = 0; i < 3; i++)
        json_array_append_new(rows, json_pack("[f,f,f,f]", t.rotation.m[i][0], t.rotation.m[i][1],
                                              t.rotation.m[i][2], at[i]));
    return rows;
}

static json_t *fit_json(const struct tracker_fit *f, const struct points *p,
                        const struct stand *stand)
{
    struct geometry_value values[VALUES];
    json_t *residuals = json_array();
    struct rigid screen_from_tracker =
        rigid_mul(rigid_inverse(stand_pose(stand, p->of[0].tilt_deg)), f->booth_from_tracker);
    values_of(f, values);
    for (int i = 0; i < f->points; i++)
        json_array_append_new(residuals, json_pack("[f,f,f]", f->residuals[i].x, f->residuals[i].y,
                                                   f->residuals[i].z));
    return json_pack("{s:i, s:i, s:f, s:f, s:f, s:o, s:o, s:f, s:o, s:o}", "points", f->points,
                     "unseen", p->unseen, "rms_m", f->rms_m, "eye_uncertainty_m", f->eye_m,
                     "stretch", f->stretch, "values", geometry_values_json(values, VALUES),
                     "booth_from_tracker", transform_json(f->booth_from_tracker), "tilt_deg",
                     p->of[0].tilt_deg, "screen_from_tracker", transform_json(screen_from_tracker),
                     "residuals_m", residuals);
}

// ---- the command --------------------------------------------------------------------

static void pose_problem(const struct options *o, const struct booth_settings *booth,
                         const struct points *p, struct tracker_problem *out)
{
    *out = (struct tracker_problem){.point_m = o->point_m, .count = p->count};
    for (int i = 0; i < p->count; i++)
        out->points[i] =
            (struct tracker_point){held_at(&booth->stand.stand, &p->of[i]), p->of[i].tracker_m};
}

static bool find(const struct options *o, struct booth_settings *booth, struct points *p,
                 struct tracker_fit *f, struct error *err)
{
    struct tracker_problem problem;
    bool placed;
    if (!store_settings(o->keep.config, booth, &placed, err) ||
        (o->keep.store && !geometry_can_store(booth, err)))
        return false;
    if (!placed)
        return fail(err, ERROR_CONFIG, "nothing says where the screen is: boothcal tilt finds it");
    double tilt_deg = booth->stand.default_tilt_deg;
    bool measured = o->keep.in ? points_load(o->keep.in, tilt_deg, p->of, &p->count, err)
                               : measure(o, booth, p, err);
    if (!measured || (o->keep.keep && !points_save(o->keep.keep, p->of, p->count, err)))
        return false;
    pose_problem(o, booth, p, &problem);
    return tracker_fit(&problem, f, err) ||
           (p->unseen && while_doing(err, "%d places were not seen", p->unseen));
}

int command_tracker(int argc, char **argv)
{
    struct options o;
    struct booth_settings booth;
    struct points points = {.count = 0};
    struct tracker_fit f;
    struct error err = {0};
    for (int i = 1; i < argc; i++)
        if (!strcmp(argv[i], "--help") || !strcmp(argv[i], "-h"))
            return puts(USAGE), COMMAND_FINE;
    if (!take_options(argc, argv, &o, &err) || !find(&o, &booth, &points, &f, &err))
        return command_failed(&err);
    struct geometry found = geometry_of(&f);
    json_t *report = fit_json(&f, &points, &booth.stand.stand);
    if (!o.keep.json)
        print_fit(&f, &points);
    int code = geometry_deliver(&o.keep, &booth, &found, false, f.warning, report);
    json_decref(report);
    return code;
}
