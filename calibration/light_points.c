// SPDX-License-Identifier: Apache-2.0
#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "calibration/commands.h"
#include "calibration/light.h"
#include "config/booth.h"
#include "files/write.h"

struct options {
    const char *map, *config, *out, *png;
    long count;
    double scale;
    enum median_cut cut;
    bool json;
};

static const char *const CUTS[] = {[CUT_VARIANCE] = "variance", [CUT_ENERGY] = "energy"};

static bool whole_number(const char *text, long *out)
{
    char *end;
    *out = strtol(text, &end, 10);
    return end != text && !*end;
}

static bool positive(const char *text, double *out)
{
    const char *end;
    return number_parse(text, &end, out) && !*end && *out > 0;
}

static bool take_cut(const char *text, enum median_cut *out)
{
    *out = strcmp(text, CUTS[CUT_ENERGY]) ? CUT_VARIANCE : CUT_ENERGY;
    return !strcmp(text, CUTS[*out]);
}

static bool take(int option, struct options *o)
{
    switch (option) {
    case 'c':
        return whole_number(optarg, &o->count);
    case 'h':
        return take_cut(optarg, &o->cut);
    case 's':
        return positive(optarg, &o->scale);
    case 'f':
        o->config = optarg;
        return true;
    case 'o':
        o->out = optarg;
        return true;
    case 'p':
        o->png = optarg;
        return true;
    case 'j':
        o->json = true;
        return true;
    default:
        return false;
    }
}

static int parse(int argc, char **argv, struct options *o)
{
    static const struct option LONG[] = {
        {"count", required_argument, NULL, 'c'}, {"cut", required_argument, NULL, 'h'},
        {"scale", required_argument, NULL, 's'}, {"config", required_argument, NULL, 'f'},
        {"out", required_argument, NULL, 'o'},   {"png", required_argument, NULL, 'p'},
        {"json", no_argument, NULL, 'j'},        {0},
    };
    *o = (struct options){.scale = 1};
    optind = 0;
    for (int c; (c = getopt_long(argc, argv, ":o:", LONG, NULL)) != -1;)
        if (!take(c, o))
            return command_bad_usage("boothcal light points: %s is unknown, lacks its value or "
                                     "cannot have that one; see --help",
                                     argv[optind - 1]);
    if (optind + 1 != argc || !o->count)
        return command_bad_usage("boothcal light points: one MAP.exr and --count are needed; see "
                                 "--help");
    o->map = argv[optind];
    return COMMAND_FINE;
}

static bool load(const struct options *o, struct luminance_map *map, struct error *err)
{
    struct booth_settings *booth = o->config ? malloc(sizeof *booth) : NULL;
    if (o->config && !booth)
        return fail(err, ERROR_SYSTEM, "out of memory");
    bool fine = (!booth || booth_load(o->config, NULL, 0, booth, err)) &&
                luminance_map_load(o->map, booth ? &booth->ceiling : NULL, map, err);
    free(booth);
    if (fine)
        luminance_map_scale(map, o->scale);
    return fine;
}

static double candela(const struct light_points *lights)
{
    double sum = 0;
    for (int i = 0; i < lights->count; i++)
        sum += lights->points[i].intensity_cd;
    return sum;
}

static void print_csv(const struct light_points *lights, const struct pixels *regions, FILE *out)
{
    fputs("x_m,y_m,z_m,intensity_cd,left_px,top_px,right_px,bottom_px\n", out);
    for (int i = 0; i < lights->count; i++) {
        const struct light_point *p = &lights->points[i];
        const struct pixels *r = &regions[i];
        char x[NUMBER_TEXT], y[NUMBER_TEXT], z[NUMBER_TEXT], cd[NUMBER_TEXT];
        fprintf(out, "%s,%s,%s,%s,%d,%d,%d,%d\n", number_text(x, p->at.x), number_text(y, p->at.y),
                number_text(z, p->at.z), number_text(cd, p->intensity_cd), r->left, r->top,
                r->right, r->bottom);
    }
}

static bool save_csv(const char *path, const struct light_points *lights,
                     const struct pixels *regions, struct error *err)
{
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    print_csv(lights, regions, file.stream);
    return whole_file_commit(&file, err);
}

static void print_json(const struct options *o, const struct luminance_map *map,
                       const struct light_points *lights, const struct pixels *regions)
{
    json_t *points = json_array();
    for (int i = 0; i < lights->count; i++) {
        const struct light_point *p = &lights->points[i];
        const struct pixels *r = &regions[i];
        json_array_append_new(points, json_pack("{s:[f,f,f], s:f, s:[i,i,i,i]}", "at_m", p->at.x,
                                                p->at.y, p->at.z, "intensity_cd", p->intensity_cd,
                                                "region_px", r->left, r->top, r->right, r->bottom));
    }
    json_t *all =
        json_pack("{s:s, s:s, s:i, s:i, s:f, s:f, s:f, s:o}", "map", o->map, "cut", CUTS[o->cut],
                  "width_px", map->width, "height_px", map->height, "width_m", map->ceiling.width_m,
                  "depth_m", map->ceiling.depth_m, "candela", candela(lights), "points", points);
    json_dumpf(all, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(15));
    putchar('\n');
    json_decref(all);
}

static bool hand_out(const struct options *o, const struct luminance_map *map,
                     const struct light_points *lights, const struct pixels *regions,
                     struct error *err)
{
    if (o->out && !save_csv(o->out, lights, regions, err))
        return false;
    if (o->png && !light_picture(o->png, map, lights, regions, err))
        return false;
    if (o->json)
        print_json(o, map, lights, regions);
    else if (!o->out)
        print_csv(lights, regions, stdout);
    else
        printf("%s: %d points, %.6g cd straight down together\n", o->out, lights->count,
               candela(lights));
    return true;
}

int light_points_command(int argc, char **argv)
{
    struct options o;
    struct error err = {0};
    struct luminance_map map = {0};
    struct light_points lights = {0};
    struct pixels *regions = NULL;
    int code = parse(argc, argv, &o);
    if (code)
        return code;
    if (o.count < 1 || o.count > MEDIAN_CUT_MOST)
        return command_bad_usage("boothcal light points: --count %ld is outside 1..%d", o.count,
                                 MEDIAN_CUT_MOST);
    bool fine = load(&o, &map, &err) &&
                median_cut_regions(&map, o.cut, (int)o.count, &lights, &regions, &err) &&
                (lights.count > 0 || fail(&err, ERROR_DATA, "%s: is dark all over", o.map)) &&
                hand_out(&o, &map, &lights, regions, &err);
    if (!fine)
        code = command_failed(&err);
    else if (lights.count < o.count)
        fprintf(stderr, "boothcal: %s: %d points; it has no more lit pixels\n", o.map,
                lights.count);
    luminance_map_fini(&map);
    light_points_fini(&lights);
    free(regions);
    return code;
}
