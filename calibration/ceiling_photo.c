// SPDX-License-Identifier: Apache-2.0
#include "calibration/ceiling_photo.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

static const double OFF_MOST = 0.30;
static const double CLIPPED_HALF = 0.5;  // of a pixel of the map
static const double CAMERA_PIXELS = 1.5; // to one of the map, when nobody says how many
enum { WIDTH_PRESET = 512, SIDE_MOST = 8192 };

void ceiling_photo_fini(struct ceiling_photo *p)
{
    ceiling_picture_fini(&p->picture);
    for (int c = 0; c < 3; c++)
        response_fini(&p->responses[c]);
}

// ---- response --------------------------------------------------------------

static enum response_source source_of(const struct ceiling_recipe *r, const struct photos *photos)
{
    if (r->response != CURVE_AUTO)
        return r->response;
    return photos->bits == 8 ? CURVE_ROBERTSON : CURVE_LINEAR;
}

static bool find_response(const struct ceiling_recipe *r, const struct photos *photos, int channel,
                          struct response *out, struct error *err)
{
    switch (source_of(r, photos)) {
    case CURVE_AUTO:
    case CURVE_ROBERTSON:
        return response_find(HDR_ROBERTSON, photos, channel, out, err);
    case CURVE_DEBEVEC:
        return response_find(HDR_DEBEVEC, photos, channel, out, err);
    case CURVE_LINEAR:
        return response_linear(photos->bits, out, err);
    case CURVE_FILE:
        return response_load(r->response_file, photos->bits, out, err);
    }
    return fail(err, ERROR_RANGE, "there is no such response");
}

// One method against the other; where the other finds nothing, nothing is said.
static double compare_methods(const struct ceiling_recipe *r, const struct photos *photos,
                              const struct response *found)
{
    struct response other = {0};
    enum response_source source = source_of(r, photos);
    bool robertson = source == CURVE_ROBERTSON;
    double difference = NAN;
    if ((robertson || source == CURVE_DEBEVEC) &&
        response_find(robertson ? HDR_DEBEVEC : HDR_ROBERTSON, photos, photos->channels / 2, &other,
                      NULL))
        difference = response_difference(found, &other);
    response_fini(&other);
    return difference;
}

static bool find_responses(const struct ceiling_recipe *r, const struct photos *photos,
                           struct ceiling_photo *p, struct error *err)
{
    for (int c = 0; c < photos->channels; c++)
        if (!find_response(r, photos, c, &p->responses[c], err))
            return false;
    p->method_difference = compare_methods(r, photos, &p->responses[photos->channels / 2]);
    return true;
}

// ---- light -----------------------------------------------------------------

static bool check_agreement(const struct photos *photos, const struct hdr *hdr,
                            struct ceiling_photo *p, struct error *err)
{
    for (int i = 0; i < photos->light_count; i++) {
        if (fabs(hdr->off[i]) < fabs(p->off))
            continue;
        p->off = hdr->off[i];
        memcpy(p->off_path, photos->photos[i].path, sizeof p->off_path);
    }
    return fabs(p->off) <= OFF_MOST ||
           fail(err, ERROR_DATA,
                "%s: tells %+.0f %% of the light that the others tell: is its exposure wrong, or "
                "did the light change?",
                p->off_path, 100 * p->off);
}

static double side_of(const double corner[4][2], int i)
{
    const double *a = corner[i], *b = corner[(i + 1) % 4];
    return hypot(b[0] - a[0], b[1] - a[1]);
}

// So coarse that the camera sees more than what the map holds.
static int width_for(const struct ceiling_photo *p, const struct ceiling *c)
{
    const double(*corner)[2] = p->corner_px;
    double across = fmin(side_of(corner, 0), side_of(corner, 2)) / CAMERA_PIXELS;
    double down = fmin(side_of(corner, 1), side_of(corner, 3)) / CAMERA_PIXELS;
    return (int)fmin(WIDTH_PRESET, fmax(1, fmin(across, down * c->width_m / c->depth_m)));
}

static bool look(const struct ceiling_recipe *r, const struct hdr *hdr, struct ceiling_photo *p,
                 struct error *err)
{
    struct ceiling_view view;
    memcpy(p->corner_px, r->corner_px, sizeof p->corner_px);
    if (!r->corners_given && !ceiling_corners_find(&r->camera, hdr, p->corner_px, err))
        return false;
    int width = r->width_px ? r->width_px : width_for(p, &r->ceiling);
    double square = width * r->ceiling.depth_m / r->ceiling.width_m;
    int height = r->height_px ? r->height_px : (int)fmax(1, lround(square));
    if (width < 1 || height < 1 || width > SIDE_MOST || height > SIDE_MOST)
        return fail(err, ERROR_RANGE, "a map of %d x %d pixels; allowed: 1..%d each", width, height,
                    SIDE_MOST);
    return ceiling_view_make(&r->camera, hdr->width, hdr->height, (const double(*)[2])p->corner_px,
                             &r->ceiling, &view, err) &&
           ceiling_view_take(&view, hdr, width, height, &p->picture, err);
}

static bool check_clipped(struct ceiling_photo *p, struct error *err)
{
    size_t count = (size_t)p->picture.width * (size_t)p->picture.height;
    for (size_t i = 0; i < count; i++)
        p->clipped += p->picture.clipped[i] / (double)count;
    return p->clipped < CLIPPED_HALF ||
           fail(err, ERROR_DATA,
                "%.0f %% of the ceiling is clipped in every picture: expose shorter",
                100 * p->clipped);
}

// Before the pictures are worked on for long.
static bool check_recipe(const struct ceiling_recipe *r, const struct photos *photos,
                         struct error *err)
{
    struct still_camera camera = r->camera;
    struct ceiling_view view;
    return still_camera_fit(&camera, photos->width, photos->height, err) &&
           (!r->corners_given || ceiling_view_make(&r->camera, photos->width, photos->height,
                                                   r->corner_px, &r->ceiling, &view, err));
}

bool ceiling_photo_take(const struct ceiling_recipe *recipe, struct ceiling_photo *out,
                        struct error *err)
{
    struct ceiling_photo p = {0};
    struct photos photos = {0};
    struct hdr hdr = {0};
    bool fine = photos_load(recipe->list, &photos, err) && check_recipe(recipe, &photos, err) &&
                find_responses(recipe, &photos, &p, err) &&
                hdr_merge(&photos, p.responses, &hdr, err) &&
                check_agreement(&photos, &hdr, &p, err) && look(recipe, &hdr, &p, err) &&
                check_clipped(&p, err);
    p.pictures = photos.light_count;
    p.hot = hdr.hot;
    p.noise = hdr.noise;
    photos_fini(&photos);
    hdr_fini(&hdr);
    if (fine)
        *out = p;
    else
        ceiling_photo_fini(&p);
    return fine;
}

// ---- map -------------------------------------------------------------------

bool ceiling_photo_map(const struct ceiling_photo *photo, const struct ceiling *ceiling,
                       struct luminance_map *out, struct error *err)
{
    const struct ceiling_picture *p = &photo->picture;
    size_t count = (size_t)p->width * (size_t)p->height;
    double *luminance = malloc(count * sizeof *luminance);
    if (!luminance)
        return fail(err, ERROR_SYSTEM, "no memory for %d x %d pixels", p->width, p->height);
    for (size_t i = 0; i < count; i++)
        luminance[i] = p->clipped[i] > 0 ? 0 : fmax(0, p->light[i]);
    *out = (struct luminance_map){*ceiling, p->width, p->height, luminance};
    return true;
}

static bool fill(struct exr *image, const struct ceiling_photo *photo,
                 const struct ceiling *ceiling, const struct ceiling_origin *origin,
                 struct error *err)
{
    static const char *const NAMES[3] = {"Y", "sigma", "clipped"};
    const struct ceiling_picture *p = &photo->picture;
    size_t count = (size_t)p->width * (size_t)p->height;
    double scale = origin->spots.scale;
    char now[21];
    if (!exr_init(image, p->width, p->height, 3, err))
        return false;
    for (int c = 0; c < 3; c++)
        snprintf(image->names[c], sizeof image->names[c], "%s", NAMES[c]);
    for (size_t i = 0; i < count; i++) {
        image->pixels[i] = (float)(scale * p->light[i]);
        image->pixels[count + i] = (float)(scale * p->sigma[i]);
        image->pixels[2 * count + i] = (float)p->clipped[i];
    }
    clock_utc(now);
    exr_set_number(image, "boothd.width_m", ceiling->width_m);
    exr_set_number(image, "boothd.depth_m", ceiling->depth_m);
    exr_set_number(image, "boothd.scale", scale);
    exr_set_number(image, "boothd.spots", origin->spots.count);
    exr_set_number(image, "boothd.clipped", photo->clipped);
    if (*origin->lamp)
        exr_set_text(image, "boothd.lamp", origin->lamp);
    exr_set_text(image, "boothd.software", "boothcal " BOOTHD_VERSION);
    exr_set_text(image, "boothd.created", now);
    return true;
}

bool ceiling_photo_save(const char *path, const struct ceiling_photo *photo,
                        const struct ceiling *ceiling, const struct ceiling_origin *origin,
                        struct error *err)
{
    struct exr image = {0};
    bool fine = fill(&image, photo, ceiling, origin, err) && exr_save(path, &image, err);
    exr_fini(&image);
    return fine;
}
