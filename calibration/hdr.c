// SPDX-License-Identifier: Apache-2.0
#include "calibration/hdr.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMOOTH_HALF = 7, MEDIAN_SAMPLES = 20001 };
static const double WEIGHTS[3] = {0.2126, 0.7152, 0.0722}; // Rec. 709
static const double LIGHT_NOISE = 1e-4; // variance over exposure, of full exposure
static const double READ_NOISE = 1e-3;  // of full exposure
static const double FADE = 0.90;        // of the codes
static const double HOT_DARK =
    0.01;                        // of full exposure over the median, in the longest dark picture
static const double ALONE = 1.5; // over the brightest neighbour, or under the darkest
static const double FLAT_CLIPPED = 0.001; // share of pixels that is borne

struct merging {
    const struct photos *photos;
    const struct response *responses;
    size_t count;           // pixels
    double *dark;           // [count] full exposures a second, or NULL
    double *falloff;        // [count] or NULL
    uint8_t *hot;           // [count]
    double *num, *den, *sq; // [count] of a channel: sums of weights times powers of the light
    uint8_t *uses;          // [count] pictures that count
    struct hdr *out;
};

void hdr_fini(struct hdr *h)
{
    free(h->light);
    free(h->sigma);
    free(h->clipped);
    *h = (struct hdr){0};
}

static unsigned code_at(const struct photos *p, const struct photo *photo, size_t i, int channel)
{
    return photo->picture.samples[i * (size_t)p->channels + (size_t)channel];
}

static double exposure_at(const struct merging *m, const struct photo *photo, size_t i, int channel)
{
    return m->responses[channel].exposure[code_at(m->photos, photo, i, channel)];
}

// ---- smoothing -------------------------------------------------------------

// Running sums along lines of `count` values `step` apart.
static void sum_lines(double *v, double *room, int count, size_t step, int half)
{
    double sum = 0;
    for (int i = 0; i < count; i++)
        room[i] = v[(size_t)i * step];
    for (int i = 0; i < half && i < count; i++)
        sum += room[i];
    for (int i = 0; i < count; i++) {
        if (i + half < count)
            sum += room[i + half];
        if (i - half - 1 >= 0)
            sum -= room[i - half - 1];
        v[(size_t)i * step] = sum;
    }
}

static void sum_squares(double *v, double *room, int width, int height, int half)
{
    for (int y = 0; y < height; y++)
        sum_lines(v + (size_t)y * (size_t)width, room, width, 1, half);
    for (int x = 0; x < width; x++)
        sum_lines(v + x, room, height, (size_t)width, half);
}

bool hdr_smooth(double *v, const uint8_t *used, int width, int height, int half)
{
    size_t count = (size_t)width * (size_t)height;
    double *weight = malloc(count * sizeof *weight);
    double *room = malloc((size_t)(width > height ? width : height) * sizeof *room);
    bool good = weight && room;
    for (size_t i = 0; good && i < count; i++) {
        weight[i] = !used || used[i];
        v[i] *= weight[i];
    }
    if (good) {
        sum_squares(v, room, width, height, half);
        sum_squares(weight, room, width, height, half);
    }
    for (size_t i = 0; good && i < count; i++)
        v[i] = weight[i] > 0.5 ? v[i] / weight[i] : 0;
    free(weight);
    free(room);
    return good;
}

// ---- dark and flat pictures ------------------------------------------------

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *v, int n)
{
    qsort(v, (size_t)n, sizeof *v, ascending);
    return n > 0 ? v[n / 2] : 0;
}

// Of a dark picture, from a part of its pixels.
static double dark_level(const struct merging *m, const struct photo *dark, int channel)
{
    size_t step = m->count / MEDIAN_SAMPLES + 1;
    double *some = malloc((m->count / step + 1) * sizeof *some);
    int n = 0;
    for (size_t i = 0; some && i < m->count; i += step)
        some[n++] = exposure_at(m, dark, i, channel);
    double level = some ? median(some, n) : 0;
    free(some);
    return level;
}

static void mark_hot(struct merging *m, const struct photo *longest)
{
    for (int c = 0; c < m->photos->channels; c++) {
        double most = dark_level(m, longest, c) + HOT_DARK;
        for (size_t i = 0; i < m->count; i++)
            m->hot[i] |= exposure_at(m, longest, i, c) > most;
    }
}

static uint8_t *cold_pixels(const struct merging *m)
{
    uint8_t *cold = malloc(m->count);
    for (size_t i = 0; cold && i < m->count; i++)
        cold[i] = !m->hot[i];
    return cold;
}

// Of the longest one, channels alike.
static bool take_dark(struct merging *m, const struct photo *longest)
{
    m->dark = calloc(m->count, sizeof *m->dark);
    mark_hot(m, longest);
    uint8_t *cold = cold_pixels(m);
    bool good = m->dark && cold;
    for (size_t i = 0; good && i < m->count; i++)
        for (int c = 0; c < m->photos->channels; c++)
            m->dark[i] += exposure_at(m, longest, i, c) / longest->seconds / m->photos->channels;
    good = good && hdr_smooth(m->dark, cold, m->photos->width, m->photos->height, SMOOTH_HALF);
    free(cold);
    return good;
}

static bool add_flat(struct merging *m, const struct photo *flat, struct error *err)
{
    size_t clipped = 0;
    for (size_t i = 0; i < m->count; i++)
        for (int c = 0; c < m->photos->channels; c++) {
            double dark = m->dark ? m->dark[i] * flat->seconds : 0;
            clipped += code_at(m->photos, flat, i, c) > (unsigned)m->responses[c].most;
            m->falloff[i] += (exposure_at(m, flat, i, c) - dark) / flat->seconds;
        }
    if ((double)clipped > FLAT_CLIPPED * (double)m->count * m->photos->channels)
        return fail(err, ERROR_DATA, "%s: a flat picture must not be clipped", flat->path);
    return true;
}

static bool add_flats(struct merging *m, bool *any, struct error *err)
{
    const struct photos *p = m->photos;
    for (int i = 0; i < p->count; i++)
        if (p->photos[i].kind == PHOTO_FLAT) {
            *any = true;
            if (!add_flat(m, &p->photos[i], err))
                return false;
        }
    return true;
}

static bool take_flats(struct merging *m, struct error *err)
{
    bool any = false;
    double most = 0;
    m->falloff = calloc(m->count, sizeof *m->falloff);
    uint8_t *cold = cold_pixels(m);
    bool good = (m->falloff && cold) || fail(err, ERROR_SYSTEM, "no memory for the flat field");
    good = good && add_flats(m, &any, err);
    if (good && !hdr_smooth(m->falloff, cold, m->photos->width, m->photos->height, SMOOTH_HALF))
        good = fail(err, ERROR_SYSTEM, "no memory for the flat field");
    free(cold);
    for (size_t i = 0; good && i < m->count; i++)
        most = fmax(most, m->falloff[i]);
    for (size_t i = 0; good && any && i < m->count; i++)
        m->falloff[i] /= most;
    if (good && any && !(most > 0))
        return fail(err, ERROR_DATA, "the flat pictures are dark");
    if (!any) {
        free(m->falloff);
        m->falloff = NULL;
    }
    return good;
}

static const struct photo *longest_of(const struct photos *p, enum photo_kind kind)
{
    const struct photo *longest = NULL;
    for (int i = 0; i < p->count; i++)
        if (p->photos[i].kind == kind)
            longest = &p->photos[i];
    return longest;
}

// ---- merging ---------------------------------------------------------------

// Inverse variance of the exposure at a code, over full exposure.
static double weight_of(const struct response *r, int code, bool longest)
{
    double x = r->exposure[code], step = r->slope[code], last = r->codes - 1;
    if (code > r->most || (code < r->least && !longest))
        return 0;
    double fade = fmin(1, (r->most + 1 - code) / (r->most + 1 - FADE * last));
    return fade / (LIGHT_NOISE * x + READ_NOISE * READ_NOISE + step * step / 12);
}

static double *weights_of(const struct response *r, bool longest)
{
    double *w = malloc((size_t)r->codes * sizeof *w);
    for (int z = 0; w && z < r->codes; z++)
        w[z] = weight_of(r, z, longest);
    return w;
}

static bool add_picture(struct merging *m, int index, int channel)
{
    const struct photo *photo = &m->photos->photos[index];
    double t = photo->seconds,
           *weights = weights_of(&m->responses[channel], index == m->photos->light_count - 1);
    for (size_t i = 0; weights && i < m->count; i++) {
        unsigned z = code_at(m->photos, photo, i, channel);
        double w = weights[z] * t * t;
        double e = m->responses[channel].exposure[z] / t - (m->dark ? m->dark[i] : 0);
        m->num[i] += w * e;
        m->den[i] += w;
        m->sq[i] += w * e * e;
        m->uses[i] += w > 0;
    }
    free(weights);
    return weights;
}

// Where nothing counts the shortest picture says how bright it is at least.
static void close_channel(struct merging *m, int channel, double weight, double *chi2, double *dof)
{
    const struct photo *shortest = &m->photos->photos[0];
    const struct response *r = &m->responses[channel];
    for (size_t i = 0; i < m->count; i++) {
        double falloff = m->falloff ? fmax(m->falloff[i], 1e-3) : 1;
        bool clipped = !(m->den[i] > 0);
        double e = clipped ? r->exposure[r->most] / shortest->seconds : m->num[i] / m->den[i];
        double u = clipped ? e : 1 / sqrt(m->den[i]);
        m->out->light[i] += weight * e / falloff;
        m->out->sigma[i] += weight * weight * u * u / (falloff * falloff);
        m->out->clipped[i] |= clipped;
        if (m->uses[i] < 2 || m->hot[i])
            continue;
        *chi2 += fmax(0, m->sq[i] - e * m->num[i]);
        *dof += m->uses[i] - 1;
    }
}

// Median of what a picture says over what all say, where it says much.
static double off_of(const struct merging *m, int index, int channel)
{
    const struct photo *photo = &m->photos->photos[index];
    const struct response *r = &m->responses[channel];
    size_t step = m->count / MEDIAN_SAMPLES + 1;
    double *ratios = malloc((m->count / step + 1) * sizeof *ratios), off = 0;
    int n = 0;
    for (size_t i = 0; ratios && i < m->count; i += step) {
        int z = (int)code_at(m->photos, photo, i, channel);
        double e = r->exposure[z] / photo->seconds - (m->dark ? m->dark[i] : 0);
        if (z > r->codes / 5 && z < FADE * r->codes && m->den[i] > 0 && !m->hot[i])
            ratios[n++] = e / (m->num[i] / m->den[i]) - 1;
    }
    if (ratios)
        off = median(ratios, n);
    free(ratios);
    return off;
}

static bool merge_channels(struct merging *m, double *chi2, double *dof)
{
    const struct photos *p = m->photos;
    for (int c = 0; c < p->channels; c++) {
        memset(m->num, 0, m->count * sizeof *m->num);
        memset(m->den, 0, m->count * sizeof *m->den);
        memset(m->sq, 0, m->count * sizeof *m->sq);
        memset(m->uses, 0, m->count);
        for (int i = 0; i < p->light_count; i++)
            if (!add_picture(m, i, c))
                return false;
        close_channel(m, c, p->channels == 3 ? WEIGHTS[c] : 1, chi2, dof);
        for (int i = 0; i < p->light_count && c == p->channels / 2; i++)
            m->out->off[i] = off_of(m, i, c);
    }
    return true;
}

// ---- hot pixels ------------------------------------------------------------

static int neighbours(const struct merging *m, size_t at, bool cold_only, size_t out[8])
{
    int width = m->photos->width, height = m->photos->height, n = 0;
    int x = (int)(at % (size_t)width), y = (int)(at / (size_t)width);
    for (int k = 0; k < 9; k++) {
        int nx = x + k % 3 - 1, ny = y + k / 3 - 1;
        size_t there = (size_t)ny * (size_t)width + (size_t)nx;
        if (k != 4 && nx >= 0 && ny >= 0 && nx < width && ny < height &&
            !(cold_only && m->hot[there]))
            out[n++] = there;
    }
    return n;
}

static void mark_alone(struct merging *m)
{
    for (size_t i = 0; i < m->count; i++) {
        size_t near[8];
        double least = INFINITY, most = 0, light = m->out->light[i];
        int n = neighbours(m, i, false, near);
        for (int k = 0; k < n; k++) {
            least = fmin(least, m->out->light[near[k]]);
            most = fmax(most, m->out->light[near[k]]);
        }
        double noise = 6 * sqrt(m->out->sigma[i]);
        m->hot[i] |= light > ALONE * most + noise || light < least / ALONE - noise;
    }
}

static void mend(struct merging *m)
{
    struct hdr *out = m->out;
    for (size_t i = 0; i < m->count; i++) {
        size_t near[8];
        double sum = 0;
        if (!m->hot[i])
            continue;
        out->hot++;
        int n = neighbours(m, i, true, near);
        for (int k = 0; k < n; k++)
            sum += out->light[near[k]];
        if (n == 0)
            continue;
        out->light[i] = sum / n;
        out->sigma[i] = out->sigma[near[0]];
        out->clipped[i] = out->clipped[near[0]];
    }
}

static bool merge(struct merging *m, struct error *err)
{
    struct hdr *out = m->out;
    const struct photo *dark = longest_of(m->photos, PHOTO_DARK);
    double chi2 = 0, dof = 0;
    m->hot = calloc(m->count, 1);
    m->num = malloc(m->count * sizeof *m->num);
    m->den = malloc(m->count * sizeof *m->den);
    m->sq = malloc(m->count * sizeof *m->sq);
    m->uses = malloc(m->count);
    out->light = calloc(m->count, sizeof *out->light);
    out->sigma = calloc(m->count, sizeof *out->sigma);
    out->clipped = calloc(m->count, 1);
    bool room =
        m->hot && m->num && m->den && m->sq && m->uses && out->light && out->sigma && out->clipped;
    if (!room || (dark && !take_dark(m, dark)))
        return fail(err, ERROR_SYSTEM, "no memory for %zu pixels", m->count);
    if (!take_flats(m, err))
        return false;
    if (!merge_channels(m, &chi2, &dof))
        return fail(err, ERROR_SYSTEM, "out of memory");
    out->noise = dof > 0 ? sqrt(chi2 / dof) : 1;
    if (!dark)
        mark_alone(m);
    mend(m);
    for (size_t i = 0; i < m->count; i++)
        out->sigma[i] = sqrt(out->sigma[i]) * out->noise;
    return true;
}

bool hdr_merge(const struct photos *photos, const struct response *responses, struct hdr *out,
               struct error *err)
{
    struct hdr made = {.width = photos->width, .height = photos->height};
    struct merging m = {.photos = photos,
                        .responses = responses,
                        .count = (size_t)photos->width * (size_t)photos->height,
                        .out = &made};
    bool fine = merge(&m, err);
    free(m.dark);
    free(m.falloff);
    free(m.hot);
    free(m.num);
    free(m.den);
    free(m.sq);
    free(m.uses);
    if (fine)
        *out = made;
    else
        hdr_fini(&made);
    return fine;
}
