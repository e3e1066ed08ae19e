// SPDX-License-Identifier: Apache-2.0
// boothcal history, diff, use: the versions of a calibration in the store.
#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/commands.h"
#include "calibration/compare.h"
#include "config/booth_store.h"

static const char HISTORY[] =
    "usage: boothcal history --config FILE [--verify] [--json]\n"
    "Lists the calibrations in the store of a booth and its display; '*' marks the one in\n"
    "force.\n"
    "  --config FILE  boothd's settings: [calibration] store, [booth] name, [display] serial\n"
    "  --verify       check the checksums of every file, too\n"
    "  --json         one JSON object\n"
    "Exit 3: the one in force has expired or cannot be used, or there is none.";

static const char DIFF[] =
    "usage: boothcal diff --config FILE A [B] [--json]\n"
    "Which files differ between two calibrations, and by how much: display models in\n"
    "CIEDE2000, lamps in per cent and CIEDE2000, geometry in metres.\n"
    "  --config FILE  boothd's settings\n"
    "  A, B           numbers of versions; without B: the one in force\n"
    "  --json         one JSON object";

static const char USE[] =
    "usage: boothcal use --config FILE N [--json]\n"
    "Puts a calibration of the store in force, once all of it has been verified. A running\n"
    "boothd takes it within a second.\n"
    "  --config FILE  boothd's settings\n"
    "  N              number of the version\n"
    "  --json         one JSON object\n"
    "Exit 3: done, but it has expired.";

struct options {
    const char *config;
    bool json, verify;
    int numbers[2], count;
    struct booth_settings booth;
    struct store_place place;
};

static bool take_number(struct options *o, const char *text, struct error *err)
{
    char *end;
    long number = strtol(text, &end, 10);
    if (o->count == 2 || *end || end == text || number < 1 || number > 999999)
        return fail(err, ERROR_CONFIG, "\"%s\": the number of a version is expected", text);
    o->numbers[o->count++] = (int)number;
    return true;
}

static bool take_options(int argc, char **argv, struct options *o, struct error *err)
{
    static const struct option LONG[] = {{"config", required_argument, NULL, 'c'},
                                         {"verify", no_argument, NULL, 'v'},
                                         {"json", no_argument, NULL, 'j'},
                                         {0}};
    optind = 0; // getopt starts anew
    opterr = 0;
    for (int c; (c = getopt_long(argc, argv, "", LONG, NULL)) != -1;)
        switch (c) {
        case 'c':
            o->config = optarg;
            break;
        case 'v':
            o->verify = true;
            break;
        case 'j':
            o->json = true;
            break;
        default:
            return fail(err, ERROR_CONFIG, "%s: unknown, or its value is missing",
                        argv[optind - 1]);
        }
    for (; optind < argc; optind++)
        if (!take_number(o, argv[optind], err))
            return false;
    return true;
}

// The command line and the place it is about; COMMAND_FINE to go on, -1 when help was printed.
static int prepare(int argc, char **argv, const char *usage, int least, int most, struct options *o)
{
    struct error err = {0};
    *o = (struct options){0};
    for (int i = 1; i < argc; i++)
        if (!strcmp(argv[i], "--help") || !strcmp(argv[i], "-h"))
            return puts(usage), -1;
    if (!take_options(argc, argv, o, &err))
        return command_bad_input(&err);
    if (!o->config || o->count < least || o->count > most || (o->verify && usage != HISTORY))
        return command_bad_usage("%s", usage);
    return booth_load(o->config, NULL, 0, &o->booth, &err) &&
                   booth_store_place(&o->booth, &o->place, &err)
               ? COMMAND_FINE
               : command_failed(&err);
}

static void print_json(json_t *object)
{
    json_dumpf(object, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(object);
}

// ---- history ----------------------------------------------------------------

struct row {
    struct store_manifest manifest;
    struct error bad; // why it cannot be used
    bool current, expired;
};

static void take_row(const struct options *o, int number, int current, struct row *r)
{
    struct store_version v;
    *r = (struct row){.current = number == current};
    if (!store_manifest(&o->place, number, &r->manifest, &r->bad))
        r->manifest.version = number;
    else if ((o->verify || r->current) && store_open(&o->place, number, &v, &r->bad))
        store_version_fini(&v);
    r->expired = store_expired(&r->manifest, clock_utc_s());
}

static void print_row(const struct row *r)
{
    const struct store_manifest *m = &r->manifest;
    printf("%c %04d  %-20s  %s%-20s  %s\n", r->current ? '*' : ' ', m->version, m->created,
           r->expired        ? "expired     "
           : *m->valid_until ? "valid until "
                             : "valid       ",
           *m->valid_until ? m->valid_until : "for ever", m->note);
    if (r->bad.code)
        printf("        cannot be used: %s\n", r->bad.text);
}

static json_t *row_json(const struct row *r)
{
    const struct store_manifest *m = &r->manifest;
    return json_pack("{s:i, s:b, s:s, s:o, s:b, s:s, s:s, s:i, s:o}", "version", m->version,
                     "in_force", r->current, "created", m->created, "valid_until",
                     *m->valid_until ? json_string(m->valid_until) : json_null(), "expired",
                     r->expired, "software", m->software, "note", m->note, "based_on", m->based_on,
                     "error", r->bad.code ? json_string(r->bad.text) : json_null());
}

static int history(const struct options *o, const int *numbers, int count, int current)
{
    json_t *all = json_array();
    bool sound = false;
    if (!o->json)
        printf("%s, %s: %s\n", o->place.booth, o->place.display, o->place.folder);
    for (int i = 0; i < count; i++) {
        struct row r;
        take_row(o, numbers[i], current, &r);
        sound = sound || (r.current && !r.bad.code && !r.expired);
        json_array_append_new(all, row_json(&r));
        if (!o->json)
            print_row(&r);
    }
    if (o->json)
        print_json(json_pack("{s:s, s:s, s:s, s:o}", "booth", o->place.booth, "display",
                             o->place.display, "folder", o->place.folder, "versions", all));
    else
        json_decref(all);
    return sound ? COMMAND_FINE : command_warned("no calibration is in force that can be used");
}

int command_history(int argc, char **argv)
{
    struct options o;
    struct error err = {0};
    int *numbers = NULL, count = 0, current = 0;
    int code = prepare(argc, argv, HISTORY, 0, 0, &o);
    if (code)
        return code < 0 ? COMMAND_FINE : code;
    if (!store_current(&o.place, &current, &err)) // each version can still be listed
        fprintf(stderr, "boothcal: %s\n", err.text);
    if (!store_numbers(&o.place, &numbers, &count, &err))
        return command_failed(&err);
    code = history(&o, numbers, count, current);
    free(numbers);
    return code;
}

// ---- diff -------------------------------------------------------------------

static const char *change_name(enum file_change_kind kind)
{
    switch (kind) {
    case FILE_ADDED:
        return "added";
    case FILE_REMOVED:
        return "removed";
    case FILE_CHANGED:
        return "changed";
    }
    return "";
}

static void print_difference(const struct difference *d)
{
    for (int i = 0; i < d->file_count; i++)
        printf("%-8s %s\n", change_name(d->files[i].kind), d->files[i].path);
    if (!d->file_count)
        printf("no file differs\n");
    const struct display_change *s = &d->display;
    if (s->there && s->de00.max > 0)
        printf("display: equal counts, CIEDE2000 mean %.3f, 95th percentile %.3f, largest %.3f; "
               "white %+.2f %%, black %+.4f cd/m2\n",
               s->de00.mean, s->de00.p95, s->de00.max, s->white_percent, s->black_cdm2);
    for (int i = 0; i < d->lamp_count; i++) {
        const struct lamp_change *l = &d->lamps[i];
        printf("lamp %s: illuminance %+.2f %%, colour %.3f CIEDE2000, shape %.4f", l->name,
               l->lux_percent, l->white_de00, l->shape);
        if (l->maps)
            printf("; map: mean %+.2f %%, centre moved by %.4f m", l->map_percent, l->map_shift_m);
        putchar('\n');
    }
    if (d->geometry.there)
        printf("geometry: the screen's corners by up to %.4f m, the eye by %.4f m\n",
               d->geometry.screen_m, d->geometry.eye_m);
}

static json_t *lamps_json(const struct difference *d)
{
    json_t *all = json_array();
    for (int i = 0; i < d->lamp_count; i++) {
        const struct lamp_change *l = &d->lamps[i];
        json_t *one = json_pack("{s:s, s:f, s:f, s:f}", "name", l->name, "lux_percent",
                                l->lux_percent, "de00", l->white_de00, "shape", l->shape);
        if (l->maps) {
            json_object_set_new(one, "map_percent", json_real(l->map_percent));
            json_object_set_new(one, "map_shift_m", json_real(l->map_shift_m));
        }
        json_array_append_new(all, one);
    }
    return all;
}

static json_t *difference_json(const struct difference *d)
{
    json_t *files = json_array();
    for (int i = 0; i < d->file_count; i++)
        json_array_append_new(files, json_pack("{s:s, s:s}", "path", d->files[i].path, "change",
                                               change_name(d->files[i].kind)));
    const struct display_change *s = &d->display;
    json_t *display =
        s->there ? json_pack("{s:f, s:f, s:f, s:f, s:f}", "de00_mean", s->de00.mean, "de00_p95",
                             s->de00.p95, "de00_max", s->de00.max, "white_percent",
                             s->white_percent, "black_cdm2", s->black_cdm2)
                 : json_null();
    json_t *geometry = d->geometry.there ? json_pack("{s:f, s:f}", "screen_m", d->geometry.screen_m,
                                                     "eye_m", d->geometry.eye_m)
                                         : json_null();
    return json_pack("{s:o, s:o, s:o, s:o}", "files", files, "display", display, "lamps",
                     lamps_json(d), "geometry", geometry);
}

static bool second(struct options *o, struct error *err)
{
    if (o->count == 2)
        return true;
    return store_current(&o->place, &o->numbers[1], err) &&
           (o->numbers[1] || fail(err, ERROR_CONFIG, "no calibration is in force"));
}

static int print_both(const struct options *o, const struct store_version *a,
                      const struct store_version *b)
{
    struct error err = {0};
    struct difference d;
    if (!compare_versions(a, b, &o->booth, &d, &err))
        return command_failed(&err);
    if (o->json)
        print_json(difference_json(&d));
    else
        print_difference(&d);
    difference_fini(&d);
    return COMMAND_FINE;
}

int command_diff(int argc, char **argv)
{
    struct options o;
    struct error err = {0};
    struct store_version a = {0}, b = {0};
    int code = prepare(argc, argv, DIFF, 1, 2, &o);
    if (code)
        return code < 0 ? COMMAND_FINE : code;
    if (!second(&o, &err) || !store_open(&o.place, o.numbers[0], &a, &err) ||
        !store_open(&o.place, o.numbers[1], &b, &err))
        code = command_failed(&err);
    else
        code = print_both(&o, &a, &b);
    store_version_fini(&a);
    store_version_fini(&b);
    return code;
}

// ---- use --------------------------------------------------------------------

int command_use(int argc, char **argv)
{
    struct options o;
    struct error err = {0};
    struct store_manifest m;
    int code = prepare(argc, argv, USE, 1, 1, &o);
    if (code)
        return code < 0 ? COMMAND_FINE : code;
    if (!store_use(&o.place, o.numbers[0], &err) ||
        !store_manifest(&o.place, o.numbers[0], &m, &err))
        return command_failed(&err);
    bool expired = store_expired(&m, clock_utc_s());
    if (o.json)
        print_json(json_pack("{s:i, s:s, s:b, s:s}", "version", m.version, "created", m.created,
                             "expired", expired, "note", m.note));
    else
        printf("%04d of %s is in force: %s\n", m.version, m.created, m.note);
    return command_warned(expired ? "it has expired" : "");
}
