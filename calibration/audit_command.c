// SPDX-License-Identifier: Apache-2.0
// boothcal audit: what the spectrometer alone can tell of a booth's lamps.
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/audit_report.h"
#include "calibration/bench.h"
#include "calibration/commands.h"
#include "calibration/teach.h"
#include "config/lamps.h"

enum { LIVE_READINGS = 10 };

static const char USAGE[] =
    "usage: boothcal audit [NAME=]SPECTRUM... [--absolute] [--nine] [options]\n"
    "       boothcal audit --lamps FOLDER [options]\n"
    "       boothcal audit --config FILE --lamp NAME... [--nine] [options]\n"
    "\n"
    "What the spectrometer alone can tell of a booth's lamps: illuminance, uniformity,\n"
    "x y u'v', CCT, Duv, CIE Ra and R1..R14, special metamerism indices between lamps, each\n"
    "beside the figures of ISO 3664:2009, and the drift since the last audit. From files of\n"
    "spectra, from lamps as taught, or live through the running boothd.\n"
    "\n"
    "  SPECTRUM             CSV (nm, v1, v2, ...) or CGATS (.sp): each column is a lamp\n"
    "  --absolute           the files are in W m-2 nm-1, else they say nothing of illuminance\n"
    "  --nine               nine places of one lamp: the columns of a file, or asked for one\n"
    "                       after another; row by row from the far left\n"
    "  --lamps FOLDER       boothd's lamp folder\n"
    "  --config FILE        boothd's settings\n"
    "  --socket PATH        boothd's control socket (default: the settings', else the user's)\n"
    "  --booth PATH         control socket of an emulated booth\n"
    "  --lamp NAME          a lamp to switch to and read; again for each\n"
    "  --pairs TABLE        reflectances in pairs of columns that match under some lamp\n"
    "  --previous FILE      an earlier audit (-o), to compare with\n"
    "  --condition P1|P2    viewing condition: ends with 3 when a lamp is outside its figures\n"
    "  -o FILE              write the audit as sealed JSON\n"
    "  --json               JSON instead of text\n"
    "  --help\n"
    "\n"
    "Ends with 0; 1 when it failed; 2 on wrong usage or input; 3 done, but outside a figure\n"
    "of --condition.\n";

struct options {
    const char *lamps, *config, *socket, *booth, *pairs, *previous, *condition, *out;
    const char *live[AUDIT_LAMPS];
    int live_count;
    char **files;
    int file_count;
    bool absolute, nine, json;
};

static bool take(struct options *o, int c)
{
    const struct {
        int option;
        const char **text;
    } texts[] = {{'F', &o->lamps},     {'c', &o->config}, {'s', &o->socket},
                 {'b', &o->booth},     {'p', &o->pairs},  {'v', &o->previous},
                 {'n', &o->condition}, {'o', &o->out},    {0}};
    for (int i = 0; texts[i].option; i++)
        if (texts[i].option == c) {
            *texts[i].text = optarg;
            return true;
        }
    o->absolute |= c == 'a';
    o->nine |= c == '9';
    o->json |= c == 'j';
    if (c == 'l' && o->live_count < AUDIT_LAMPS)
        o->live[o->live_count++] = optarg;
    return c != '?';
}

static int usage(const char *what)
{
    return command_bad_usage("boothcal audit: %s; see boothcal audit --help", what);
}

static int check(const struct options *o)
{
    int ways = (o->file_count > 0) + (o->lamps != NULL) + (o->config != NULL);
    if (ways != 1)
        return usage("one of SPECTRUM..., --lamps and --config is needed");
    if (o->config ? !o->live_count : o->live_count || o->socket || o->booth)
        return usage("--lamp, --socket and --booth belong to --config, which needs a --lamp");
    if (o->absolute && !o->file_count)
        return usage("--absolute is about files of spectra");
    if (o->nine && o->lamps)
        return usage("a lamp was taught at one place: no --nine");
    if (o->condition && strcmp(o->condition, "P1") && strcmp(o->condition, "P2"))
        return usage("--condition is P1 or P2");
    return 0;
}

// 0, an exit code, or -1: help was asked for.
static int parse(int argc, char **argv, struct options *o)
{
    static const struct option LONG[] = {
        {"absolute", no_argument, NULL, 'a'},
        {"nine", no_argument, NULL, '9'},
        {"lamps", required_argument, NULL, 'F'},
        {"config", required_argument, NULL, 'c'},
        {"socket", required_argument, NULL, 's'},
        {"booth", required_argument, NULL, 'b'},
        {"lamp", required_argument, NULL, 'l'},
        {"pairs", required_argument, NULL, 'p'},
        {"previous", required_argument, NULL, 'v'},
        {"condition", required_argument, NULL, 'n'},
        {"json", no_argument, NULL, 'j'},
        {"help", no_argument, NULL, 'h'},
        {0},
    };
    optind = 0;
    for (int c; (c = getopt_long(argc, argv, "o:h", LONG, NULL)) != -1;) {
        if (c == 'h')
            return fputs(USAGE, stdout), -1;
        if (!take(o, c))
            return COMMAND_USAGE;
    }
    o->files = argv + optind;
    o->file_count = argc - optind;
    return check(o);
}

// ---- where lamps come from -------------------------------------------------------

static struct audit_lamp *next_lamp(struct audit_facts *f, const char *name, const char *source,
                                    struct error *err)
{
    if (f->lamp_count == AUDIT_LAMPS) {
        fail(err, ERROR_RANGE, "%s: more than %d lamps", source, AUDIT_LAMPS);
        return NULL;
    }
    struct audit_lamp *l = &f->lamps[f->lamp_count++];
    snprintf(l->name, sizeof l->name, "%s", name);
    snprintf(l->source, sizeof l->source, "%s", source);
    return l;
}

// What a file is called without its folder and suffix.
static void stem(const char *path, char *out, size_t size)
{
    const char *name = strrchr(path, '/') ? strrchr(path, '/') + 1 : path;
    const char *dot = strrchr(name, '.');
    snprintf(out, size, "%.*s", dot && dot > name ? (int)(dot - name) : (int)strlen(name), name);
}

static bool nine_of_file(struct audit_facts *f, const char *name, const char *path,
                         const struct spectra *s, bool absolute, struct error *err)
{
    if (s->count != AUDIT_PLACES)
        return fail(err, ERROR_DATA, "%s: %d spectra; --nine needs nine", path, s->count);
    struct audit_lamp *l = next_lamp(f, name, path, err);
    if (!l)
        return false;
    l->absolute = absolute;
    l->irradiance = s->spectra[AUDIT_CENTRE];
    l->places = AUDIT_PLACES;
    for (int i = 0; i < AUDIT_PLACES; i++)
        l->place_lux[i] = xyz_absolute(&s->spectra[i], OBSERVER_1931_2).Y;
    return true;
}

// The columns of a file, called by their own names where it has several.
static bool lamps_of_spectra(struct audit_facts *f, const char *name, const char *path,
                             const struct spectra *s, bool absolute, struct error *err)
{
    for (int i = 0; i < s->count; i++) {
        struct audit_lamp *l = next_lamp(f, s->count == 1 ? name : s->names[i], path, err);
        if (!l)
            return false;
        l->absolute = absolute;
        l->irradiance = s->spectra[i];
    }
    return true;
}

static bool from_file(struct audit_facts *f, const struct options *o, const char *text,
                      struct error *err)
{
    struct spectra s = {0};
    char name[64];
    const char *equals = strchr(text, '=');
    const char *path = equals ? equals + 1 : text;
    if (equals)
        snprintf(name, sizeof name, "%.*s", (int)(equals - text), text);
    else
        stem(path, name, sizeof name);
    bool fine = spectra_load(path, false, &s, err) && sealed_inputs_add(&f->inputs, path, err) &&
                (o->nine ? nine_of_file(f, name, path, &s, o->absolute, err)
                         : lamps_of_spectra(f, name, path, &s, o->absolute, err));
    spectra_fini(&s);
    return fine;
}

static bool from_folder(struct audit_facts *f, const char *folder, struct error *err)
{
    struct lamps lamps = {0};
    bool fine = lamps_load(folder, &lamps, err);
    for (int i = 0; fine && i < lamps.count; i++) {
        const struct lamp *lamp = &lamps.lamps[i];
        struct audit_lamp *l = next_lamp(f, lamp->file.name, lamp->file.spectrum, err);
        fine = l && sealed_inputs_add(&f->inputs, lamp->file.spectrum, err);
        if (!fine)
            break;
        l->absolute = true;
        l->irradiance = lamp->irradiance;
        l->readings = lamp->file.readings;
        l->spread = lamp->file.spread;
        memcpy(l->instrument, lamp->file.instrument, sizeof l->instrument);
        memcpy(l->taken, lamp->file.taught_at, sizeof l->taken);
    }
    lamps_fini(&lamps);
    return fine && (f->lamp_count || fail(err, ERROR_CONFIG, "%s: no lamp was taught", folder));
}

static bool read_nine(struct bench *b, struct audit_lamp *l, struct error *err)
{
    static const char *const ROWS[] = {"far", "middle", "near"};
    static const char *const COLUMNS[] = {"left", "middle", "right"};
    for (int i = 0; i < AUDIT_PLACES; i++) {
        char where[64];
        struct taught taught;
        snprintf(where, sizeof where, "place %d of nine: %s row, %s", i + 1, ROWS[i / 3],
                 COLUMNS[i % 3]);
        if (!bench_place_spectrometer(b, where, err) ||
            !bench_teach(b, l->name, LIVE_READINGS, &taught, err))
            return false;
        l->place_lux[i] = taught.lux;
        if (i == AUDIT_CENTRE)
            l->irradiance = taught.irradiance;
    }
    l->places = AUDIT_PLACES;
    return true;
}

static bool read_lamp(struct bench *b, struct audit_facts *f, const char *name, bool nine,
                      struct error *err)
{
    struct taught taught;
    struct steadiness steadiness;
    struct audit_lamp *l = next_lamp(f, name, "read", err);
    if (!l || !teach_await(b, name, &TEACH_WHOLE, &steadiness, err) ||
        !bench_teach(b, name, LIVE_READINGS, &taught, err))
        return while_doing(err, "lamp %s", name);
    l->absolute = true;
    l->irradiance = taught.irradiance;
    l->spread = taught.spread;
    l->readings = LIVE_READINGS;
    memcpy(l->instrument, taught.instrument, sizeof l->instrument);
    clock_utc(l->taken);
    return !nine || read_nine(b, l, err);
}

static bool read_live(struct audit_facts *f, const struct options *o, struct error *err)
{
    struct booth_settings settings;
    struct bench bench = {0};
    if (!booth_load(o->config, NULL, 0, &settings, err) ||
        !bench_open(&bench, &settings, o->socket, o->booth, err))
        return false;
    memcpy(f->booth, settings.booth.name, sizeof f->booth);
    bool fine = true;
    for (int i = 0; fine && i < o->live_count; i++) {
        fine = read_lamp(&bench, f, o->live[i], o->nine, err);
        bench_progress(&bench, "lamps", i + 1, o->live_count);
    }
    f->emulated = bench_emulated(&bench);
    bench_close(&bench);
    return fine;
}

static bool read_lamps(struct audit_facts *f, const struct options *o, struct error *err)
{
    if (o->lamps)
        return from_folder(f, o->lamps, err);
    if (o->config)
        return read_live(f, o, err);
    for (int i = 0; i < o->file_count; i++)
        if (!from_file(f, o, o->files[i], err))
            return false;
    return true;
}

// ---- the audit ---------------------------------------------------------------------

static bool add_pairs(struct audit_facts *f, const char *path, struct error *err)
{
    struct spectra samples = {0};
    bool fine = spectra_load(path, true, &samples, err) &&
                sealed_inputs_add(&f->inputs, path, err) &&
                (audit_metamerism(f, &samples, err) || while_doing(err, "%s", path));
    spectra_fini(&samples);
    return fine;
}

static bool compare(struct audit_facts *f, const char *path, struct error *err)
{
    struct audit_facts *before = calloc(1, sizeof *before);
    if (!before)
        return fail(err, ERROR_SYSTEM, "out of memory");
    bool fine = audit_load(path, before, err) && sealed_inputs_add(&f->inputs, path, err);
    if (fine)
        audit_compare(f, before);
    free(before);
    return fine;
}

static bool audit(struct audit_facts *f, const struct options *o, struct error *err)
{
    snprintf(f->software, sizeof f->software, "boothd %s", BOOTHD_VERSION);
    bool fine = read_lamps(f, o, err) && audit_judge(f, err) &&
                (!o->pairs || add_pairs(f, o->pairs, err)) &&
                (!o->previous || compare(f, o->previous, err));
    clock_utc(f->made);
    return fine && (!o->out || audit_save(f, o->out, err));
}

static bool print_json(const struct audit_facts *f, struct error *err)
{
    json_t *all = audit_as_json(f);
    char *text = all ? json_dumps(all, JSON_INDENT(1) | JSON_REAL_PRECISION(12)) : NULL;
    bool fine = text ? seal_fill(text, strlen(text), err)
                     : fail(err, ERROR_DATA, "a lamp's name is no UTF-8 text");
    if (fine)
        puts(text);
    free(text);
    json_decref(all);
    return fine;
}

// One warning that names every figure of the condition that a lamp is outside of.
static int judged(const struct audit_facts *f, const char *condition)
{
    enum audit_figure other = condition && !strcmp(condition, "P1") ? FIGURE_P2 : FIGURE_P1;
    char text[1024] = "";
    size_t at = 0;
    for (int i = 0; condition && i < f->lamp_count; i++)
        for (int k = 0; k < FIGURES; k++)
            if (f->lamps[i].figures[k].verdict == FIGURE_OUTSIDE && k != (int)other &&
                at < sizeof text - 1)
                at += (size_t)snprintf(text + at, sizeof text - at, "%slamp %s: %s",
                                       at ? "; " : "outside ", f->lamps[i].name,
                                       audit_limits[k].name);
    return command_warned(text);
}

int command_audit(int argc, char **argv)
{
    struct options o = {0};
    struct error err = {0};
    int code = parse(argc, argv, &o);
    if (code)
        return code < 0 ? COMMAND_FINE : code;
    struct audit_facts *facts = calloc(1, sizeof *facts);
    bool fine = facts ? audit(facts, &o, &err) : fail(&err, ERROR_SYSTEM, "out of memory");
    if (fine && o.json)
        fine = print_json(facts, &err);
    else if (fine)
        audit_as_text(facts, stdout);
    code = fine ? judged(facts, o.condition) : command_failed(&err);
    if (facts)
        audit_fini(facts);
    free(facts);
    return code;
}
