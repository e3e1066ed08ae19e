// SPDX-License-Identifier: Apache-2.0
// boothcal display: fit a panel's model, check it, run it both ways.
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/commands.h"
#include "calibration/display_export.h"
#include "calibration/display_fit.h"
#include "calibration/display_fitting.h"
#include "calibration/display_measure.h"
#include "calibration/lines.h"
#include "calibration/view_measure.h"
#include "config/display_file.h"

// ---- check -----------------------------------------------------------------

static void print_check(const struct summary *s, bool json)
{
    if (!json) {
        printf("%d patches, CIEDE2000 mean %.3f, median %.3f, 95th percentile %.3f, largest %.3f\n",
               s->n, s->mean, s->median, s->p95, s->max);
        return;
    }
    json_t *o = json_pack("{s:f, s:f, s:f, s:f, s:i}", "mean", s->mean, "median", s->median, "p95",
                          s->p95, "max", s->max, "n", s->n);
    json_dumpf(o, stdout, JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(o);
}

static bool differences(const struct measurements *m, const struct display_model *model,
                        struct summary *s, struct error *err)
{
    double *de00 = malloc((size_t)m->count * sizeof *de00);
    if (!de00)
        return fail(err, ERROR_SYSTEM, "out of memory for %d patches", m->count);
    bool ok = display_differences(m, model, de00, err);
    if (ok)
        *s = summarise(de00, m->count);
    free(de00);
    return ok;
}

// Measurements that do not say how many cd/m2: the model's white is made theirs.
static void make_relative(struct display_model *model, const struct measurements *m)
{
    double Y = display_forward(model, (struct counts){1, 1, 1}).Y;
    display_model_scale(model, m->white.Y / Y);
    fprintf(stderr,
            "boothcal: warning: %s: no LUMINANCE_XYZ_CDM2: the model is compared at the white of "
            "these measurements\n",
            m->path);
}

static int check(const char *model_path, const char *ti3, struct summary *s, struct error *err)
{
    struct measurements m = {0};
    struct display_model *model = malloc(sizeof *model);
    int code = COMMAND_USAGE;
    if (!model)
        fail(err, ERROR_SYSTEM, "out of memory");
    else if (display_load(model_path, model, NULL, err) && measurements_load(ti3, &m, err)) {
        bool wrong_white = display_warn_white(&m);
        if (!m.absolute)
            make_relative(model, &m);
        if (differences(&m, model, s, err))
            code = wrong_white || !m.absolute ? COMMAND_WARNED : COMMAND_FINE;
    }
    free(model);
    measurements_fini(&m);
    return code;
}

static int command_check(int argc, char **argv)
{
    const char *files[2] = {NULL, NULL};
    bool json = false;
    int count = 0;
    for (int i = 1; i < argc; i++) {
        if (!strcmp(argv[i], "--json"))
            json = true;
        else if (argv[i][0] != '-' && count < 2)
            files[count++] = argv[i];
        else
            count = 3;
    }
    if (count != 2)
        return command_bad_usage("usage: boothcal display check D.ini TEST.ti3 [--json]");
    struct error err;
    struct summary s = {0};
    int code = check(files[0], files[1], &s, &err);
    if (code == COMMAND_USAGE)
        return command_bad_input(&err);
    print_check(&s, json);
    return code;
}

// ---- forward, inverse ------------------------------------------------------

// A model as its file gives it.
struct panel {
    struct display_model model;
    struct display_origin origin;
    bool uncertain; // uncertainties are wanted too
};

static void print_uncertainty(const struct panel *p, struct counts counts, FILE *out)
{
    const struct display_uncertainty *u = &p->origin.uncertainty;
    double c[9];
    display_uncertainty_xyz(u, &p->model, &counts, 1, c);
    fprintf(out, " %.4g %.4g %.4g %.4g", sqrt(c[0]), sqrt(c[4]), sqrt(c[8]),
            display_uncertainty_de00(u, &p->model, counts));
}

static bool one_forward(const struct panel *p, const double v[3], FILE *out, struct error *err)
{
    for (int i = 0; i < 3; i++)
        if (v[i] < 0 || v[i] > 100)
            return fail(err, ERROR_RANGE, "RGB: %g is outside 0..100", v[i]);
    struct counts counts = {v[0] / 100, v[1] / 100, v[2] / 100};
    struct xyz c = display_forward(&p->model, counts);
    fprintf(out, "%.10g %.10g %.10g", c.X, c.Y, c.Z);
    if (p->uncertain)
        print_uncertainty(p, counts, out);
    fputc('\n', out);
    return true;
}

static bool one_inverse(const struct panel *p, const double v[3], FILE *out, struct error *err)
{
    (void)err;
    struct display_inverse at = display_invert(&p->model, (struct xyz){v[0], v[1], v[2]});
    fprintf(out, "%.10g %.10g %.10g%s\n", 100 * at.counts.r, 100 * at.counts.g, 100 * at.counts.b,
            at.in_gamut ? "" : " out-of-gamut");
    return true;
}

struct filter {
    const char *names; // of the numbers of a line
    bool (*one)(const struct panel *, const double v[3], FILE *, struct error *);
};

static bool all_lines(const struct panel *panel, const struct filter *filter, FILE *out,
                      struct error *err)
{
    struct lines l = {.in = stdin, .name = "stdin"};
    bool end = false, ok = true;
    while (ok && lines_next(&l, &end, err)) {
        double v[3];
        ok = (line_numbers(l.text, 3, filter->names, v, err) && filter->one(panel, v, out, err)) ||
             while_doing(err, "stdin:%d", l.number);
    }
    lines_fini(&l);
    return ok && end;
}

// Nothing is printed before the last line was understood.
static bool print_lines(const struct panel *panel, const struct filter *filter, struct error *err)
{
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out)
        return fail_errno(err, "no memory for the answer");
    bool ok = all_lines(panel, filter, out, err);
    if (fclose(out) && ok)
        ok = fail_errno(err, "no memory for the answer");
    if (ok)
        fwrite(text, 1, size, stdout);
    free(text);
    return ok;
}

static bool load_and_print(const char *path, bool uncertain, const struct filter *filter,
                           struct error *err)
{
    struct panel *panel = malloc(sizeof *panel);
    if (!panel)
        return fail(err, ERROR_SYSTEM, "out of memory");
    panel->uncertain = uncertain;
    bool ok =
        display_load(path, &panel->model, &panel->origin, err) && print_lines(panel, filter, err);
    free(panel);
    return ok;
}

static int command_forward(int argc, char **argv)
{
    static const struct filter FORWARD = {"three numbers, R G B", one_forward};
    struct error err;
    bool uncertain = argc == 3 && !strcmp(argv[2], "--uncertainty");
    if (argc != 2 + uncertain || argv[1][0] == '-')
        return command_bad_usage("usage: boothcal display forward D.ini [--uncertainty] <LINES");
    return load_and_print(argv[1], uncertain, &FORWARD, &err) ? COMMAND_FINE
                                                              : command_bad_input(&err);
}

static int command_inverse(int argc, char **argv)
{
    static const struct filter INVERSE = {"three numbers, X Y Z", one_inverse};
    struct error err;
    if (argc != 2 || argv[1][0] == '-')
        return command_bad_usage("usage: boothcal display inverse D.ini <LINES");
    return load_and_print(argv[1], false, &INVERSE, &err) ? COMMAND_FINE : command_bad_input(&err);
}

int command_display(int argc, char **argv)
{
    static const struct command TABLE[] = {
        {"measure", display_measure, "--config FILE -o FOLDER [OPTION]...",
         "Measures a display through the running boothd into FOLDER: display.ti3 to fit,\n"
         "      verify.ti3 to check with, display.journal with every reading; goes on where an\n"
         "      interrupted run ended.\n"
         "\n"
         "  --config FILE       boothd's settings\n"
         "  --socket PATH       boothd's control socket (default: the settings', else the user's)\n"
         "  --booth PATH        control socket of an emulated booth\n"
         "  --steps N           levels of each ramp, 4..64 (16); twice as many greys\n"
         "  --near-black N      colours below code 16, 0..200 (12)\n"
         "  --random N          colours in between, 0..2000 (60)\n"
         "  --verify N          colours kept apart for checking, 1..1000 (40)\n"
         "  --white-every N     patches between two whites, 5..200 (25)\n"
         "  --seed N            of colours and order (20040912)\n"
         "  --warm-up S         longest wait until white stands still, 0..14400 s (1800)\n"
         "  --warm-up-window S  over which it must stand still, 1..3600 s (120)\n"
         "  --settle S          wait after showing a patch, 0..10 s (found by measuring)\n"
         "  --json              what was found as one JSON object\n"
         "  -o, --out FOLDER    made when missing\n"
         "  --help\n"
         "\n"
         "Exit 3: done, with a warning (the display was not warm or not settled, white drifted\n"
         "by more than 3 %)."},
        {"view", view_measure, "--config FILE -o VIEW.ini [OPTION]...",
         "How the display's light depends on the direction it is seen from and on the place on\n"
         "      the screen: measures five patches from each, fits, goes on where it was "
         "interrupted.\n"
         "\n"
         "  --config FILE    boothd's settings\n"
         "  --socket PATH    boothd's control socket (default: the settings', else the user's)\n"
         "  --booth PATH     control socket of an emulated booth\n"
         "  --angles A,B,C   degrees off the normal, rising, 5..75 (15,30,45)\n"
         "  --azimuths N     directions at each angle, 4..36 (6)\n"
         "  --distance M     from the screen to the instrument, 0.1..3 m (0.6)\n"
         "  --no-places      directions only, at the screen's centre\n"
         "  --from JOURNAL   fits what was measured before; no booth is needed\n"
         "  --json           what was found as one JSON object\n"
         "  -o VIEW.ini      where the result goes; VIEW.ini.journal holds every reading\n"
         "  --help\n"
         "\n"
         "Exit 3: done, with a warning (white is left more than 1 CIEDE2000 off in some "
         "direction)."},
        {"fit", display_fitting, "TRAIN.ti3 -o D.ini [--model KIND] [--json]",
         "Fits a display model to measured patches.\n"
         "\n"
         "  TRAIN.ti3     RGB_R RGB_G RGB_B (0..100) and XYZ_X XYZ_Y XYZ_Z of at least 20 patches\n"
         "  -o, --out D.ini  where the model goes\n"
         "  --model KIND  day: three curves and a 3x4 matrix; interaction: and channels that\n"
         "                disturb each other; residual: and a smooth residual over the predicted\n"
         "                colour; auto (default): the simplest that is not significantly worse\n"
         "                than the best in cross-validation\n"
         "  --json        what was found as one JSON object\n"
         "  --help\n"
         "\n"
         "Exit 3: done, with a warning (primaries much alike or exchanged, a matrix does not\n"
         "describe the panel, white drifted by more than 3 % or contradicts\n"
         "LUMINANCE_XYZ_CDM2, no absolute white)."},
        {"check", command_check, "D.ini TEST.ti3 [--json]",
         "CIEDE2000 of a model against measured patches: mean, median, p95, max, n.\n"
         "\n"
         "  D.ini      model, as display fit writes it\n"
         "  TEST.ti3   measured patches; without LUMINANCE_XYZ_CDM2 both are compared at the same\n"
         "             white, with exit 3\n"
         "  --json     one JSON object\n"
         "  --help"},
        {"verify", command_verify, "--config FILE [OPTION]...",
         "Shows patches of counts and the chart now and judges them: the same as boothcal verify."},
        {"forward", command_forward, "D.ini [--uncertainty]",
         "Reads \"R G B\" (0..100) a line, writes \"X Y Z\" in cd/m2 a line.\n"
         "\n"
         "  D.ini          model, as display fit writes it\n"
         "  --uncertainty  and the standard uncertainties of X, Y and Z as the model predicts\n"
         "                 them, in cd/m2, and of all three together in CIEDE2000\n"
         "  --help"},
        {"inverse", command_inverse, "D.ini",
         "Reads \"X Y Z\" in cd/m2 a line, writes \"R G B\" (0..100) a line; a fourth word\n"
         "      \"out-of-gamut\" stands behind colours that had to be clipped.\n"
         "\n"
         "  D.ini      model, as display fit writes it\n"
         "  --help"},
        {"export", display_exporting, "D.ini [--icc OUT.icc] [--cube OUT.cube] [--size N]",
         "Writes a model for other software.\n"
         "\n"
         "  D.ini            model, as display fit writes it\n"
         "  --icc OUT.icc    an ICC v4 display profile, relative to the display's white\n"
         "  --cube OUT.cube  a 3D LUT from sRGB (white D65, not adapted) to the display's counts\n"
         "  --size N         nodes a side of the LUT, 2..129 (33)\n"
         "  --help\n"
         "\n"
         "Exit 3: done, but the display does not reach D65 at its white's luminance."},
        {NULL, NULL, NULL, NULL},
    };
    return command_run("boothcal display", TABLE, argc, argv);
}
