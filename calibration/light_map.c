// SPDX-License-Identifier: Apache-2.0
#include <getopt.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "calibration/ceiling_photo.h"
#include "calibration/commands.h"
#include "calibration/light.h"

static const double CLIPPED_WARN = 1e-4, OFF_WARN = 0.03, METHODS_WARN = 0.05, NOISE_WARN = 3;

struct options {
    struct ceiling_recipe recipe;
    const char *config, *socket, *booth, *camera, *out, *png, *save_response, *lamp;
    struct spot_reading readings[SPOTS_MOST];
    int reading_count;
    double size_m[2], pixels[2], corners[8], lens[5], focal_px, axis_px[2], falloff[3];
    bool lens_given, axis_given, measure, json;
    int top;        // -1 = not given
    double inset_m; // NAN = not given
};

enum {
    CONFIG = 256,
    SIZE,
    CORNERS,
    TOP,
    INSET,
    CAMERA,
    LENS,
    FOCAL,
    AXIS,
    VIGNETTING,
    RESPONSE,
    SAVE_RESPONSE,
    SPOT,
    MEASURE,
    SOCKET,
    BOOTH,
    LAMP,
    PIXELS,
    PNG,
    JSON
};

static const struct option LONG[] = {{"config", required_argument, NULL, CONFIG},
                                     {"size", required_argument, NULL, SIZE},
                                     {"corners", required_argument, NULL, CORNERS},
                                     {"top", required_argument, NULL, TOP},
                                     {"inset", required_argument, NULL, INSET},
                                     {"camera", required_argument, NULL, CAMERA},
                                     {"lens", required_argument, NULL, LENS},
                                     {"focal", required_argument, NULL, FOCAL},
                                     {"axis", required_argument, NULL, AXIS},
                                     {"vignetting", required_argument, NULL, VIGNETTING},
                                     {"response", required_argument, NULL, RESPONSE},
                                     {"save-response", required_argument, NULL, SAVE_RESPONSE},
                                     {"spot", required_argument, NULL, SPOT},
                                     {"measure", no_argument, NULL, MEASURE},
                                     {"socket", required_argument, NULL, SOCKET},
                                     {"booth", required_argument, NULL, BOOTH},
                                     {"lamp", required_argument, NULL, LAMP},
                                     {"pixels", required_argument, NULL, PIXELS},
                                     {"out", required_argument, NULL, 'o'},
                                     {"png", required_argument, NULL, PNG},
                                     {"json", no_argument, NULL, JSON},
                                     {0}};

// Exactly count numbers between commas.
static bool numbers(int count, double *out)
{
    const char *at = optarg;
    for (int i = 0; i < count; i++) {
        if (!number_parse(at, &at, &out[i]) || *at != (i < count - 1 ? ',' : 0))
            return false;
        at++;
    }
    return true;
}

static bool one_of(const char *const *names, int *out)
{
    for (int i = 0; names[i]; i++)
        if (!strcmp(optarg, names[i])) {
            *out = i;
            return true;
        }
    return false;
}

static bool take_response(struct ceiling_recipe *r)
{
    static const char *const NAMES[] = {"auto", "robertson", "debevec", "linear", NULL};
    int which = CURVE_FILE;
    if (!one_of(NAMES, &which))
        r->response_file = optarg;
    r->response = (enum response_source)which;
    return true;
}

static bool take_spot(struct options *o)
{
    double v[3];
    if (o->reading_count == SPOTS_MOST || !numbers(3, v) || !(v[2] > 0))
        return false;
    o->readings[o->reading_count++] = (struct spot_reading){v[0], v[1], v[2]};
    return true;
}

static bool take_vignetting(struct options *o)
{
    o->recipe.camera.cos4 = !strcmp(optarg, "cos4");
    return o->recipe.camera.cos4 || numbers(3, o->falloff);
}

static bool take_text(int option, struct options *o)
{
    const char **to = option == CONFIG          ? &o->config
                      : option == SOCKET        ? &o->socket
                      : option == BOOTH         ? &o->booth
                      : option == CAMERA        ? &o->camera
                      : option == LAMP          ? &o->lamp
                      : option == PNG           ? &o->png
                      : option == SAVE_RESPONSE ? &o->save_response
                      : option == 'o'           ? &o->out
                                                : NULL;
    if (to)
        *to = optarg;
    return to;
}

static bool take(int option, struct options *o)
{
    static const char *const SIDES[] = {"near", "far", "left", "right", NULL};
    switch (option) {
    case SIZE:
        return numbers(2, o->size_m) && o->size_m[0] > 0 && o->size_m[1] > 0;
    case CORNERS:
        o->recipe.corners_given = true;
        return numbers(8, o->corners);
    case TOP:
        return one_of(SIDES, &o->top);
    case INSET:
        return numbers(1, &o->inset_m) && o->inset_m >= 0;
    case LENS:
        o->lens_given = true;
        return numbers(5, o->lens);
    case FOCAL:
        return numbers(1, &o->focal_px) && o->focal_px > 0;
    case AXIS:
        o->axis_given = true;
        return numbers(2, o->axis_px);
    case VIGNETTING:
        return take_vignetting(o);
    case RESPONSE:
        return take_response(&o->recipe);
    case SPOT:
        return take_spot(o);
    case MEASURE:
        return o->measure = true;
    case PIXELS:
        return numbers(2, o->pixels) && o->pixels[0] >= 1 && o->pixels[1] >= 1;
    case JSON:
        return o->json = true;
    default:
        return take_text(option, o);
    }
}

static int parse(int argc, char **argv, struct options *o)
{
    *o = (struct options){.lamp = "", .top = -1, .inset_m = NAN};
    optind = 0;
    for (int c; (c = getopt_long(argc, argv, ":o:", LONG, NULL)) != -1;)
        if (!take(c, o))
            return command_bad_usage("boothcal light map: %s is unknown, lacks its value or "
                                     "cannot have that one; see --help",
                                     argv[optind - 1]);
    if (optind + 1 != argc || !o->out)
        return command_bad_usage("boothcal light map: one LIST.csv and --out are needed; see "
                                 "--help");
    if (!o->config == !(o->size_m[0] > 0))
        return command_bad_usage("boothcal light map: either --config or --size is needed");
    if (o->measure ? !o->config || o->reading_count : !o->reading_count)
        return command_bad_usage("boothcal light map: either --measure (with --config) or --spot "
                                 "is needed: without a reading the map has no scale");
    o->recipe.list = argv[optind];
    return COMMAND_FINE;
}

// ---- the work --------------------------------------------------------------

static bool take_camera(struct options *o, struct error *err)
{
    struct still_camera *c = &o->recipe.camera;
    bool cos4 = c->cos4;
    if (o->camera && (o->lens_given || o->focal_px > 0 || o->axis_given))
        return fail(err, ERROR_CONFIG, "--camera says what --lens, --focal and --axis say");
    if ((o->lens_given || o->axis_given) && !(o->focal_px > 0))
        return fail(err, ERROR_CONFIG, "--lens and --axis need --focal");
    if (o->camera && !still_camera_load(o->camera, c, err))
        return false;
    if (o->focal_px > 0)
        c->lens = (struct hdr_lens){o->focal_px, o->focal_px, NAN,        NAN,       o->lens[0],
                                    o->lens[1],  o->lens[2],  o->lens[3], o->lens[4]};
    if (o->axis_given) {
        c->lens.cx_px = o->axis_px[0];
        c->lens.cy_px = o->axis_px[1];
    }
    c->cos4 |= cos4;
    c->top = o->top >= 0 ? o->top : c->top;
    c->inset_m = o->inset_m >= 0 ? o->inset_m : c->inset_m;
    if (o->falloff[0] != 0 || o->falloff[1] != 0 || o->falloff[2] != 0) {
        c->v2 = o->falloff[0];
        c->v4 = o->falloff[1];
        c->v6 = o->falloff[2];
    }
    return true;
}

static bool take_settings(struct options *o, struct booth_settings *s, struct error *err)
{
    struct ceiling_recipe *r = &o->recipe;
    if (o->config && !booth_load(o->config, NULL, 0, s, err))
        return false;
    r->ceiling = o->config ? s->ceiling : (struct ceiling){{0}, o->size_m[0], o->size_m[1]};
    r->width_px = (int)o->pixels[0];
    r->height_px = (int)o->pixels[1];
    memcpy(r->corner_px, o->corners, sizeof r->corner_px);
    return take_camera(o, err);
}

static bool scale(const struct options *o, const struct booth_settings *s,
                  const struct luminance_map *map, struct spot_scale *out, struct error *err)
{
    struct bench bench = {0};
    if (!o->measure)
        return spots_apply(map, o->readings, o->reading_count, out, err);
    bool fine = bench_open(&bench, s, o->socket, o->booth, err) &&
                spots_scale(&bench, *o->lamp ? o->lamp : "its lamp", map, out, err);
    bench_close(&bench);
    return fine;
}

static bool make(struct options *o, struct booth_settings *s, struct ceiling_photo *photo,
                 struct ceiling_origin *origin, struct error *err)
{
    struct luminance_map map = {0};
    snprintf(origin->lamp, sizeof origin->lamp, "%s", o->lamp);
    bool fine = take_settings(o, s, err) && ceiling_photo_take(&o->recipe, photo, err) &&
                ceiling_photo_map(photo, &o->recipe.ceiling, &map, err) &&
                scale(o, s, &map, &origin->spots, err) &&
                ceiling_photo_save(o->out, photo, &o->recipe.ceiling, origin, err);
    if (fine && o->png)
        fine = light_picture(o->png, &map, NULL, NULL, err);
    if (fine && o->save_response)
        fine = response_save(o->save_response, &photo->responses[0], err);
    luminance_map_fini(&map);
    return fine;
}

// ---- what is said ----------------------------------------------------------

static void print_text(const struct options *o, const struct ceiling_photo *p,
                       const struct ceiling_origin *origin)
{
    const double(*c)[2] = p->corner_px;
    printf("%s: %d x %d pixels, %.4g x %.4g m\n", o->out, p->picture.width, p->picture.height,
           o->recipe.ceiling.width_m, o->recipe.ceiling.depth_m);
    printf("%d exposures, noise %.2f of the model, %d hot pixels replaced\n", p->pictures, p->noise,
           p->hot);
    if (isfinite(p->method_difference))
        printf("responses after Robertson and after Debevec differ by %.1f %% rms\n",
               100 * p->method_difference);
    printf("corners %s: far left %.1f %.1f, far right %.1f %.1f, near right %.1f %.1f, near left "
           "%.1f %.1f; %.1f of the camera's pixels to one of the map\n",
           o->recipe.corners_given ? "given" : "found", c[0][0], c[0][1], c[1][0], c[1][1], c[2][0],
           c[2][1], c[3][0], c[3][1], p->picture.px_across);
    printf("scaled by %d spot reading%s\n", origin->spots.count,
           origin->spots.count == 1 ? "" : "s");
}

static void print_json(const struct options *o, const struct ceiling_photo *p,
                       const struct ceiling_origin *origin)
{
    json_t *corners = json_array(), *ratios = json_array();
    for (int i = 0; i < 4; i++)
        json_array_append_new(corners, json_pack("[f,f]", p->corner_px[i][0], p->corner_px[i][1]));
    for (int i = 0; i < origin->spots.count; i++)
        json_array_append_new(ratios, json_real(origin->spots.ratios[i]));
    json_t *all =
        json_pack("{s:s, s:i, s:i, s:f, s:f, s:i, s:i, s:f, s:f, s:f, s:f, s:f, s:o, s:o}", "map",
                  o->out, "width_px", p->picture.width, "height_px", p->picture.height, "width_m",
                  o->recipe.ceiling.width_m, "depth_m", o->recipe.ceiling.depth_m, "exposures",
                  p->pictures, "hot_pixels", p->hot, "noise", p->noise, "clipped", p->clipped,
                  "greatest_off", p->off, "camera_pixels_to_one", p->picture.px_across, "scale",
                  origin->spots.scale, "corners_px", corners, "spot_ratios", ratios);
    json_object_set_new(all, "method_difference",
                        isfinite(p->method_difference) ? json_real(p->method_difference)
                                                       : json_null());
    json_dumpf(all, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(all);
}

static bool warn_if(bool wrong, const char *text, double value)
{
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
    if (wrong)
        fprintf(stderr, text, value);
#pragma GCC diagnostic pop
    return wrong;
}

static int warnings(const struct ceiling_photo *p)
{
    bool any = warn_if(p->clipped > CLIPPED_WARN,
                       "boothcal: warning: %.2f %% of the ceiling is clipped in every picture: its "
                       "luminance there is a lower bound\n",
                       100 * p->clipped);
    any |= warn_if(p->picture.px_across < 1,
                   "boothcal: warning: only %.2f of the camera's pixels to one of the map\n",
                   p->picture.px_across);
    any |= warn_if(p->method_difference > METHODS_WARN,
                   "boothcal: warning: the two ways to find the camera's response differ by %.0f %%"
                   ": take more exposures\n",
                   100 * p->method_difference);
    any |= warn_if(p->noise > NOISE_WARN,
                   "boothcal: warning: the exposures scatter %.1f times as much as noise does: did "
                   "the camera or the light move?\n",
                   p->noise);
    if (fabs(p->off) > OFF_WARN) {
        fprintf(stderr,
                "boothcal: warning: %s tells %+.1f %% of the light that all pictures tell: is its "
                "exposure exact?\n",
                p->off_path, 100 * p->off);
        any = true;
    }
    return any ? COMMAND_WARNED : COMMAND_FINE;
}

int light_map_command(int argc, char **argv)
{
    struct options o;
    struct error err = {0};
    struct ceiling_photo photo = {0};
    struct ceiling_origin origin = {0};
    int code = parse(argc, argv, &o);
    if (code)
        return code;
    struct booth_settings *settings = calloc(1, sizeof *settings);
    bool fine = settings ? make(&o, settings, &photo, &origin, &err)
                         : fail(&err, ERROR_SYSTEM, "out of memory");
    if (!fine) {
        code = command_failed(&err);
    } else {
        (o.json ? print_json : print_text)(&o, &photo, &origin);
        fflush(stdout);
        code = warnings(&photo);
    }
    ceiling_photo_fini(&photo);
    free(settings);
    return code;
}
