// SPDX-License-Identifier: Apache-2.0
#include <getopt.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/commands.h"
#include "calibration/light.h"
#include "calibration/store_keep.h"
#include "calibration/teach.h"

struct options {
    const char *config, *folder;
    bool json;
};

static int parse(int argc, char **argv, struct options *o)
{
    static const struct option LONG[] = {{"config", required_argument, NULL, 'c'},
                                         {"lamps", required_argument, NULL, 'l'},
                                         {"json", no_argument, NULL, 'j'},
                                         {0}};
    *o = (struct options){0};
    optind = 0;
    for (int c; (c = getopt_long(argc, argv, "", LONG, NULL)) != -1;)
        switch (c) {
        case 'c':
            o->config = optarg;
            break;
        case 'l':
            o->folder = optarg;
            break;
        case 'j':
            o->json = true;
            break;
        default:
            return COMMAND_USAGE;
        }
    if (optind < argc || (!o->config && !o->folder))
        return command_bad_usage("boothcal light list: --config FILE or --lamps FOLDER is needed; "
                                 "see --help");
    return COMMAND_FINE;
}

static const char *or_dash(const char *text)
{
    return *text ? text : "-";
}

static void print_lamp(const struct lamp *lamp, int wide)
{
    struct xy xy = xy_of(xyz_absolute(&lamp->irradiance, OBSERVER_1931_2));
    struct cct cct = cct_of(xy);
    const struct lamp_file *f = &lamp->file;
    printf("%-*s %9.1f %7.4f %7.4f ", wide, f->name, f->taught_lux, xy.x, xy.y);
    if (cct.valid)
        printf("%7.0f %+8.4f", cct.kelvin, cct.duv);
    else
        printf("%7s %8s", "-", "-");
    printf(" %8.2f %9d  %-20s  %-28s  ", 100 * f->spread, f->readings, or_dash(f->taught_at),
           or_dash(f->instrument));
    if (*f->map)
        printf("%s (x %.4f)\n", f->map, f->map_scale);
    else
        printf("none\n");
}

static void print_table(const struct lamps *lamps)
{
    int wide = 4;
    for (int i = 0; i < lamps->count; i++)
        if ((int)strlen(lamps->lamps[i].file.name) > wide)
            wide = (int)strlen(lamps->lamps[i].file.name);
    printf("%-*s %9s %7s %7s %7s %8s %8s %9s  %-20s  %-28s  %s\n", wide, "LAMP", "LUX", "x", "y",
           "CCT K", "DUV", "SPREAD %", "READINGS", "TAUGHT AT", "INSTRUMENT", "MAP");
    for (int i = 0; i < lamps->count; i++)
        print_lamp(&lamps->lamps[i], wide);
}

static json_t *lamp_json(const struct lamp *lamp)
{
    struct xy xy = xy_of(xyz_absolute(&lamp->irradiance, OBSERVER_1931_2));
    struct cct cct = cct_of(xy);
    const struct lamp_file *f = &lamp->file;
    json_t *o = json_pack("{s:s, s:f, s:[f,f], s:f, s:i, s:s, s:s}", "name", f->name, "lux",
                          f->taught_lux, "xy", xy.x, xy.y, "spread", f->spread, "readings",
                          f->readings, "taught_at", f->taught_at, "instrument", f->instrument);
    json_object_set_new(o, "cct_k", cct.valid ? json_real(cct.kelvin) : json_null());
    json_object_set_new(o, "duv", cct.valid ? json_real(cct.duv) : json_null());
    json_object_set_new(o, "map", *f->map ? json_string(f->map) : json_null());
    json_object_set_new(o, "map_scale", *f->map ? json_real(f->map_scale) : json_null());
    return o;
}

static json_t *pair_json(const struct lamp *a, const struct lamp *b, const struct lamp_pair *p)
{
    static const char *const WORDS[] = {
        [LAMPS_APART] = "apart", [LAMPS_CLOSE] = "close", [LAMPS_ALIKE] = "alike"};
    return json_pack("{s:[s,s], s:f, s:f, s:s}", "lamps", a->file.name, b->file.name, "distance",
                     p->distance, "limit", p->limit, "likeness", WORDS[p->likeness]);
}

// Says which pairs are close; all pairs go into `pairs`, which may be NULL.
static bool compare(const struct lamps *lamps, double threshold, json_t *pairs)
{
    bool any = false;
    for (int i = 0; i < lamps->count; i++)
        for (int j = i + 1; j < lamps->count; j++) {
            const struct lamp *a = &lamps->lamps[i], *b = &lamps->lamps[j];
            struct lamp_pair p = lamps_compare(a, b, threshold);
            if (pairs)
                json_array_append_new(pairs, pair_json(a, b, &p));
            if (p.likeness == LAMPS_APART)
                continue;
            any = true;
            fprintf(stderr, "boothcal: warning: %s and %s %s: distance %.4f, limit %.4f\n",
                    a->file.name, b->file.name,
                    p.likeness == LAMPS_ALIKE ? "cannot be told apart" : "are close", p.distance,
                    p.limit);
        }
    return any;
}

static int show(const struct options *o, const struct lamps *lamps, double threshold)
{
    if (!o->json) {
        print_table(lamps);
        fflush(stdout);
        return compare(lamps, threshold, NULL) ? COMMAND_WARNED : COMMAND_FINE;
    }
    json_t *rows = json_array(), *pairs = json_array();
    for (int i = 0; i < lamps->count; i++)
        json_array_append_new(rows, lamp_json(&lamps->lamps[i]));
    bool close = compare(lamps, threshold, pairs);
    json_t *all = json_pack("{s:o, s:o}", "lamps", rows, "pairs", pairs);
    json_dumpf(all, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(all);
    return close ? COMMAND_WARNED : COMMAND_FINE;
}

int light_list_command(int argc, char **argv)
{
    struct options o;
    struct error err = {0};
    struct lamps lamps = {0};
    int code = parse(argc, argv, &o);
    if (code)
        return code;
    struct booth_settings *booth = malloc(sizeof *booth);
    if (!booth) {
        fail(&err, ERROR_SYSTEM, "out of memory");
        return command_failed(&err);
    }
    booth_preset(booth);
    bool placed;
    bool fine = !o.config || store_settings(o.config, booth, &placed, &err);
    const char *folder = o.folder ? o.folder : booth->lamps.folder;
    if (fine && !*folder)
        fine = fail(&err, ERROR_CONFIG, "%s: the store has no lamps yet", o.config);
    if (!fine || !lamps_load(folder, &lamps, &err))
        code = command_failed(&err);
    else
        code = show(&o, &lamps, booth->state.lamp_distance);
    lamps_fini(&lamps);
    free(booth);
    return code;
}
