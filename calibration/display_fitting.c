// SPDX-License-Identifier: Apache-2.0
#include "calibration/display_fitting.h"

#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "calibration/commands.h"
#include "calibration/display_fit.h"
#include "config/display_file.h"

struct options {
    const char *in, *out;
    const enum display_kind *only; // NULL: auto
    enum display_kind kind;        // what only points to
    bool json;
};

// ---- warnings --------------------------------------------------------------

// Why a matrix does not describe a panel.
static void misfit_reason(const struct display_fit *f, char *text, size_t size)
{
    if (f->primaries && fabs(f->additivity) > 0.02)
        snprintf(text, size,
                 "its channels do not add (red, green and blue alone sum to %+.1f %% of white's "
                 "luminance)",
                 100 * f->additivity);
    else if (f->drifted)
        snprintf(text, size, "it changed while it was measured");
    else
        snprintf(text, size,
                 "colours of the channels change along their ramps, or the readings are noisy");
}

static void warning(json_t *list, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void warning(json_t *list, const char *format, ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    json_array_append_new(list, json_string(text));
}

static void white_warning(json_t *list, const struct measurements *m)
{
    if (m->white_error > WHITE_ERROR_WARN)
        warning(list, "%s: the patch 100 100 100 is %.1f %% from %s (sound below %g %%)", m->path,
                100 * m->white_error, m->absolute ? "LUMINANCE_XYZ_CDM2" : "Y = 100",
                100 * WHITE_ERROR_WARN);
}

static void model_warnings(json_t *list, const struct measurements *m,
                           const struct display_model *model, const struct display_fit *f)
{
    char why[200];
    misfit_reason(f, why, sizeof why);
    if (f->disordered)
        warning(list,
                "%s: red's x, green's Y or blue's Z is not the largest of the three primaries: are "
                "columns of RGB or XYZ exchanged?",
                m->path);
    if (f->misfit)
        warning(list,
                "three curves and a matrix do not describe this panel: mean %.2f, 95th percentile "
                "%.2f CIEDE2000: %s%s%s",
                f->day.mean, f->day.p95, why, model->kind == DISPLAY_DAY ? "" : "; kept is ",
                model->kind == DISPLAY_DAY ? "" : display_kind_names[model->kind]);
    if (f->ill_conditioned)
        warning(list,
                "primaries are much alike (condition number %.1f, sound below 10): errors grow by "
                "that factor",
                model->condition);
}

static json_t *warnings(const struct measurements *m, const struct display_model *model,
                        const struct display_fit *f)
{
    json_t *list = json_array();
    white_warning(list, m);
    model_warnings(list, m, model, f);
    if (f->drifted)
        warning(list,
                "%s: white drifted by %.1f %% over %d readings (sound below 3 %%): warm the panel "
                "up and measure again",
                m->path, 100 * m->white_drift, m->whites);
    if (*f->not_validated)
        warning(list, "%s: %s was kept without cross-validation: %s", m->path,
                display_kind_names[model->kind], f->not_validated);
    if (!m->absolute)
        warning(list, "%s: no LUMINANCE_XYZ_CDM2: white is taken as %.5g cd/m2", m->path,
                m->white.Y);
    return list;
}

static int print_warnings(const json_t *list)
{
    size_t i;
    json_t *text;
    json_array_foreach(list, i, text)
        fprintf(stderr, "boothcal: warning: %s\n", json_string_value(text));
    return json_array_size(list) ? COMMAND_WARNED : COMMAND_FINE;
}

bool display_warn_white(const struct measurements *m)
{
    json_t *list = json_array();
    white_warning(list, m);
    bool any = print_warnings(list) != COMMAND_FINE;
    json_decref(list);
    return any;
}

// ---- what was found --------------------------------------------------------

static void print_candidate(const struct display_choice *choice, int kind)
{
    const struct display_candidate *c = &choice->candidates[kind];
    if (!c->tried)
        return;
    printf("  %-12s", display_kind_names[kind]);
    if (!c->fitted)
        printf("cannot be fitted: %s\n", c->failed);
    else if (kind == (int)choice->best)
        printf("%.3f, the least\n", c->mean);
    else
        printf("%.3f, worse by %.4f (standard error %.4f): %s\n", c->mean, c->worse, c->worse_se,
               display_worse(c)                               ? "significant"
               : c->worse > DISPLAY_SIGNIFICANT * c->worse_se ? "too little to matter"
                                                              : "not significant");
}

static void print_choice(const struct display_model *model, const struct display_fit *f,
                         bool automatic)
{
    if (*f->not_validated) {
        printf("model %s, not cross-validated: %s\n", display_kind_names[model->kind],
               f->not_validated);
        return;
    }
    printf("model %s%s; mean CIEDE2000 of %d patches that the fit did not see:\n",
           display_kind_names[model->kind],
           automatic ? ", the simplest that is not significantly worse than the best" : "",
           f->choice.scored);
    for (int k = 0; k < DISPLAY_KIND_COUNT; k++)
        print_candidate(&f->choice, k);
}

static double uncertainty_at(const struct display_model *model, const struct display_fit *f,
                             double grey)
{
    return display_uncertainty_de00(&f->uncertainty, model, (struct counts){grey, grey, grey});
}

static void print_found(const struct measurements *m, const struct display_model *model,
                        const struct display_fit *f, bool automatic)
{
    struct xyz black = display_black(model);
    printf("%s: %d patches, CIEDE2000 mean %.3f, median %.3f, 95th percentile %.3f, largest %.3f\n",
           m->path, f->patches, f->de00.mean, f->de00.median, f->de00.p95, f->de00.max);
    printf(
        "white %.5g cd/m2, black %.3g cd/m2, condition number %.2f, %d of %d curve nodes pooled\n",
        m->white.Y, black.Y, model->condition, f->pooled, 3 * DISPLAY_NODES);
    print_choice(model, f, automatic);
    printf("standard uncertainty of a prediction in CIEDE2000: %.3f at white, %.3f at middle grey, "
           "%.3f at dark grey\n",
           uncertainty_at(model, f, 1), uncertainty_at(model, f, 0.5),
           uncertainty_at(model, f, 0.15));
}

static json_t *summary_facts(const struct summary *s)
{
    return json_pack("{s:f,s:f,s:f,s:f}", "mean", s->mean, "median", s->median, "p95", s->p95,
                     "max", s->max);
}

static json_t *candidate_facts(const struct display_choice *choice)
{
    json_t *all = json_object();
    for (int k = 0; k < DISPLAY_KIND_COUNT; k++) {
        const struct display_candidate *c = &choice->candidates[k];
        if (c->tried && c->fitted)
            json_object_set_new(all, display_kind_names[k],
                                json_pack("{s:f,s:f,s:f,s:b}", "mean", c->mean, "worse", c->worse,
                                          "worse_se", c->worse_se, "significant",
                                          display_worse(c)));
        else if (c->tried)
            json_object_set_new(all, display_kind_names[k],
                                json_pack("{s:s}", "failed", c->failed));
    }
    return all;
}

static json_t *uncertainty_facts(const struct display_model *model, const struct display_fit *f)
{
    const struct display_uncertainty *u = &f->uncertainty;
    return json_pack("{s:i,s:f,s:f,s:f,s:f,s:f,s:{s:f,s:f,s:f}}", "modes", u->modes, "smooth_de00",
                     u->smooth_de00, "length_lab", u->length_lab, "local_de00", u->local_de00,
                     "neutral_de00", u->neutral_de00, "noise_de00", u->noise_de00, "de00", "white",
                     uncertainty_at(model, f, 1), "middle_grey", uncertainty_at(model, f, 0.5),
                     "dark_grey", uncertainty_at(model, f, 0.15));
}

// Takes over list.
static void print_json(const struct measurements *m, const struct display_model *model,
                       const struct display_fit *f, json_t *list)
{
    struct xyz black = display_black(model);
    json_t *facts = json_pack(
        "{s:s,s:i,s:o,s:o,s:{s:s,s:s,s:i,s:i,s:o},s:o,s:[f,f,f],s:[f,f,f],s:f,s:f,s:i,s:i,s:o}",
        "model", display_kind_names[model->kind], "patches", f->patches, "de00",
        summary_facts(&f->de00), "de00_day", summary_facts(&f->day), "cross_validation", "kept",
        display_kind_names[f->choice.kind], "best", display_kind_names[f->choice.best], "folds",
        DISPLAY_FOLDS, "patches", f->choice.scored, "candidates", candidate_facts(&f->choice),
        "uncertainty", uncertainty_facts(model, f), "white_cdm2", m->white.X, m->white.Y,
        m->white.Z, "black_cdm2", black.X, black.Y, black.Z, "condition", model->condition,
        "white_drift", m->white_drift, "pooled", f->pooled, "iterations", f->iterations, "warnings",
        list);
    json_dumpf(facts, stdout, JSON_REAL_PRECISION(9) | JSON_INDENT(1));
    putchar('\n');
    json_decref(facts);
}

// ---- the work --------------------------------------------------------------

static struct display_origin origin_of(const struct measurements *m, const struct display_fit *f)
{
    struct display_origin o = {
        .patches = f->patches, .fit_mean_de00 = f->de00.mean, .fit_max_de00 = f->de00.max};
    snprintf(o.instrument, sizeof o.instrument, "%s", m->instrument);
    snprintf(o.date, sizeof o.date, "%s", m->created);
    snprintf(o.software, sizeof o.software, "boothcal %s", BOOTHD_VERSION);
    snprintf(o.source, sizeof o.source, "%s", m->path);
    o.uncertainty = f->uncertainty;
    return o;
}

static int fit_to(const struct options *o, const struct measurements *m)
{
    struct error err;
    struct display_fit found;
    struct display_model *model = malloc(sizeof *model);
    int code = COMMAND_FAILED;
    if (!model)
        fprintf(stderr, "boothcal: out of memory\n");
    else if (!display_fit(m, o->only, model, &found, &err))
        code = command_bad_input(&err);
    else {
        struct display_origin origin = origin_of(m, &found);
        if (!display_save(o->out, model, &origin, &err))
            code = command_failed(&err);
        else {
            json_t *list = warnings(m, model, &found);
            code = print_warnings(list);
            if (o->json)
                print_json(m, model, &found, json_incref(list));
            else
                print_found(m, model, &found, !o->only);
            json_decref(list);
        }
    }
    free(model);
    return code;
}

static bool same_file(const char *a, const char *b)
{
    struct stat x, y;
    return !stat(a, &x) && !stat(b, &y) && x.st_dev == y.st_dev && x.st_ino == y.st_ino;
}

static bool take_model(const char *text, struct options *o)
{
    o->only = NULL;
    for (int k = 0; display_kind_names[k]; k++)
        if (!strcmp(text, display_kind_names[k])) {
            o->kind = (enum display_kind)k;
            o->only = &o->kind;
        }
    if (o->only || !strcmp(text, "auto"))
        return true;
    command_bad_usage("boothcal display fit: --model %s: none of auto, day, interaction, residual",
                      text);
    return false;
}

static int parse(int argc, char **argv, struct options *o)
{
    static const struct option all[] = {{"model", required_argument, NULL, 'm'},
                                        {"out", required_argument, NULL, 'o'},
                                        {"json", no_argument, NULL, 'j'},
                                        {0}};
    bool fine = true;
    optind = 0; // the family's own words went through getopt before
    for (int c; fine && (c = getopt_long(argc, argv, "o:", all, NULL)) != -1;) {
        if (c == 'o')
            o->out = optarg;
        else if (c == 'j')
            o->json = true;
        else
            fine = c == 'm' && take_model(optarg, o);
    }
    if (!fine)
        return COMMAND_USAGE;
    o->in = optind == argc - 1 ? argv[optind] : NULL;
    if (!o->in || !o->out || !*o->in || !*o->out)
        return command_bad_usage(
            "usage: boothcal display fit TRAIN.ti3 -o D.ini [--model KIND] [--json]");
    if (same_file(o->in, o->out))
        return command_bad_usage("boothcal display fit: -o %s would overwrite the measurements",
                                 o->out);
    return COMMAND_FINE;
}

int display_fitting(int argc, char **argv)
{
    struct options o = {0};
    struct error err;
    struct measurements m = {0};
    int code = parse(argc, argv, &o);
    if (code != COMMAND_FINE)
        return code;
    if (!measurements_load(o.in, &m, &err))
        return command_bad_input(&err);
    code = fit_to(&o, &m);
    measurements_fini(&m);
    return code;
}
