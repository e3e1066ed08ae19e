// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_pr655.h"

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "colorimetry/colour.h"
#include "simulator/model_noise.h"
#include "simulator/model_slit.h"

enum status {
    STATUS_OK = 0,
    STATUS_NOT_CONSTANT = -1,
    STATUS_OVERLOAD = -2,
    STATUS_WEAK = -8,
    STATUS_ILLEGAL = -1000,
    STATUS_FIELDS = -1001,
    STATUS_RANGE = -1005,
    STATUS_NO_DATA = -2000,
};

enum data {
    DATA_LAST = 0,
    DATA_YXY = 1,
    DATA_XYZ = 2,
    DATA_YUV = 3,
    DATA_CCT = 4,
    DATA_SPECTRUM = 5,
    DATA_YXYUV = 6,
    DATA_EXPOSURE = 13,
    DATA_SERIAL = 110,
    DATA_MODEL = 111,
    DATA_ACCESSORIES = 116,
    DATA_APERTURES = 117,
    DATA_HARDWARE = 120,
};

enum { LINE_MOST = 64, OUT_MOST = 8192, BANDPASS_NM = 8, SAMPLES = 16 };

#define WELL_ELECTRONS 200000.0
#define FILL_AIM 0.7
#define FILL_PER_S 400.0      // of the well, for 1 W m-2 sr-1 nm-1
#define FILL_LEAST 0.004      // below it: weak light
#define READ_ELECTRONS 20.0
#define REPEAT_ALL 0.001      // relative, common to all points of a reading
#define REPEAT_POINT 0.0005   // relative, each point by itself
#define EXPOSURE_LEAST_MS 3.0
#define EXPOSURE_MOST_MS 6000.0
#define OVERHEAD_MS 300.0     // shutter, dark reading, arithmetic
#define WATT_PHOTONS 5.03411657e15 // photons/s per W and nm

struct pr655 {
    struct pr655_options options;
    struct noise noise;
    char serial[32];
    bool remote, echo;
    int upset;
    struct lapse lapse;

    char line[LINE_MOST];
    size_t line_size;
    char out[OUT_MOST];
    size_t out_size;

    double fixed_ms; // 0 = adaptive
    int averages;

    bool measuring;
    int code, last_code; // asked for by M; by the last M or D
    int64_t sample_ns, light_end_ns, end_ns, step_ns;
    int samples;
    double exposure_ms;
    double sum[PR655_POINTS];

    int status; // of the last measurement
    bool measured;
    double radiance[PR655_POINTS];
};

struct pr655 *pr655_create(const struct pr655_options *options)
{
    struct pr655 *d = calloc(1, sizeof(*d));
    if (!d)
        return NULL;
    d->options = *options;
    snprintf(d->serial, sizeof(d->serial), "%s", options->serial);
    noise_init(&d->noise, options->seed, 'r');
    d->lapse.rates = options->lapses;
    d->averages = 1;
    d->last_code = DATA_YXY;
    return d;
}

void pr655_destroy(struct pr655 *device)
{
    free(device);
}

void pr655_upset(struct pr655 *device, int status)
{
    device->upset = status;
}

void pr655_lapse(struct pr655 *device, enum lapse_kind kind)
{
    lapse_set(&device->lapse, kind);
}

__attribute__((format(printf, 2, 3))) static void say(struct pr655 *d, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    size_t room = sizeof(d->out) - d->out_size;
    int n = vsnprintf(d->out + d->out_size, room, format, args);
    va_end(args);
    if (n > 0 && (size_t)n < room) // a full line buffer loses whole answers
        d->out_size += (size_t)n;
}

// ---- light -------------------------------------------------------------------------

static void look(struct pr655 *d, int64_t now_ns, double points[PR655_POINTS])
{
    struct spectrum light;
    d->options.around.radiance(d->options.around.context, now_ns, &light);
    for (int i = 0; i < PR655_POINTS; i++)
        points[i] = slit_mean(&light, PR655_FIRST_NM + i * PR655_STEP_NM, BANDPASS_NM);
}

static double peak_of(const double points[PR655_POINTS], int *at)
{
    *at = 0;
    for (int i = 1; i < PR655_POINTS; i++)
        if (points[i] > points[*at])
            *at = i;
    return points[*at];
}

static void start_measuring(struct pr655 *d, int code, int64_t now_ns)
{
    double first[PR655_POINTS];
    int at;
    look(d, now_ns, first);
    double wanted_ms = 1000 * FILL_AIM / (FILL_PER_S * fmax(peak_of(first, &at), 1e-12));
    d->exposure_ms = d->fixed_ms > 0 ? d->fixed_ms
                                     : fmin(fmax(wanted_ms, EXPOSURE_LEAST_MS), EXPOSURE_MOST_MS);
    double light_ms = d->exposure_ms * d->averages / d->options.hurry;
    d->measuring = true;
    d->code = code;
    d->samples = 0;
    memset(d->sum, 0, sizeof(d->sum));
    d->sample_ns = now_ns;
    d->light_end_ns = now_ns + (int64_t)(light_ms * 1e6);
    d->end_ns = d->light_end_ns + (int64_t)((OVERHEAD_MS / d->options.hurry + light_ms) * 1e6);
    d->step_ns = (d->light_end_ns - now_ns) / SAMPLES + 1;
}

static void take_samples(struct pr655 *d, int64_t now_ns)
{
    if (now_ns < d->sample_ns || (d->samples > 0 && now_ns > d->light_end_ns))
        return;
    double points[PR655_POINTS];
    look(d, now_ns, points);
    for (int i = 0; i < PR655_POINTS; i++)
        d->sum[i] += points[i];
    d->samples++;
    d->sample_ns = now_ns + d->step_ns;
}

static int finish_exposure(struct pr655 *d)
{
    double mean[PR655_POINTS], lapse;
    int at;
    for (int i = 0; i < PR655_POINTS; i++)
        mean[i] = d->sum[i] / d->samples;
    double fill_per_radiance = FILL_PER_S * d->exposure_ms / 1000;
    double fill = peak_of(mean, &at) * fill_per_radiance;
    if (d->upset)
        return d->upset;
    if (fill > 1)
        return STATUS_OVERLOAD;
    if (fill < FILL_LEAST)
        return STATUS_WEAK;
    if (!lapse_next(&d->lapse, &lapse))
        return STATUS_NOT_CONSTANT;

    double electrons_per_radiance = fill_per_radiance * WELL_ELECTRONS * d->averages;
    double read2 = READ_ELECTRONS * READ_ELECTRONS * d->averages;
    double common = (1 + REPEAT_ALL * noise_normal(&d->noise)) * lapse;
    for (int i = 0; i < PR655_POINTS; i++) {
        double electrons = mean[i] * electrons_per_radiance;
        electrons += sqrt(electrons + read2) * noise_normal(&d->noise);
        double point = 1 + REPEAT_POINT * noise_normal(&d->noise);
        d->radiance[i] = electrons / electrons_per_radiance * common * point;
    }
    d->measured = true;
    return STATUS_OK;
}

// ---- data ----------------------------------------------------------------------------

static struct xyz tristimulus(const struct pr655 *d)
{
    const struct spectrum *cmf = observer_cmf(OBSERVER_1931_2);
    double sum[3] = {0};
    for (int i = 0; i < PR655_POINTS; i++)
        for (int k = 0; k < 3; k++)
            sum[k] += d->radiance[i] *
                      cmf[k].v[PR655_FIRST_NM + i * PR655_STEP_NM - SPECTRUM_FIRST_NM];
    double scale = 683 * PR655_STEP_NM;
    return (struct xyz){scale * sum[0], scale * sum[1], scale * sum[2]};
}

static void say_spectrum(struct pr655 *d)
{
    int at;
    double power = 0, photons = 0;
    peak_of(d->radiance, &at);
    for (int i = 0; i < PR655_POINTS; i++) {
        double nm = PR655_FIRST_NM + i * PR655_STEP_NM;
        power += PR655_STEP_NM * d->radiance[i];
        photons += PR655_STEP_NM * d->radiance[i] * nm * WATT_PHOTONS;
    }
    say(d, "%05d,0,%d,%.3e,%.3e\r\n", STATUS_OK, PR655_FIRST_NM + at * PR655_STEP_NM, power,
        photons);
    for (int i = 0; i < PR655_POINTS; i++)
        say(d, " %d,%.3e\r\n", PR655_FIRST_NM + i * PR655_STEP_NM, d->radiance[i]);
}

static void say_colour(struct pr655 *d, int code)
{
    struct xyz c = tristimulus(d);
    struct xy xy = xy_of(c);
    struct uv uv = uv_of(c);
    struct cct cct = cct_of(xy);
    if (code == DATA_XYZ)
        say(d, "00000,0,%.3e,%.3e,%.3e\r\n", c.X, c.Y, c.Z);
    else if (code == DATA_YUV)
        say(d, "00000,0,%.3e,%.4f,%.4f\r\n", c.Y, uv.u, uv.v);
    else if (code == DATA_CCT)
        say(d, "00000,0,%.3e,%5.0f,%.4f\r\n", c.Y, cct.valid ? cct.kelvin : 0, cct.duv);
    else if (code == DATA_YXYUV)
        say(d, "00000,0,%.3e,%.4f,%.4f,%.4f,%.4f\r\n", c.Y, xy.x, xy.y, uv.u, uv.v);
    else
        say(d, "00000,0,%.3e,%.4f,%.4f\r\n", c.Y, xy.x, xy.y);
}

static bool say_about_itself(struct pr655 *d, int code)
{
    switch (code) {
    case DATA_SERIAL:
        say(d, "00000,%s\r\n", d->serial);
        return true;
    case DATA_MODEL:
        say(d, "00000,PR-655\r\n");
        return true;
    case DATA_ACCESSORIES:
        say(d, "00000,MS-75\r\n");
        return true;
    case DATA_APERTURES:
        say(d, "00000,1 deg\r\n");
        return true;
    case DATA_HARDWARE:
        say(d, "00000,%d,%d.00,%d.00,%d.00,%d.00\r\n", PR655_POINTS, BANDPASS_NM, PR655_FIRST_NM,
            PR655_FIRST_NM + (PR655_POINTS - 1) * PR655_STEP_NM, PR655_STEP_NM);
        return true;
    default:
        return false;
    }
}

static void say_data(struct pr655 *d, int code)
{
    if (code == DATA_LAST)
        code = d->last_code;
    if (say_about_itself(d, code))
        return;
    bool known = (code >= DATA_YXY && code <= DATA_YXYUV) || code == DATA_EXPOSURE;
    if (known && d->measured && d->status == STATUS_OK)
        d->last_code = code;
    if (!known || (!d->measured && d->status == STATUS_OK))
        say(d, "%05d\r\n", STATUS_NO_DATA);
    else if (d->status != STATUS_OK)
        say(d, "%05d\r\n", d->status);
    else if (code == DATA_EXPOSURE)
        say(d, "00000,1,%.1f\r\n", d->exposure_ms);
    else if (code == DATA_SPECTRUM)
        say_spectrum(d);
    else
        say_colour(d, code);
}

// ---- commands --------------------------------------------------------------------------

static int set_exposure(struct pr655 *d, double ms)
{
    if (ms != 0 && (ms < EXPOSURE_LEAST_MS || ms > EXPOSURE_MOST_MS))
        return STATUS_RANGE;
    d->fixed_ms = ms;
    return STATUS_OK;
}

static int set_averages(struct pr655 *d, double count)
{
    if (count < 1 || count > 99)
        return STATUS_RANGE;
    d->averages = (int)count;
    return STATUS_OK;
}

static int set_up(struct pr655 *d, const char *text)
{
    char *end;
    double value = *text ? strtod(text + 1, &end) : 0;
    if (!*text || end == text + 1)
        return STATUS_ILLEGAL;
    if (*end == ',')
        return STATUS_FIELDS;
    if (*end)
        return STATUS_ILLEGAL;
    if (text[0] == 'E')
        return set_exposure(d, value);
    if (text[0] == 'N')
        return set_averages(d, value);
    return strchr("ABCDFGHKORSTU", text[0]) ? STATUS_OK : STATUS_ILLEGAL;
}

static bool code_of(const char *text, int *code)
{
    char *end;
    long value = strtol(text, &end, 10);
    *code = (int)value;
    return end != text && *end == '\0' && value >= 0 && value <= 999;
}

static void execute(struct pr655 *d, int64_t now_ns)
{
    const char *line = d->line;
    int code;
    switch (line[0]) {
    case 'M':
        if (!code_of(line + 1, &code))
            say(d, "%05d\r\n", STATUS_ILLEGAL);
        else
            start_measuring(d, code, now_ns);
        break;
    case 'D':
        if (!code_of(line + 1, &code))
            say(d, "%05d\r\n", STATUS_ILLEGAL);
        else
            say_data(d, code);
        break;
    case 'S':
        say(d, "%05d\r\n", set_up(d, line + 1));
        break;
    case 'Q':
        d->remote = false;
        break;
    case 'E':
        d->echo = !d->echo;
        break;
    case 'B':
    case 'C':
    case 'L':
        say(d, "00000\r\n");
        break;
    case 'I':
        say(d, "%05d\r\n", d->status);
        break;
    case 'F':
        say(d, "00000,0.00\r\n");
        break;
    default:
        say(d, "%05d\r\n", STATUS_ILLEGAL);
    }
}

void pr655_in(struct pr655 *device, int64_t now_ns, char c)
{
    struct pr655 *d = device;
    if (d->measuring) // it does not listen then
        return;
    if (d->echo)
        say(d, "%c", c);
    if (c != '\r' && c != '\n') {
        if (d->line_size + 1 < LINE_MOST)
            d->line[d->line_size++] = c;
        return;
    }
    d->line[d->line_size] = '\0';
    bool empty = d->line_size == 0;
    d->line_size = 0;
    if (empty)
        return;
    if (strcmp(d->line, "PHOTO") == 0) {
        d->remote = true;
        say(d, " REMOTE MODE\r\n");
    } else if (d->remote) {
        execute(d, now_ns);
    }
}

size_t pr655_out(struct pr655 *device, int64_t now_ns, char *out, size_t size, int64_t *again_ns)
{
    struct pr655 *d = device;
    *again_ns = INT64_MAX;
    if (d->measuring) {
        take_samples(d, now_ns);
        if (now_ns >= d->end_ns) {
            d->measuring = false;
            d->status = finish_exposure(d);
            say_data(d, d->code);
        } else {
            *again_ns = d->sample_ns < d->light_end_ns ? d->sample_ns : d->end_ns;
        }
    }
    size_t count = d->out_size < size ? d->out_size : size;
    memcpy(out, d->out, count);
    d->out_size -= count;
    memmove(d->out, d->out + count, d->out_size);
    return count;
}
