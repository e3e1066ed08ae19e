// SPDX-License-Identifier: Apache-2.0
// boothcal verify.
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/number.h"
#include "calibration/commands.h"
#include "calibration/facts_json.h"
#include "calibration/patches.h"
#include "calibration/session.h"
#include "calibration/verify.h"
#include "colorimetry/display_view.h"
#include "config/booth_store.h"
#include "config/display_file.h"
#include "config/lamps.h"
#include "config/paths.h"

enum { DRAWS = 10000, PRESET_PATCHES = 24, UNDECIDED = COMMAND_WARNED };
static const uint64_t SEED = 19311976;

static const char USAGE[] =
    "usage: boothcal verify --config FILE [options]\n"
    "\n"
    "Shows patches of counts and the chart under the lamp that is on, reads them, and compares\n"
    "them with the display model and with the physical samples by full spectra. A figure\n"
    "passes when it keeps to its tolerance even with its uncertainty (k = 2), fails when it\n"
    "does not even without; in between it is undecided.\n"
    "\n"
    "  --config FILE        boothd's settings\n"
    "  --socket PATH        boothd's control socket (default: the settings', else the user's)\n"
    "  --booth PATH         control socket of an emulated booth\n"
    "  --material NAME      chart to show (default: colorchecker24)\n"
    "  --patches N          of counts, 0..100 (default: 24)\n"
    "  --uncertainty FILE   standard uncertainties of your instruments (boothcal report)\n"
    "  --published-mean T   tolerances of the chart in gamut, CIEDE2000; without any of these\n"
    "  --published-max T    options 1 and 3 as published count\n"
    "  --absolute-mean T\n"
    "  --absolute-max T\n"
    "  --display-mean T     of the patches of counts against the display model\n"
    "  --display-max T\n"
    "  --white T            of the luminance of white, per cent\n"
    "  -o, --out FILE       write all of it as sealed JSON\n"
    "  --json               JSON instead of text\n"
    "  --help\n"
    "\n"
    "Ends with 0: pass; 1: fail, or it could not be done; 2: wrong usage or input; 3:\n"
    "undecided.\n";

struct options {
    const char *config, *socket, *booth, *material, *uncertainty, *out;
    int patches;
    bool json;
};

// ---- the command line ----------------------------------------------------------------

static bool take_number(const char *text, double least, double most, double *out)
{
    const char *end;
    return number_parse(text, &end, out) && !*end && *out >= least && *out <= most;
}

static bool take(struct options *o, struct verification *v, int c, const char *name)
{
    double number;
    const struct {
        int option;
        const char **text;
    } texts[] = {{'c', &o->config},
                 {'s', &o->socket},
                 {'b', &o->booth},
                 {'m', &o->material},
                 {'u', &o->uncertainty},
                 {'o', &o->out},
                 {0}};
    for (int i = 0; texts[i].option; i++)
        if (texts[i].option == c) {
            *texts[i].text = optarg;
            return true;
        }
    if (c == 't')
        return take_number(optarg, 1e-6, 1000, &number) && verify_ask(v, name, number);
    if (c == 'p' && take_number(optarg, 0, VERIFY_PATCHES, &number)) {
        o->patches = (int)number;
        return number == rint(number);
    }
    o->json |= c == 'j';
    return c == 'j';
}

// 0, an exit code, or -1: help was asked for.
static int parse(int argc, char **argv, struct options *o, struct verification *v)
{
    static const struct option LONG[] = {
        {"config", required_argument, NULL, 'c'},
        {"socket", required_argument, NULL, 's'},
        {"booth", required_argument, NULL, 'b'},
        {"material", required_argument, NULL, 'm'},
        {"patches", required_argument, NULL, 'p'},
        {"uncertainty", required_argument, NULL, 'u'},
        {"out", required_argument, NULL, 'o'},
        {"json", no_argument, NULL, 'j'},
        {"help", no_argument, NULL, 'h'},
#define X(name, option, text, preset) {option, required_argument, NULL, 't'},
        VERIFY_CRITERIA(X)
#undef X
            {0},
    };
    int index = 0;
    *o = (struct options){.material = "colorchecker24", .patches = PRESET_PATCHES};
    optind = 0;
    for (int c; (c = getopt_long(argc, argv, "o:h", LONG, &index)) != -1;) {
        if (c == 'h')
            return fputs(USAGE, stdout), -1;
        if (!take(o, v, c, LONG[index].name))
            return command_bad_usage("see boothcal verify --help");
    }
    if (optind != argc || !o->config)
        return command_bad_usage("boothcal verify: --config FILE is needed; see --help");
    return 0;
}

// ---- what is known -------------------------------------------------------------------

static bool present_lamp(struct session *s, char *name, size_t size, struct error *err)
{
    json_t *status = bench_status(&s->bench, err);
    if (!status)
        return false;
    const json_t *lamp = json_object_get(status, "lamp");
    const char *text = json_string_value(json_object_get(lamp, "name"));
    const char *verdict = json_string_value(json_object_get(lamp, "verdict"));
    bool known = text && verdict && !strcmp(verdict, "known");
    if (known)
        snprintf(name, size, "%s", text);
    json_decref(status);
    return known || fail(err, ERROR_CONFIG, "boothd knows no lamp that is on (%s)",
                         verdict ? verdict : "no verdict");
}

static void take_lamp(const struct lamp *from, struct lamp_report *lamp)
{
    memcpy(lamp->name, from->file.name, sizeof lamp->name);
    memcpy(lamp->map, from->file.map, sizeof lamp->map);
    lamp->irradiance = from->irradiance;
    lamp->lux = from->file.taught_lux;
    lamp->spread = from->file.spread;
    lamp->teach_readings = from->file.readings;
    lamp->map_scale = from->file.map_scale;
    lamp->chromaticity = xy_of(xyz_absolute(&lamp->irradiance, OBSERVER_1931_2));
    lamp->cct = cct_of(lamp->chromaticity);
}

static bool load_lamp(struct session *s, struct error *err)
{
    struct lamp lamp;
    char name[64], path[600];
    if (!present_lamp(s, name, sizeof name, err))
        return false;
    snprintf(path, sizeof path, "%s/%s.ini", s->settings.lamps.folder, name);
    if (!lamp_load(path, &lamp, err))
        return false;
    take_lamp(&lamp, &s->facts->lamps[0]);
    s->facts->lamp_count = 1;
    return true;
}

static bool begin(struct session *s, const struct options *o, struct error *err)
{
    struct session_facts *f = s->facts;
    struct booth_calibration stored;
    struct booth_settings *b = &s->settings;
    if (!booth_load(o->config, NULL, 0, b, err) ||
        !booth_from_store(b, clock_utc_s(), &stored, err) ||
        !path_absolute(o->config, f->config, sizeof f->config, err) ||
        !bench_open(&s->bench, b, o->socket, o->booth, err))
        return false;
    f->readings = json_incref(s->bench.readings);
    snprintf(f->booth, sizeof f->booth, "%s", b->booth.name);
    snprintf(f->software, sizeof f->software, "boothd %s", BOOTHD_VERSION);
    snprintf(f->observer, sizeof f->observer, "%s",
             observer_name((enum observer)b->quality.observer));
    snprintf(f->display.model, sizeof f->display.model, "%s", b->display.model);
    f->view.measured = *b->display.view;
    f->truth_emulated = s->bench.booth;
    clock_utc(f->started);
    return load_lamp(s, err);
}

// ---- patches of counts -----------------------------------------------------------------

static struct xyz predicted(const struct session_facts *f, const struct display_model *model,
                            struct counts counts)
{
    const struct lamp_report *l = &f->lamps[0];
    struct view_gains gains;
    double k = f->place.reflectance * l->proof_lux / M_PI / l->white_taught.Y;
    memcpy(gains.c, l->gains, sizeof gains.c);
    struct xyz out = display_view_leaves(model, gains, display_forward(model, counts));
    return (struct xyz){out.X + k * l->white_taught.X, out.Y + k * l->white_taught.Y,
                        out.Z + k * l->white_taught.Z};
}

static bool read_patches(struct session *s, int count, const struct display_model *model,
                         struct verification *v, struct error *err)
{
    struct patch_set set = {0};
    bool fine = patch_set_verify(count, SEED, &set, err);
    for (int i = 0; fine && i < set.count; i++) {
        struct verify_patch *p = &v->patches[i];
        char what[64];
        p->counts = set.patches[i].counts;
        p->predicted = predicted(s->facts, model, p->counts);
        snprintf(what, sizeof what, "patch of counts %d", i + 1);
        fine = bench_patch(&s->bench, p->counts, err) &&
               bench_measure(&s->bench, what, &p->measured, NULL, err);
        v->patch_count = i + 1;
        bench_progress(&s->bench, "patches", i + 1, set.count);
    }
    patch_set_fini(&set);
    return fine;
}

// How far the model is off counts when a budget asks for it.
static void sum_up(const struct verification *v, struct session_facts *f)
{
    struct xyz predicted[VERIFY_PATCHES], measured[VERIFY_PATCHES];
    for (int i = 0; i < v->patch_count; i++) {
        predicted[i] = v->patches[i].predicted;
        measured[i] = v->patches[i].measured;
    }
    f->display.verified = v->patch_count;
    f->display.residual =
        budget_residual(predicted, measured, v->patch_count, f->lamps[0].white_reference);
}

static bool show_all(struct session *s, const struct options *o, struct verification *v,
                     struct error *err)
{
    struct display_model *model = calloc(1, sizeof *model);
    if (!model)
        return fail(err, ERROR_SYSTEM, "out of memory");
    bool fine = session_chart(s, 0, err) &&
                (!o->patches || (display_load(s->settings.display.model, model, NULL, err) &&
                                 read_patches(s, o->patches, model, v, err)));
    free(model);
    if (fine)
        sum_up(v, s->facts);
    return fine;
}

// ---- the verdict -----------------------------------------------------------------------

static bool verify(struct session *s, const struct options *o, struct verification *v,
                   struct report *report, struct error *err)
{
    struct session_facts *f = s->facts;
    if (!begin(s, o, err) || !show_all(s, o, v, err) ||
        !(f->settings = bench_status(&s->bench, err)))
        return false;
    f->emulated =
        bench_emulated(&s->bench) || json_is_true(json_object_get(f->settings, "emulated"));
    clock_utc(f->finished);
    if (!report_make(f, "", o->uncertainty, DRAWS, report, err))
        return false;
    v->facts = f;
    v->report = report;
    return verify_judge(v, f->lamps[0].white_reference, err);
}

static bool tell(const struct verification *v, const struct options *o, struct error *err)
{
    json_t *all = o->out || o->json ? verify_as_json(v) : NULL;
    char *text = all ? json_dumps(all, JSON_INDENT(1) | JSON_REAL_PRECISION(9)) : NULL;
    bool fine = text || (!o->out && !o->json) ||
                fail(err, ERROR_DATA, "a figure of the verification cannot be written");
    json_decref(all);
    if (fine && text)
        fine = o->out ? seal_write(o->out, text, strlen(text), err)
                      : seal_fill(text, strlen(text), err);
    if (fine && o->json)
        puts(text);
    else if (fine)
        verify_as_text(v, stdout);
    free(text);
    return fine;
}

static int code_of(enum verdict verdict)
{
    switch (verdict) {
    case VERDICT_PASS:
        return COMMAND_FINE;
    case VERDICT_FAIL:
        return COMMAND_FAILED;
    case VERDICT_UNDECIDED:
        return UNDECIDED;
    }
    return COMMAND_FAILED;
}

int command_verify(int argc, char **argv)
{
    struct options o;
    struct error err = {0};
    struct session_facts *facts = calloc(1, sizeof *facts);
    struct session *s = calloc(1, sizeof *s);
    struct report *report = calloc(1, sizeof *report);
    struct verification *v = calloc(1, sizeof *v);
    int code = COMMAND_FAILED;
    bool fine = facts && s && report && v;
    if (fine) {
        verify_init(v);
        code = parse(argc, argv, &o, v);
    } else {
        fail(&err, ERROR_SYSTEM, "out of memory");
        code = command_failed(&err);
    }
    if (fine && !code) {
        *s = (struct session){.facts = facts, .material = o.material};
        fine = verify(s, &o, v, report, &err) && tell(v, &o, &err);
        code = fine ? code_of(v->verdict) : command_failed(&err);
        bench_close(&s->bench);
        report_fini(report);
        facts_fini(facts);
    }
    free(v);
    free(report);
    free(s);
    free(facts);
    return code < 0 ? COMMAND_FINE : code;
}
