// SPDX-License-Identifier: Apache-2.0
#include "drivers/spotread.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/child.h"
#include "drivers/deadline.h"
#include "drivers/found.h"

enum {
    KEY_READ = ' ', // newline would do on some builds and not on others
    MILLI = 1000,   // spotread counts in mW
    ARGUMENTS_MOST = 32,
    VALUES_MOST = 401,
    QUIET_MS = 250, // after which a line without an end is all there is
};

struct radiometer {
    struct radiometer_options options;
    struct child child;
    bool ready; // it waits for a key; none was sent since
    char model[64], serial[64], firmware[64];
};

// One reading as it is put together.
struct reading {
    bool has_xyz, failed;
    struct xyz xyz;
    double first_nm, last_nm, values[VALUES_MOST];
    int wanted, got;
    struct error why;
};

static const char *skip_blanks(const char *text)
{
    return text + strspn(text, " \t");
}

static bool begins(const char *text, const char *with)
{
    return !strncmp(text, with, strlen(with));
}

enum spotread_line spotread_line(const char *text)
{
    static const char *const failures[] = {"fail",        "Fail",     "Saturat",
                                           "saturat",     "too low",  "stopped at user",
                                           "nrecognised", "No device"};
    text = skip_blanks(text);
    if (begins(text, "Result is XYZ:"))
        return SPOTREAD_XYZ;
    if (begins(text, "Spectrum from"))
        return SPOTREAD_SPECTRUM;
    if (strstr(text, "calibration position") || strstr(text, "reflective white reference") ||
        strstr(text, "Sensor should be in"))
        return SPOTREAD_CALIBRATION;
    if (strstr(text, "to take a reading"))
        return SPOTREAD_READY;
    for (size_t i = 0; i < sizeof failures / sizeof *failures; i++)
        if (strstr(text, failures[i]))
            return SPOTREAD_FAILED;
    return SPOTREAD_OTHER;
}

bool spotread_xyz(const char *line, struct xyz *out)
{
    struct xyz v;
    if (sscanf(line, " Result is XYZ: %lf %lf %lf", &v.X, &v.Y, &v.Z) != 3 || !isfinite(v.X) ||
        !isfinite(v.Y) || !isfinite(v.Z))
        return false;
    *out = v;
    return true;
}

bool spotread_spectrum_head(const char *line, double *first_nm, double *last_nm, int *count)
{
    double first, last;
    int steps;
    if (sscanf(line, " Spectrum from %lf to %lf nm in %d steps", &first, &last, &steps) != 3)
        return false;
    if (!(first >= 200 && last > first && last <= 2500) || steps < 2 || steps > VALUES_MOST)
        return false;
    *first_nm = first;
    *last_nm = last;
    *count = steps;
    return true;
}

bool spotread_spectrum_values(const char *line, double *values, int most, int *got)
{
    const char *at = line + strspn(line, " \t,");
    while (*at) {
        char *end;
        double value = strtod(at, &end);
        if (end == at || !isfinite(value) || *got >= most || !strchr(" \t,", *end))
            return false;
        values[(*got)++] = value;
        at = end + strspn(end, " \t,");
    }
    return true;
}

bool spotread_failure(const char *line, struct error *err)
{
    bool saturated = strstr(line, "aturat") != NULL;
    bool lost = strstr(line, "ommunication") || strstr(line, "comms") ||
                strstr(line, "nitialisation") || strstr(line, "No device") ||
                strstr(line, "nrecognised");
    return fail(err,
                saturated ? ERROR_RANGE
                : lost    ? ERROR_GONE
                          : ERROR_RETRY,
                "spotread: %s", skip_blanks(line));
}

static void learn(char *out, size_t size, const char *line, const char *title)
{
    line = skip_blanks(line);
    if (begins(line, title))
        found_text(out, size, line + strlen(title));
}

static void take_name(struct radiometer *r, const char *line)
{
    learn(r->model, sizeof r->model, line, "Instrument Type:");
    learn(r->serial, sizeof r->serial, line, "Serial Number:");
    learn(r->firmware, sizeof r->firmware, line, "Firmware version:");
}

static void take_line(struct radiometer *r, const char *line, struct reading *g)
{
    enum spotread_line what = spotread_line(line);
    if (what == SPOTREAD_XYZ)
        g->has_xyz = spotread_xyz(line, &g->xyz);
    else if (what == SPOTREAD_SPECTRUM &&
             !spotread_spectrum_head(line, &g->first_nm, &g->last_nm, &g->wanted))
        g->failed = !fail(&g->why, ERROR_DATA, "spotread: \"%.80s\"", line);
    else if (what == SPOTREAD_FAILED && !g->failed)
        g->failed = !spotread_failure(line, &g->why);
    else if (what == SPOTREAD_OTHER && g->got < g->wanted && *skip_blanks(line) &&
             !spotread_spectrum_values(line, g->values, g->wanted, &g->got))
        g->failed = !fail(&g->why, ERROR_DATA, "spotread: \"%.80s\" amidst the spectrum", line);
    else
        take_name(r, line);
}

static bool fail_calibration(struct radiometer *r, struct error *err)
{
    r->ready = false;
    return fail(err, ERROR_GONE,
                "spotread asks for calibration: put the instrument on its calibration position and "
                "set calibrate = yes, or calibrate with spotread itself first");
}

// Reads lines into g until spotread waits for a key: READY or CALIBRATION. Its
// last line has no end, and differs between versions, so that a pause ends it.
static bool await_prompt(struct radiometer *r, struct reading *g, enum spotread_line *what,
                         int64_t deadline_ns, struct error *err)
{
    bool prompted = false, calibration = false;
    for (;;) {
        char line[CHILD_LINE];
        bool whole;
        int wait = prompted || calibration ? QUIET_MS : 1000;
        struct error why = {0};
        if (!child_line(&r->child, line, sizeof line, wait, deadline_ns, &whole, &why)) {
            if (why.code != ERROR_RETRY)
                return fail(err, ERROR_GONE, "%s", g->failed ? g->why.text : why.text);
            *what = calibration ? SPOTREAD_CALIBRATION : SPOTREAD_READY;
            if (prompted || calibration)
                return true;
            if (deadline_ms(deadline_ns, 1) <= 0)
                return fail(err, ERROR_RETRY, "%s", why.text);
            continue;
        }
        enum spotread_line is = spotread_line(line);
        calibration = calibration || is == SPOTREAD_CALIBRATION;
        prompted = prompted || strstr(line, "Place instrument on spot") != NULL;
        if (is == SPOTREAD_READY) {
            *what = SPOTREAD_READY;
            return true;
        }
        if (whole && !prompted)
            take_line(r, line, g);
    }
}

static bool press(struct radiometer *r, int64_t deadline_ns, struct error *err)
{
    r->ready = false;
    child_forget(&r->child); // the prompt that is answered now
    return child_write(&r->child, KEY_READ, deadline_ns, err);
}

// Until the first prompt; *g is what it said on the way.
static bool get_ready(struct radiometer *r, int64_t deadline_ns, struct error *err)
{
    struct reading g = {0};
    enum spotread_line what;
    for (int tries = 0;; tries++) {
        if (!await_prompt(r, &g, &what, deadline_ns, err))
            return while_doing(err, "waiting for spotread");
        if (what == SPOTREAD_READY)
            break;
        if (!r->options.calibrate || tries > 0)
            return fail_calibration(r, err);
        if (!press(r, deadline_ns, err))
            return false;
    }
    r->ready = true;
    return true;
}

static bool complete(const struct reading *g, struct error *err)
{
    if (g->failed)
        return fail(err, g->why.code == ERROR_DATA ? ERROR_RETRY : g->why.code, "%s", g->why.text);
    if (!g->has_xyz)
        return fail(err, ERROR_RETRY, "spotread gave no result");
    if (g->got != g->wanted)
        return fail(err, ERROR_RETRY, "spotread: %d values instead of %d", g->got, g->wanted);
    return true;
}

// A key only ever goes out while spotread waits for one: a key during a
// measurement ends it, and two make two readings.
static bool read_once(struct radiometer *r, struct reading *g, struct interval *taken,
                      int64_t deadline_ns, struct error *err)
{
    enum spotread_line what;
    *g = (struct reading){0};
    if (!r->ready && !get_ready(r, deadline_ns, err))
        return false;
    taken->earliest_ns = clock_now_ns();
    if (!press(r, deadline_ns, err) || !await_prompt(r, g, &what, deadline_ns, err))
        return while_doing(err, "waiting for a reading");
    taken->latest_ns = clock_now_ns();
    if (what == SPOTREAD_CALIBRATION)
        return fail_calibration(r, err);
    r->ready = true;
    return complete(g, err);
}

static bool add(struct radiance_sample *sum, const struct reading *g, struct interval taken,
                bool first, struct error *err)
{
    if (first) {
        *sum = (struct radiance_sample){.taken = taken, .count = g->wanted};
        sum->first_nm = g->first_nm;
        sum->step_nm = g->wanted ? (g->last_nm - g->first_nm) / (g->wanted - 1) : 0;
    } else if (g->wanted != sum->count) {
        return fail(err, ERROR_RETRY, "spotread: %d values after %d", g->wanted, sum->count);
    }
    for (int i = 0; i < g->wanted; i++)
        sum->raw[i] += g->values[i] / MILLI;
    sum->xyz = (struct xyz){sum->xyz.X + g->xyz.X, sum->xyz.Y + g->xyz.Y, sum->xyz.Z + g->xyz.Z};
    sum->taken.latest_ns = taken.latest_ns;
    return true;
}

static bool finish(struct radiance_sample *sum, int averaged, struct error *err)
{
    double nm[VALUES_MOST];
    for (int i = 0; i < sum->count; i++) {
        sum->raw[i] /= averaged;
        nm[i] = sum->first_nm + i * sum->step_nm;
    }
    sum->xyz = (struct xyz){sum->xyz.X / averaged, sum->xyz.Y / averaged, sum->xyz.Z / averaged};
    return !sum->count ||
           spectrum_from_samples(nm, sum->raw, (size_t)sum->count, false, &sum->radiance, err);
}

static bool spotread_read(struct radiometer *r, int64_t deadline_ns, struct radiance_sample *out,
                          struct error *err)
{
    struct radiance_sample sum = {0};
    double luminance[RADIOMETER_AVERAGE_MOST];
    struct error own;
    err = err ? err : &own;
    for (int i = 0; i < r->options.average; i++) {
        struct reading g;
        struct interval taken = {0};
        if (!read_once(r, &g, &taken, deadline_ns, err) || !add(&sum, &g, taken, i == 0, err))
            return false;
        luminance[i] = g.xyz.Y;
    }
    if (!radiometer_agree(luminance, r->options.average, err) ||
        !finish(&sum, r->options.average, err))
        return false;
    *out = sum;
    return true;
}

// Verbose (who it is), emissive, with the spectrum, no needless calibration; then
// what the settings add, such as "-y l -X panel.ccss".
static bool start(struct radiometer *r, struct error *err)
{
    char words[sizeof r->options.arguments];
    const char *argv[ARGUMENTS_MOST + 1] = {r->options.program, "-v", "-e", "-s", "-N"};
    int argc = 5;
    char *rest = NULL;
    snprintf(words, sizeof words, "%s", r->options.arguments);
    for (char *w = strtok_r(words, " \t", &rest); w; w = strtok_r(NULL, " \t", &rest)) {
        if (argc == ARGUMENTS_MOST)
            return fail(err, ERROR_CONFIG, "arguments: more than %d words", ARGUMENTS_MOST - 5);
        argv[argc++] = w;
    }
    return child_start(&r->child, argv, "ARGYLL_NOT_INTERACTIVE=1", err);
}

static void spotread_close(struct radiometer *r)
{
    if (!r)
        return;
    child_end(&r->child);
    free(r);
}

static struct radiometer *spotread_open(const struct radiometer_options *options,
                                        int64_t deadline_ns, struct error *err)
{
    struct error own;
    err = err ? err : &own;
    struct radiometer *r = calloc(1, sizeof *r);
    if (!r) {
        fail_errno(err, "starting spotread");
        return NULL;
    }
    r->options = *options;
    r->child.fd = -1;
    if (start(r, err) && get_ready(r, deadline_ns, err))
        return r;
    if (err->code == ERROR_RETRY)
        err->code = ERROR_GONE;
    spotread_close(r);
    return NULL;
}

static void spotread_identify(const struct radiometer *r, struct instrument_identity *out)
{
    memset(out, 0, sizeof *out);
    snprintf(out->model, sizeof out->model, "%s", *r->model ? r->model : "by spotread");
    snprintf(out->serial, sizeof out->serial, "%s", r->serial);
    snprintf(out->firmware, sizeof out->firmware, "%s", r->firmware);
    out->emulated = !strncmp(r->serial, "EMU", 3);
}

const struct radiometer_driver spotread_driver = {.name = "spotread",
                                                  .open = spotread_open,
                                                  .read = spotread_read,
                                                  .identify = spotread_identify,
                                                  .close = spotread_close,
                                                  .portless = true};
