// SPDX-License-Identifier: Apache-2.0
#include "calibration/photos.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "calibration/lines.h"
#include "config/paths.h"

static const char *const KINDS[] = {
    [PHOTO_LIGHT] = "light", [PHOTO_DARK] = "dark", [PHOTO_FLAT] = "flat"};
static const double SECONDS_LEAST = 1e-6, SECONDS_MOST = 3600;
static const double BYTES_MOST = 4.0 * (1 << 30);
static const double DARKER = 0.002;              // of full counts: more is not noise of the mean
static const double CLIPPED = 0.98, DARK = 0.04; // of full counts
static const double CLIPPED_SHARE = 0.5;

void photos_fini(struct photos *p)
{
    for (int i = 0; i < p->count; i++)
        picture_fini(&p->photos[i].picture);
    free(p->photos);
    *p = (struct photos){0};
}

// ---- the list --------------------------------------------------------------

static char *trimmed(char *text)
{
    text += strspn(text, " \t\"");
    for (size_t n = strlen(text); n > 0 && strchr(" \t\r\"", text[n - 1]); n--)
        text[n - 1] = 0;
    return text;
}

static bool take_kind(const char *text, enum photo_kind *out)
{
    for (int k = PHOTO_LIGHT; k <= PHOTO_FLAT; k++)
        if (!strcmp(text, KINDS[k])) {
            *out = (enum photo_kind)k;
            return true;
        }
    return false;
}

static bool take_line(const char *list, char *line, struct photo *out, struct error *err)
{
    char *save = NULL, *name = strtok_r(line, ",;", &save), *time = strtok_r(NULL, ",;", &save);
    char *kind = strtok_r(NULL, ",;", &save), *more = strtok_r(NULL, ",;", &save);
    const char *end;
    *out = (struct photo){0};
    if (!name || !time || more)
        return fail(err, ERROR_DATA, "is not \"FILE, SECONDS\" or \"FILE, SECONDS, KIND\"");
    time = trimmed(time);
    if (!number_parse(time, &end, &out->seconds) || *end)
        return fail(err, ERROR_DATA, "seconds: \"%.40s\" is not a number", time);
    if (!(out->seconds >= SECONDS_LEAST && out->seconds <= SECONDS_MOST))
        return fail(err, ERROR_DATA, "seconds: %g is outside %g..%g", out->seconds, SECONDS_LEAST,
                    SECONDS_MOST);
    if (kind && !take_kind(trimmed(kind), &out->kind))
        return fail(err, ERROR_DATA, "kind: \"%.40s\" is not one of: light, dark, flat",
                    trimmed(kind));
    return path_beside(list, trimmed(name), out->path, sizeof out->path, err);
}

static bool add(struct photos *p, const struct photo *photo, struct error *err)
{
    if (p->count == PHOTOS_MOST)
        return fail(err, ERROR_DATA, "more than %d pictures", PHOTOS_MOST);
    p->photos[p->count++] = *photo;
    return true;
}

static bool read_list(const char *list, FILE *in, struct photos *p, struct error *err)
{
    struct lines lines = {.in = in, .name = list};
    bool end = false, fine = true;
    while (fine && lines_next(&lines, &end, err)) {
        struct photo photo;
        fine = (take_line(list, lines.text, &photo, err) && add(p, &photo, err)) ||
               while_doing(err, "%s:%d", list, lines.number);
    }
    lines_fini(&lines);
    return fine && end;
}

static int in_order(const void *a, const void *b)
{
    const struct photo *x = a, *y = b;
    if (x->kind != y->kind)
        return x->kind < y->kind ? -1 : 1;
    if (x->seconds != y->seconds)
        return x->seconds < y->seconds ? -1 : 1;
    return strcmp(x->path, y->path);
}

// ---- the pictures ----------------------------------------------------------

static bool alike(const struct photos *p, const struct photo *photo, struct error *err)
{
    const struct picture *one = &photo->picture;
    if (one->width == p->width && one->height == p->height && one->channels == p->channels &&
        one->bits == p->bits)
        return true;
    return fail(err, ERROR_DATA,
                "%s: %d x %d pixels, %d channels of %d bits; the others have %d x %d, %d of %d",
                photo->path, one->width, one->height, one->channels, one->bits, p->width, p->height,
                p->channels, p->bits);
}

static bool load_pictures(struct photos *p, struct error *err)
{
    for (int i = 0; i < p->count; i++) {
        struct photo *photo = &p->photos[i];
        if (!png_load(photo->path, &photo->picture, err))
            return false;
        const struct picture *one = &photo->picture;
        if (i == 0) {
            p->width = one->width;
            p->height = one->height;
            p->channels = one->channels;
            p->bits = one->bits;
        }
        if (!alike(p, photo, err))
            return false;
        if (2.0 * one->width * one->height * one->channels * p->count > BYTES_MOST)
            return fail(err, ERROR_DATA, "%d pictures of %d x %d pixels are over 4 GiB", p->count,
                        one->width, one->height);
    }
    return true;
}

// Of full counts.
static double mean_of(const struct picture *picture)
{
    size_t count = (size_t)picture->width * picture->height * picture->channels;
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += picture->samples[i];
    return sum / (double)count / (picture->bits == 8 ? 255 : 65535);
}

// Share of samples above a share of full counts.
static double share_above(const struct picture *picture, double level)
{
    size_t count = (size_t)picture->width * picture->height * picture->channels, above = 0;
    double least = level * (picture->bits == 8 ? 255 : 65535);
    for (size_t i = 0; i < count; i++)
        above += picture->samples[i] > least;
    return (double)above / (double)count;
}

static bool check_order(const struct photos *p, struct error *err)
{
    double before = 0;
    for (int i = 0; i < p->count; i++) {
        const struct photo *now = &p->photos[i], *last = i > 0 ? now - 1 : NULL;
        double mean = mean_of(&now->picture);
        if (last && last->kind == now->kind && now->kind != PHOTO_DARK && mean < before - DARKER)
            return fail(err, ERROR_DATA,
                        "%s (%g s) is darker than %s (%g s): are their exposures exchanged, or "
                        "did the light change?",
                        now->path, now->seconds, last->path, last->seconds);
        before = mean;
    }
    return true;
}

static bool check_light(const struct photos *p, struct error *err)
{
    if (!p->light_count)
        return fail(err, ERROR_DATA, "no picture of the kind light");
    const struct photo *shortest = &p->photos[0], *longest = &p->photos[p->light_count - 1];
    double clipped = share_above(&shortest->picture, CLIPPED);
    if (clipped > CLIPPED_SHARE)
        return fail(err, ERROR_DATA,
                    "%s: even the shortest exposure (%g s) is clipped over %.0f %% of the picture: "
                    "expose shorter",
                    shortest->path, shortest->seconds, 100 * clipped);
    if (!(share_above(&longest->picture, DARK) > 0))
        return fail(err, ERROR_DATA,
                    "%s: even the longest exposure (%g s) is dark all over: expose longer",
                    longest->path, longest->seconds);
    return true;
}

bool photos_load(const char *list, struct photos *out, struct error *err)
{
    struct photos p = {.photos = calloc(PHOTOS_MOST, sizeof *p.photos)};
    FILE *in = fopen(list, "r");
    bool fine = p.photos || fail(err, ERROR_SYSTEM, "out of memory");
    if (!in)
        fine = fail(err, ERROR_CONFIG, "%s: cannot be read", list);
    fine = fine && read_list(list, in, &p, err);
    if (in)
        fclose(in);
    if (fine) {
        qsort(p.photos, (size_t)p.count, sizeof *p.photos, in_order);
        for (int i = 0; i < p.count; i++)
            p.light_count += p.photos[i].kind == PHOTO_LIGHT;
        fine = (load_pictures(&p, err) && check_light(&p, err) && check_order(&p, err)) ||
               while_doing(err, "%s", list);
    }
    if (fine)
        *out = p;
    else
        photos_fini(&p);
    return fine;
}
