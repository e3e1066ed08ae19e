// SPDX-License-Identifier: Apache-2.0
#include "calibration/response.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/linear.h"
#include "base/number.h"
#include "files/table.h"
#include "files/write.h"

enum { RIPPLE_ROUNDS = 3, HARMONICS = 4 };
static const double SAME_EXPOSURE = 1.01, EQUAL_STEPS = 1.05; // ratios of exposures
enum { DEBEVEC_SIDE = 10, ROBERTSON_SIDE = 120, PIXELS_MOST = ROBERTSON_SIDE * ROBERTSON_SIDE };
static const double LEAST = 0.02, MOST = 0.98; // of the codes
static const double DEBEVEC_MOST = 0.92;       // its weights fade towards both ends
static const double EVEN = 6;                  // codes between neighbours, in any picture
static const double WINDOW = 0.12;             // of a code, half of what a parabola is laid through
static const int WINDOW_LEAST = 4, TOLD_LEAST = 6; // codes

void response_fini(struct response *r)
{
    free(r->exposure);
    free(r->slope);
    *r = (struct response){0};
}

static bool make(int codes, struct response *out, struct error *err)
{
    *out = (struct response){.codes = codes,
                             .exposure = malloc((size_t)codes * sizeof *out->exposure),
                             .slope = malloc((size_t)codes * sizeof *out->slope),
                             .least = (int)ceil(LEAST * (codes - 1)),
                             .most = (int)floor(MOST * (codes - 1))};
    if (out->exposure && out->slope)
        return true;
    response_fini(out);
    return fail(err, ERROR_SYSTEM, "no memory for a response of %d codes", codes);
}

// Scales to 1 at the last code; slopes from neighbours.
static bool finish(struct response *r, struct error *err)
{
    double full = r->exposure[r->codes - 1], least = 1e-6 / r->codes;
    for (int z = 0; z < r->codes; z++) {
        r->exposure[z] /= full;
        if (!isfinite(r->exposure[z]) || r->exposure[z] < 0 ||
            (z > 0 && r->exposure[z] < r->exposure[z - 1]))
            return fail(err, ERROR_DATA, "the camera's response does not rise at code %d", z);
    }
    for (int z = 0; z < r->codes; z++) {
        int a = z > 0 ? z - 1 : 0, b = z < r->codes - 1 ? z + 1 : z;
        r->slope[z] = fmax((r->exposure[b] - r->exposure[a]) / (b - a), least);
    }
    return true;
}

bool response_linear(int bits, struct response *out, struct error *err)
{
    if (!make(bits == 8 ? 256 : 65536, out, err))
        return false;
    for (int z = 0; z < out->codes; z++)
        out->exposure[z] = z;
    return finish(out, err);
}

// ---- from pictures ---------------------------------------------------------

static unsigned sample(const struct photo *photo, int channel, int x, int y)
{
    const struct picture *p = &photo->picture;
    return p->samples[((size_t)y * p->width + x) * p->channels + channel];
}

// Whether no picture changes much about a place: a hot pixel, an edge would.
static bool even(const struct photos *p, int channel, int x, int y)
{
    for (int i = 0; i < p->light_count; i++) {
        double here = sample(&p->photos[i], channel, x, y);
        for (int k = 0; k < 9; k++) {
            double there = sample(&p->photos[i], channel, x + k % 3 - 1, y + k / 3 - 1);
            if (fabs(there - here) > EVEN)
                return false;
        }
    }
    return true;
}

// Of its codes over all exposures: dark and bright pixels apart.
static int brightness(const struct photos *p, int channel, int x, int y)
{
    unsigned sum = 0;
    for (int i = 0; i < p->light_count; i++)
        sum += sample(&p->photos[i], channel, x, y);
    return (int)(sum / (unsigned)p->light_count);
}

static size_t common_divisor(size_t a, size_t b)
{
    while (b) {
        size_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

// Places in an order that looks like chance and repeats: a step that shares
// no divisor with their number visits each once.
static size_t step_through(size_t count)
{
    size_t step = (size_t)(0.618 * (double)count) | 1;
    while (common_divisor(step, count) != 1)
        step += 2;
    return step;
}

struct picking {
    const struct photos *photos;
    int channel, wanted, got;
    int taken[HDR_CODES];
    size_t *places; // [wanted]
};

static void pick_round(struct picking *p, int most_of_each, size_t step)
{
    size_t width = (size_t)p->photos->width, count = width * (size_t)p->photos->height, at = 0;
    for (size_t i = 0; i < count && p->got < p->wanted; i++, at = (at + step) % count) {
        int x = (int)(at % width), y = (int)(at / width);
        if (x < 1 || y < 1 || x >= p->photos->width - 1 || y >= p->photos->height - 1)
            continue;
        int bright = brightness(p->photos, p->channel, x, y);
        if (p->taken[bright] >= most_of_each || !even(p->photos, p->channel, x, y))
            continue;
        p->taken[bright]++;
        p->places[p->got++] = at;
    }
}

// As many of each brightness as there are of the rarest, then more of those
// that there are.
static int pick(const struct photos *photos, int channel, int wanted, size_t *places)
{
    struct picking p = {.photos = photos, .channel = channel, .wanted = wanted, .places = places};
    size_t step = step_through((size_t)photos->width * (size_t)photos->height);
    for (int each = wanted / 64 + 1, before = -1; p.got < wanted && p.got > before; each *= 4) {
        before = p.got;
        p.got = 0;
        memset(p.taken, 0, sizeof p.taken);
        pick_round(&p, each, step);
    }
    return p.got;
}

static bool gather(const struct photos *photos, int channel, int side, uint8_t *codes, int *pixels,
                   struct error *err)
{
    size_t *places = malloc((size_t)side * (size_t)side * sizeof *places);
    if (!places)
        return fail(err, ERROR_SYSTEM, "out of memory");
    int got = pick(photos, channel, side * side, places);
    side = (int)sqrt(got + 0.5);
    *pixels = side * side;
    for (int i = 0; i < photos->light_count; i++)
        for (int k = 0; k < *pixels; k++)
            codes[(size_t)i * (size_t)*pixels + (size_t)k] =
                (uint8_t)photos->photos[i]
                    .picture.samples[places[k] * (size_t)photos->channels + (size_t)channel];
    free(places);
    return *pixels >= 16 || fail(err, ERROR_DATA,
                                 "fewer than 16 pixels are even with their neighbours: is the "
                                 "series out of focus, or did the camera move?");
}

// Value at u of a parabola through (x, y) by least squares, weights w.
static double parabola_at(const double *x, const double *y, const double *w, int n, double u)
{
    double s[5] = {0}, t[3] = {0};
    for (int i = 0; i < n; i++) {
        double d = x[i] - u, p = w[i];
        for (int k = 0; k < 5; k++, p *= d) {
            s[k] += p;
            if (k < 3)
                t[k] += p * y[i];
        }
    }
    struct mat3 normal = {{{s[0], s[1], s[2]}, {s[1], s[2], s[3]}, {s[2], s[3], s[4]}}}, inverse;
    if (!mat3_invert(normal, &inverse))
        return s[0] > 0 ? t[0] / s[0] : NAN;
    return mat3_apply(inverse, (struct vec3){t[0], t[1], t[2]}).x;
}

// A response as it was found, and what weight the logarithm of each code's
// exposure has: how often it was seen, over its relative step squared.
struct raw {
    double exposure[HDR_CODES], weight[HDR_CODES];
};

// Told codes about z, the more the fewer there are; *n of them.
static void window_about(const struct raw *raw, int z, int least, int most, double *x, double *y,
                         double *w, int *n)
{
    *n = 0;
    for (int half = (int)fmax(WINDOW_LEAST, WINDOW * z); *n < TOLD_LEAST && half < HDR_CODES;
         half *= 2) {
        *n = 0;
        for (int k = z - half; k <= z + half; k++) {
            double share = (k - z) / (half + 1.0);
            if (k < least || k > most || !(raw->exposure[k] > 0) || !(raw->weight[k] > 0))
                continue;
            x[*n] = log(k);
            y[*n] = log(raw->exposure[k]);
            w[(*n)++] = (1 - share * share) * (1 - share * share) * raw->weight[k];
        }
    }
}

// Below `least` there is too little light for either method: it goes down to
// nothing as it does above.
static void smooth(const struct raw *raw, int least, int most, double out[HDR_CODES])
{
    double x[HDR_CODES], y[HDR_CODES], w[HDR_CODES];
    for (int z = least; z <= most; z++) {
        int n;
        window_about(raw, z, least, most, x, y, w, &n);
        out[z] = exp(parabola_at(x, y, w, n, log(z)));
    }
    for (int z = 0; z < least; z++)
        out[z] = out[least] * z / least;
    for (int z = most + 1; z < HDR_CODES; z++)
        out[z] = out[most] + (out[most] - out[most - 1]) * (z - most);
}

// ---- what exposures in equal steps cannot tell -----------------------------
//
// When every exposure is r times the one before, a response times any function
// that repeats with ln r of its logarithm explains the pictures as well.

// The common ratio of the exposures, 0 when there is none.
static double common_ratio(const struct photos *p)
{
    double least = INFINITY, most = 0;
    for (int i = 1; i < p->light_count; i++) {
        double ratio = p->photos[i].seconds / p->photos[i - 1].seconds;
        if (!(ratio > SAME_EXPOSURE))
            continue;
        least = fmin(least, ratio);
        most = fmax(most, ratio);
    }
    return most > 0 && most < EQUAL_STEPS * least ? sqrt(least * most) : 0;
}

// v less a parabola in the logarithm of the code through it, over one and a half
// periods about each: ripples stay, trends go.
static void ripple_of(const double *log_g, const double *v, int first, int last, double period,
                      double *out)
{
    double x[HDR_CODES], y[HDR_CODES], w[HDR_CODES];
    for (int z = first; z <= last; z++) {
        int n = 0;
        for (int k = first; k <= last; k++) {
            double share = (log_g[k] - log_g[z]) / (0.75 * period);
            if (fabs(share) >= 1)
                continue;
            x[n] = log(k);
            y[n] = v[k];
            w[n++] = (1 - share * share) * (1 - share * share);
        }
        out[z] = v[z] - parabola_at(x, y, w, n, log(z));
    }
}

static double product(const double *a, const double *b, const double *w, int first, int last)
{
    double sum = 0;
    for (int z = first; z <= last; z++)
        sum += w[z] * a[z] * b[z];
    return sum;
}

// Takes off the ripple of the period that makes the logarithm smoothest.
static void smooth_ripple(double *log_g, const double *weight, int first, int last, double period,
                          double harmonic)
{
    double c[HDR_CODES] = {0}, s[HDR_CODES] = {0};
    double dc[HDR_CODES], ds[HDR_CODES], d[HDR_CODES];
    for (int z = first; z <= last; z++) {
        double phase = 2 * M_PI * harmonic * log_g[z] / period;
        c[z] = cos(phase);
        s[z] = sin(phase);
    }
    ripple_of(log_g, log_g, first, last, period, d);
    ripple_of(log_g, c, first, last, period, dc);
    ripple_of(log_g, s, first, last, period, ds);
    double cc = product(dc, dc, weight, first, last), ss = product(ds, ds, weight, first, last);
    double cs = product(dc, ds, weight, first, last), det = cc * ss - cs * cs;
    double dcy = product(d, dc, weight, first, last), dsy = product(d, ds, weight, first, last);
    if (!(det > 1e-6 * cc * ss))
        return;
    for (int z = first; z <= last; z++)
        log_g[z] -= ((ss * dcy - cs * dsy) * c[z] + (cc * dsy - cs * dcy) * s[z]) / det;
}

static void choose_smoothest(const struct photos *photos, const double *weight, int first, int last,
                             double *exposure)
{
    double period = log(common_ratio(photos)), log_g[HDR_CODES];
    if (!isfinite(period))
        return;
    for (int z = first; z <= last; z++)
        log_g[z] = log(exposure[z]);
    for (int round = 0; round < RIPPLE_ROUNDS; round++) {
        for (int harmonic = 1; harmonic <= HARMONICS; harmonic++)
            smooth_ripple(log_g, weight, first, last, period, harmonic);
    }
    double more = log_g[last] - log(exposure[last]), less = log_g[first] - log(exposure[first]);
    for (int z = 1; z < HDR_CODES; z++)
        exposure[z] = z < first  ? exposure[z] * exp(less)
                      : z > last ? exposure[z] * exp(more)
                                 : exp(log_g[z]);
}

// Pool adjacent violators. Source: Ayer et al. 1955.
static void make_rise(double v[HDR_CODES])
{
    double value[HDR_CODES];
    int size[HDR_CODES], n = 0;
    for (int z = 0; z < HDR_CODES; z++) {
        value[n] = v[z];
        size[n++] = 1;
        for (; n > 1 && value[n - 2] > value[n - 1]; n--) {
            value[n - 2] = (value[n - 2] * size[n - 2] + value[n - 1] * size[n - 1]) /
                           (size[n - 2] + size[n - 1]);
            size[n - 2] += size[n - 1];
        }
    }
    for (int i = 0, z = 0; i < n; i++)
        for (int k = 0; k < size[i]; k++)
            v[z++] = value[i];
}

static bool worth_finding(const struct photos *p, struct error *err)
{
    if (p->bits != 8)
        return fail(err, ERROR_DATA,
                    "the response of %d bits cannot be found from pictures: give "
                    "it, or say that it is linear",
                    p->bits);
    if (p->light_count > HDR_FRAMES_MOST)
        return fail(err, ERROR_DATA, "%d exposures; at most %d are allowed", p->light_count,
                    HDR_FRAMES_MOST);
    if (!(p->photos[p->light_count - 1].seconds > p->photos[0].seconds))
        return fail(err, ERROR_DATA,
                    "all exposures are equal: the response cannot be found from them");
    return true;
}

static bool find(enum hdr_method method, const struct photos *photos, int channel,
                 struct response *r, uint8_t *codes, struct error *err)
{
    double seconds[HDR_FRAMES_MOST];
    struct raw raw = {{0}, {0}};
    int side = method == HDR_DEBEVEC ? DEBEVEC_SIDE : ROBERTSON_SIDE, pixels = 0;
    for (int i = 0; i < photos->light_count; i++)
        seconds[i] = photos->photos[i].seconds;
    if (!gather(photos, channel, side, codes, &pixels, err) ||
        !hdr_response(method, codes, seconds, photos->light_count, pixels, raw.exposure, err))
        return false;
    if (method == HDR_DEBEVEC)
        r->most = (int)(DEBEVEC_MOST * HDR_CODES);
    for (int i = 0; i < photos->light_count * pixels; i++)
        raw.weight[codes[i]] += (double)codes[i] * codes[i];
    smooth(&raw, r->least, r->most, r->exposure);
    choose_smoothest(photos, raw.weight, r->least, r->most, r->exposure);
    make_rise(r->exposure);
    return finish(r, err);
}

bool response_find(enum hdr_method method, const struct photos *photos, int channel,
                   struct response *out, struct error *err)
{
    struct response r = {0};
    if (!worth_finding(photos, err) || !make(HDR_CODES, &r, err))
        return false;
    uint8_t *codes = malloc((size_t)photos->light_count * PIXELS_MOST);
    bool fine = codes ? find(method, photos, channel, &r, codes, err)
                      : fail(err, ERROR_SYSTEM, "out of memory");
    free(codes);
    if (fine)
        *out = r;
    else
        response_fini(&r);
    return fine;
}

// ---- files -----------------------------------------------------------------

static bool from_table(const struct table *t, struct response *r, struct error *err)
{
    for (int z = 0; z < r->codes; z++) {
        r->exposure[z] = table_at(t, (size_t)z, 1);
        if (table_at(t, (size_t)z, 0) != z)
            return fail(err, ERROR_DATA, "code: %g where %d is expected", table_at(t, (size_t)z, 0),
                        z);
    }
    return finish(r, err);
}

bool response_load(const char *path, int bits, struct response *out, struct error *err)
{
    struct table t = {0};
    struct response r = {0};
    int codes = bits == 8 ? 256 : 65536;
    if (!csv_load(path, &t, err))
        return false;
    bool fine = (t.columns == 2 && t.rows == (size_t)codes) ||
                fail(err, ERROR_DATA, "%zu rows of %zu numbers; needed are %d of 2: code, exposure",
                     t.rows, t.columns, codes);
    fine = fine && make(codes, &r, err) && from_table(&t, &r, err);
    table_fini(&t);
    if (fine)
        *out = r;
    else
        response_fini(&r);
    return fine || while_doing(err, "%s", path);
}

bool response_save(const char *path, const struct response *r, struct error *err)
{
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    fprintf(file.stream, "code,exposure\n");
    for (int z = 0; z < r->codes; z++) {
        char text[NUMBER_TEXT];
        fprintf(file.stream, "%d,%s\n", z, number_text(text, r->exposure[z]));
    }
    return whole_file_commit(&file, err);
}

double response_difference(const struct response *a, const struct response *b)
{
    double sum = 0, square = 0;
    int n = 0;
    for (int z = a->codes / 10; z < 0.95 * a->codes; z++, n++) {
        double d = log(a->exposure[z] / b->exposure[z]);
        sum += d;
        square += d * d;
    }
    return sqrt(fmax(0, square / n - sum / n * (sum / n)));
}
