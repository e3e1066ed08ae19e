// SPDX-License-Identifier: Apache-2.0
#include "calibration/colour_spectrum.h"

#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/commands.h"
#include "colorimetry/bands.h"
#include "config/bands_file.h"
#include "config/spectra.h"

#define MODES(X) X(FULL, "full") X(BANDS, "bands") X(PRODUCT, "product")

enum mode {
#define X(name, text) MODE_##name,
    MODES(X)
#undef X
};

static const char *const MODE_NAMES[] = {
#define X(name, text) text,
    MODES(X)
#undef X
    NULL,
};

struct options {
    const char *light, *reflectance, *bands;
    enum observer observer;
    enum mode mode;
    bool json;
};

struct row {
    char name[64];
    struct xyz xyz; // Y = 100 for the perfect white
    struct lab lab;
    struct xy xy;
    struct cct cct; // by the 1931 observer, for which it is defined
};

struct rows {
    size_t count;
    struct row *rows;
    char warning[320]; // of the reflectances
};

// ---- the command line --------------------------------------------------------

static int bad_usage(const char *what, const char *value)
{
    return command_bad_usage("boothcal colour spectrum: %s%s; see boothcal colour spectrum --help", what,
                             value);
}

static bool mode_from_name(const char *name, enum mode *out)
{
    for (int i = 0; MODE_NAMES[i]; i++) {
        if (!strcmp(name, MODE_NAMES[i])) {
            *out = (enum mode)i;
            return true;
        }
    }
    return false;
}

static int set_option(struct options *o, int option, bool *mode_given)
{
    switch (option) {
    case 'l':
        o->light = optarg;
        return COMMAND_FINE;
    case 'r':
        o->reflectance = optarg;
        return COMMAND_FINE;
    case 'b':
        o->bands = optarg;
        return COMMAND_FINE;
    case 'j':
        o->json = true;
        return COMMAND_FINE;
    case 'o':
        if (observer_from_name(optarg, &o->observer))
            return COMMAND_FINE;
        return bad_usage("--observer is one of 1931-2, 1964-10, 2015-2, 2015-10, not ", optarg);
    case 'm':
        *mode_given = true;
        if (mode_from_name(optarg, &o->mode))
            return COMMAND_FINE;
        return bad_usage("--mode is one of full, bands, product, not ", optarg);
    }
    return COMMAND_USAGE;
}

static int parse(int argc, char **argv, struct options *o)
{
    static const struct option LONG[] = {
        {"light", required_argument, NULL, 'l'}, {"reflectance", required_argument, NULL, 'r'},
        {"bands", required_argument, NULL, 'b'}, {"observer", required_argument, NULL, 'o'},
        {"mode", required_argument, NULL, 'm'},  {"json", no_argument, NULL, 'j'},
        {NULL, 0, NULL, 0},
    };
    bool mode_given = false;
    int option;
    optind = 0;
    opterr = 0;
    while ((option = getopt_long(argc, argv, ":", LONG, NULL)) >= 0) {
        if (option == '?' || option == ':')
            return bad_usage(option == ':' ? "a value is missing after " : "no such option: ",
                             argv[optind - 1]);
        int code = set_option(o, option, &mode_given);
        if (code)
            return code;
    }
    if (optind < argc)
        return bad_usage("what is ", argv[optind]);
    if (!o->light)
        return bad_usage("--light FILE|NAME is missing", "");
    if (o->bands && !mode_given)
        o->mode = MODE_BANDS;
    if (o->bands && o->mode == MODE_FULL)
        return bad_usage("--bands means nothing with --mode full", "");
    return COMMAND_FINE;
}

// ---- the colours -------------------------------------------------------------

// How a surface meets the lamp.
struct way {
    enum mode mode;
    const struct spectrum *lamp;
    const struct band_set *set; // unless full
    struct band_matrix matrix[OBSERVER_COUNT];
};

static bool way_init(struct way *w, const struct options *o, const struct band_set *set,
                     const struct spectrum *lamp, struct error *err)
{
    w->mode = o->mode;
    w->lamp = lamp;
    w->set = set;
    for (enum observer i = 0; i < OBSERVER_COUNT; i++) {
        if (w->mode == MODE_FULL || (i != o->observer && i != OBSERVER_1931_2))
            continue;
        if (!(w->mode == MODE_BANDS ? band_matrix_adapted(set, lamp, i, &w->matrix[i], err)
                                    : band_matrix_product(set, lamp, i, &w->matrix[i], err)))
            return false;
    }
    return true;
}

static struct xyz way_xyz(const struct way *w, const struct spectrum *reflectance,
                          enum observer observer)
{
    if (w->mode == MODE_FULL)
        return xyz_relative(w->lamp, reflectance, observer);
    struct bands c = bands_of(w->set, reflectance);
    return band_xyz(&w->matrix[observer], &c);
}

static bool all_finite(const struct row *r)
{
    const double v[] = {r->xyz.X, r->xyz.Y, r->xyz.Z, r->lab.L, r->lab.a,
                        r->lab.b, r->xy.x,  r->xy.y};
    bool finite = true;
    for (size_t i = 0; i < sizeof v / sizeof *v; i++)
        finite &= isfinite(v[i]) != 0;
    return finite;
}

static bool fill_row(struct row *row, const char *name, const struct way *w,
                     const struct spectrum *reflectance, enum observer observer, struct error *err)
{
    struct xyz white = xyz_relative(w->lamp, NULL, observer);
    snprintf(row->name, sizeof row->name, "%s", name);
    row->xyz = way_xyz(w, reflectance, observer);
    row->xy = xy_of(row->xyz);
    row->cct = cct_of(xy_of(way_xyz(w, reflectance, OBSERVER_1931_2)));
    if (!lab_of(row->xyz, white, &row->lab, err))
        return false;
    return all_finite(row) || fail(err, ERROR_DATA, "%s: its colour is no finite number", name);
}

static struct spectrum perfect_white(void)
{
    struct spectrum s;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        s.v[i] = 1;
    return s;
}

static bool rows_of_lamps(const struct options *o, const struct band_set *set,
                          const struct spectra *lamps, struct rows *out, struct error *err)
{
    struct spectrum white = perfect_white();
    for (int i = 0; i < lamps->count; i++) {
        struct way way;
        if (!way_init(&way, o, set, &lamps->spectra[i], err) ||
            !fill_row(&out->rows[i], lamps->names[i], &way, &white, o->observer, err))
            return while_doing(err, "%s: %s", o->light, lamps->names[i]);
        out->count++;
    }
    return true;
}

static bool rows_of_surfaces(const struct options *o, const struct band_set *set,
                             const struct spectra *lamps, const struct spectra *surfaces,
                             struct rows *out, struct error *err)
{
    struct way way;
    if (lamps->count != 1)
        return fail(err, ERROR_DATA, "%s: %d spectra; with --reflectance it must be one", o->light,
                    lamps->count);
    if (!way_init(&way, o, set, &lamps->spectra[0], err))
        return while_doing(err, "%s", o->light);
    for (int i = 0; i < surfaces->count; i++) {
        if (!fill_row(&out->rows[i], surfaces->names[i], &way, &surfaces->spectra[i], o->observer,
                      err))
            return while_doing(err, "%s", o->light);
        out->count++;
    }
    return true;
}

// A CIE name as a list of one, or all spectra of a file.
static bool load_lamps(const char *text, struct spectra *out, struct error *err)
{
    struct spectrum one;
    if (!lamp_spectrum(text, &one, err))
        return false;
    if (spectra_is_path(text))
        return spectra_load(text, false, out, err);
    out->spectra = malloc(sizeof *out->spectra);
    out->names = calloc(1, sizeof *out->names);
    if (!out->spectra || !out->names)
        return fail(err, ERROR_SYSTEM, "out of memory");
    out->count = 1;
    out->spectra[0] = one;
    snprintf(out->names[0], sizeof out->names[0], "%s", text);
    return true;
}

static bool load_bands(const struct options *o, struct band_set *set, struct error *err)
{
    if (o->bands)
        return bands_named(o->bands, set, err) || while_doing(err, "--bands");
    return band_set_shipped(BANDS_SHIPPED, set, err);
}

static bool compute(const struct options *o, struct rows *out, struct error *err)
{
    struct spectra lamps = {0}, surfaces = {0};
    struct band_set set;
    bool ok = load_bands(o, &set, err) && load_lamps(o->light, &lamps, err) &&
              (!o->reflectance || spectra_load(o->reflectance, true, &surfaces, err));
    if (ok) {
        int count = o->reflectance ? surfaces.count : lamps.count;
        out->rows = calloc((size_t)count, sizeof *out->rows);
        ok = out->rows || fail(err, ERROR_SYSTEM, "out of memory");
    }
    if (ok)
        ok = o->reflectance ? rows_of_surfaces(o, &set, &lamps, &surfaces, out, err)
                            : rows_of_lamps(o, &set, &lamps, out, err);
    snprintf(out->warning, sizeof out->warning, "%s", surfaces.warning);
    spectra_fini(&lamps);
    spectra_fini(&surfaces);
    return ok;
}

// ---- printing ----------------------------------------------------------------

static json_t *row_json(const struct row *r)
{
    json_t *cct = r->cct.valid ? json_real(r->cct.kelvin) : json_null();
    json_t *duv = r->cct.valid ? json_real(r->cct.duv) : json_null();
    return json_pack("{s:s, s:[fff], s:[fff], s:[ff], s:o, s:o}", "name", r->name, "XYZ", r->xyz.X,
                     r->xyz.Y, r->xyz.Z, "Lab", r->lab.L, r->lab.a, r->lab.b, "xy", r->xy.x,
                     r->xy.y, "CCT", cct, "Duv", duv);
}

static bool print_json(const struct options *o, const struct rows *rows, struct error *err)
{
    json_t *list = json_array();
    for (size_t i = 0; i < rows->count; i++)
        json_array_append_new(list, row_json(&rows->rows[i]));
    json_t *all = json_pack("{s:s, s:s?, s:s, s:s, s:o}", "light", o->light, "reflectance",
                            o->reflectance, "observer", observer_name(o->observer), "mode",
                            MODE_NAMES[o->mode], "rows", list);
    bool whole = all && json_array_size(list) == rows->count;
    if (whole)
        json_dumpf(all, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(12));
    if (whole)
        putchar('\n');
    json_decref(all);
    return whole || fail(err, ERROR_DATA, "%s: a name that is no UTF-8 text, or a colour that is "
                                          "no finite number",
                         o->reflectance ? o->reflectance : o->light);
}

static void print_text(const struct rows *rows)
{
    printf("%-24s %9s %9s %9s %8s %8s %8s %7s %7s %7s %8s\n", "name", "X", "Y", "Z", "L*", "a*",
           "b*", "x", "y", "CCT", "Duv");
    for (size_t i = 0; i < rows->count; i++) {
        const struct row *r = &rows->rows[i];
        printf("%-24s %9.4f %9.4f %9.4f %8.3f %8.3f %8.3f %7.5f %7.5f", r->name, r->xyz.X, r->xyz.Y,
               r->xyz.Z, r->lab.L, r->lab.a, r->lab.b, r->xy.x, r->xy.y);
        if (r->cct.valid)
            printf(" %7.1f %+8.5f\n", r->cct.kelvin, r->cct.duv);
        else
            printf(" %7s %8s\n", "-", "-");
    }
}

int command_colour_spectrum(int argc, char **argv)
{
    struct options o = {.observer = OBSERVER_1931_2, .mode = MODE_FULL};
    struct rows rows = {0};
    struct error err;
    int code = parse(argc, argv, &o);
    if (code)
        return code;
    bool ok = compute(&o, &rows, &err);
    if (ok && o.json)
        ok = print_json(&o, &rows, &err);
    else if (ok)
        print_text(&rows);
    free(rows.rows);
    return ok ? command_warned(rows.warning) : command_bad_input(&err);
}
