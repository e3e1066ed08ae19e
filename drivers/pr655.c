// SPDX-License-Identifier: Apache-2.0
#include "drivers/pr655.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/deadline.h"
#include "drivers/serial_line.h"

enum {
    GAP_MS = 10,     // between characters
    COMMAND_MS = 50, // between commands
    REPLY_MS = 2000, // to anything but a measurement
    LINE_MS = 1000,  // between the lines of a spectrum
    QUIET_MS = 100,
    MEASURE_MS = 65000, // adaptive exposure gives up after 60 s
    POINTS_MOST = 401,
    UNITS_SI = 0,
    MOST_FAILURES = 3,
};

#define ENTER_REMOTE "PHOTO"
#define LEAVE_REMOTE "Q"
#define MEASURE_SPECTRUM "M5"
#define GET_XYZ "D2"
#define GET_SERIAL "D110"
#define GET_MODEL "D111"

static const double last_nm = 780;
static const double fits_nm = 0.01; // rounding of the wavelengths sent

static const struct {
    int status;
    const char *text;
} meanings[] = {
    {-1, "light source not constant"},
    {-2, "light overload"},
    {-3, "cannot synchronise to the light source"},
    {-4, "adaptive mode error"},
    {-8, "weak light"},
    {-9, "synchronisation error"},
    {-12, "measurement timed out"},
    {-1000, "illegal command"},
    {-1001, "too many fields"},
    {-2000, "invalid data request"},
};

struct radiometer {
    struct radiometer_options options;
    struct serial_line line;
    char model[64], serial[64];
    bool remote;  // in remote mode
    bool adrift;  // an answer may still be under way
    int failures; // attempts to find it again, one after the other
};

bool pr655_status(const char *line, int *status, const char **rest)
{
    char *end;
    long value = strtol(line, &end, 10);
    if (end == line || (*end && *end != ',' && *end != ' ') || value < -99999 || value > 99999)
        return false;
    *status = (int)value;
    *rest = *end == ',' ? end + 1 : "";
    return true;
}

bool pr655_check(int status, struct error *err)
{
    const char *text = status <= -1000 ? "command refused" : "measurement failed";
    if (status == 0)
        return true;
    for (size_t i = 0; i < sizeof meanings / sizeof *meanings; i++)
        if (meanings[i].status == status)
            text = meanings[i].text;
    return fail(err,
                status == -2      ? ERROR_RANGE
                : status <= -1000 ? ERROR_DATA
                                  : ERROR_RETRY,
                "radiometer status %d: %s", status, text);
}

static bool number(const char **text, double *value)
{
    char *end;
    *value = strtod(*text, &end);
    if (end == *text || !isfinite(*value))
        return false;
    *text = end + strspn(end, " ");
    return true;
}

bool pr655_point(const char *line, double *nm, double *value)
{
    double a, b;
    if (!number(&line, &a) || *line++ != ',' || !number(&line, &b) || *line)
        return false;
    if (a < 200 || a > 2500)
        return false;
    *nm = a;
    *value = b;
    return true;
}

bool pr655_xyz(const char *rest, struct xyz *out, struct error *err)
{
    double v[4];
    const char *at = rest;
    bool fits = true;
    for (int i = 0; i < 4 && fits; i++) {
        fits = number(&at, &v[i]) && *at == (i < 3 ? ',' : 0);
        at += i < 3;
    }
    if (!fits)
        return fail(err, ERROR_DATA, "\"%.60s\" is not units,X,Y,Z", rest);
    if (v[0] != UNITS_SI)
        return fail(err, ERROR_DATA, "the radiometer does not count in SI units: set it to cd/m2");
    *out = (struct xyz){v[1], v[2], v[3]};
    return true;
}

bool pr655_spectrum_check(const double *nm, int count, bool complete, struct error *err)
{
    double step = count > 1 ? nm[1] - nm[0] : 0;
    if (count > 1 && !(step > 0))
        return fail(err, ERROR_DATA, "wavelengths do not ascend: %g after %g nm", nm[1], nm[0]);
    for (int i = 2; i < count; i++)
        if (fabs(nm[i] - nm[0] - i * step) > fits_nm)
            return fail(err, ERROR_DATA, "wavelengths in unequal steps: %g after %g nm", nm[i],
                        nm[i - 1]);
    if (!complete || (count > 1 && nm[count - 1] > last_nm - step / 2))
        return true;
    return fail(err, ERROR_DATA, "spectrum ends after %d points at %g nm", count,
                count ? nm[count - 1] : 0.0);
}

static bool command(struct radiometer *r, const char *text, int64_t deadline_ns, struct error *err)
{
    char line[16];
    snprintf(line, sizeof line, "%s\r", text);
    return serial_line_quiet(&r->line, COMMAND_MS, deadline_ns, err) &&
           serial_line_write(&r->line, line, GAP_MS, deadline_ns, err);
}

static bool reply(struct radiometer *r, char *text, size_t size, int wait_ms, int64_t deadline_ns,
                  struct error *err)
{
    const char *rest;
    int status;
    if (!serial_line_read(&r->line, text, size, wait_ms, deadline_ns, err))
        return false;
    if (!pr655_status(text, &status, &rest))
        return fail(err, ERROR_DATA, "radiometer answered \"%.60s\"", text);
    if (!pr655_check(status, err))
        return false;
    memmove(text, rest, strlen(rest) + 1);
    return true;
}

// The text behind the status, on the same line or the next.
static bool ask_text(struct radiometer *r, const char *what, char *out, size_t size,
                     int64_t deadline_ns, struct error *err)
{
    char text[256];
    if (!command(r, what, deadline_ns, err) ||
        !reply(r, text, sizeof text, REPLY_MS, deadline_ns, err) ||
        (!*text && !serial_line_read(&r->line, text, sizeof text, QUIET_MS, deadline_ns, err)))
        return while_doing(err, "asking the radiometer (%s)", what);
    snprintf(out, size, "%s", text + strspn(text, " "));
    return true;
}

// An instrument left in remote mode does not know PHOTO; the next question tells.
static bool enter_remote(struct radiometer *r, int64_t deadline_ns, struct error *err)
{
    char text[256];
    if (!command(r, ENTER_REMOTE, deadline_ns, err))
        return false;
    r->remote = true;
    if (serial_line_read(&r->line, text, sizeof text, REPLY_MS, deadline_ns, err))
        return true;
    return while_doing(err, "entering remote mode");
}

// After a lost answer: asks for the model until it is the model that answers.
// An instrument that was switched off and on is not in remote mode: reopen.
static bool find_again(struct radiometer *r, int64_t deadline_ns, struct error *err)
{
    char text[256];
    if (!serial_line_quiet(&r->line, QUIET_MS, deadline_ns, err))
        return false;
    while (ask_text(r, GET_MODEL, text, sizeof text, deadline_ns, err))
        if (!strcmp(text, r->model)) {
            r->adrift = false;
            r->failures = 0;
            return true;
        }
    if (++r->failures >= MOST_FAILURES)
        err->code = ERROR_GONE;
    return false;
}

static bool open_line(struct radiometer *r, int64_t deadline_ns, struct error *err)
{
    if (!*r->options.port)
        return fail(err, ERROR_CONFIG, "port: no serial line is given for the radiometer");
    return serial_line_open(&r->line, r->options.port, err) && enter_remote(r, deadline_ns, err) &&
           ask_text(r, GET_SERIAL, r->serial, sizeof r->serial, deadline_ns, err) &&
           ask_text(r, GET_MODEL, r->model, sizeof r->model, deadline_ns, err);
}

static void pr655_close(struct radiometer *r)
{
    if (!r)
        return;
    if (r->line.fd >= 0 && r->remote)
        serial_line_write(&r->line, LEAVE_REMOTE "\r", GAP_MS, clock_now_ns() + NS_PER_S, NULL);
    serial_line_close(&r->line);
    free(r);
}

static struct radiometer *pr655_open(const struct radiometer_options *options, int64_t deadline_ns,
                                     struct error *err)
{
    struct radiometer *r = calloc(1, sizeof *r);
    if (!r) {
        fail_errno(err, "opening the radiometer");
        return NULL;
    }
    r->options = *options;
    r->line.fd = -1;
    if (open_line(r, deadline_ns, err))
        return r;
    if (err && err->code == ERROR_RETRY)
        err->code = ERROR_GONE;
    pr655_close(r);
    return NULL;
}

struct points {
    double nm[POINTS_MOST], value[POINTS_MOST];
    int count;
};

// Takes points until the last wavelength, whatever lines stand before them.
static bool read_points(struct radiometer *r, struct points *p, int64_t deadline_ns,
                        struct error *err)
{
    for (p->count = 0; p->count < POINTS_MOST;) {
        char text[256];
        double *nm = &p->nm[p->count];
        if (!serial_line_read(&r->line, text, sizeof text, LINE_MS, deadline_ns, err))
            return while_doing(err, "after %d points of the spectrum", p->count);
        if (!pr655_point(text, nm, &p->value[p->count])) {
            if (p->count > 0)
                return fail(err, ERROR_DATA, "\"%.60s\" amidst the spectrum", text);
            continue;
        }
        p->count++;
        if (!pr655_spectrum_check(p->nm, p->count, false, err))
            return false;
        if (p->count > 1 && *nm > last_nm - (p->nm[1] - p->nm[0]) / 2)
            break;
    }
    return pr655_spectrum_check(p->nm, p->count, true, err);
}

static bool measure(struct radiometer *r, struct points *p, struct xyz *xyz, struct interval *taken,
                    int64_t deadline_ns, struct error *err)
{
    char text[256];
    if (!command(r, MEASURE_SPECTRUM, deadline_ns, err))
        return false;
    taken->earliest_ns = clock_now_ns() - GAP_MS * NS_PER_MS;
    if (!reply(r, text, sizeof text, MEASURE_MS, deadline_ns, err))
        return false;
    taken->latest_ns = clock_now_ns();
    return read_points(r, p, deadline_ns, err) && command(r, GET_XYZ, deadline_ns, err) &&
           reply(r, text, sizeof text, REPLY_MS, deadline_ns, err) && pr655_xyz(text, xyz, err);
}

static bool add(struct radiance_sample *sum, const struct points *p, struct xyz xyz,
                struct interval taken, bool first, struct error *err)
{
    if (first) {
        *sum = (struct radiance_sample){.taken = taken,
                                        .first_nm = p->nm[0],
                                        .count = p->count,
                                        .step_nm = p->nm[1] - p->nm[0]};
    } else if (p->count != sum->count) {
        return fail(err, ERROR_DATA, "%d points after %d", p->count, sum->count);
    }
    for (int i = 0; i < p->count; i++)
        sum->raw[i] += p->value[i];
    sum->xyz.X += xyz.X;
    sum->xyz.Y += xyz.Y;
    sum->xyz.Z += xyz.Z;
    sum->taken.latest_ns = taken.latest_ns;
    return true;
}

static bool finish(struct radiance_sample *sum, int averaged, struct error *err)
{
    double nm[POINTS_MOST];
    for (int i = 0; i < sum->count; i++) {
        sum->raw[i] /= averaged;
        nm[i] = sum->first_nm + i * sum->step_nm;
    }
    sum->xyz = (struct xyz){sum->xyz.X / averaged, sum->xyz.Y / averaged, sum->xyz.Z / averaged};
    return spectrum_from_samples(nm, sum->raw, (size_t)sum->count, false, &sum->radiance, err);
}

static bool pr655_read(struct radiometer *r, int64_t deadline_ns, struct radiance_sample *out,
                       struct error *err)
{
    struct radiance_sample sum = {0};
    struct error why = {0};
    double luminance[RADIOMETER_AVERAGE_MOST];
    bool ok = !r->adrift || find_again(r, deadline_ns, &why);
    for (int i = 0; ok && i < r->options.average; i++) {
        struct points points;
        struct xyz xyz;
        struct interval taken;
        ok = measure(r, &points, &xyz, &taken, deadline_ns, &why) &&
             add(&sum, &points, xyz, taken, i == 0, &why);
        luminance[i] = xyz.Y;
    }
    if (ok && !radiometer_agree(luminance, r->options.average, err))
        return false;
    if (ok && finish(&sum, r->options.average, &why)) {
        *out = sum;
        return true;
    }
    r->adrift = true;
    return fail(err, why.code, "%s", why.text);
}

static void pr655_identify(const struct radiometer *r, struct instrument_identity *out)
{
    memset(out, 0, sizeof *out);
    snprintf(out->model, sizeof out->model, "%s", r->model);
    snprintf(out->serial, sizeof out->serial, "%s", r->serial);
    out->emulated = !strncmp(r->serial, "EMU", 3);
}

const struct radiometer_driver pr655_driver = {"pr655", pr655_open, pr655_read, pr655_identify,
                                               pr655_close, false};
