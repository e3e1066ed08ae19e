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
    MODEL_MOST = 50,
};

struct radiometer {
    struct radiometer_options options;
    struct child child;
    enum spotread_line waits; // READY, CALIBRATION, RETRY: for a key; none was sent since
    bool opened;              // the instrument may be aimed at a light now
    bool spectral;            // spectra are asked for
    char model[64], serial[64], firmware[64];
};

// One reading, or what was said until the first one, as it is put together.
struct reading {
    bool has_xyz, failed, no_spectra;
    char last[160]; // line without a meaning to us
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

static bool has_any(const char *text, const char *const *words)
{
    for (; *words; words++)
        if (strstr(text, *words))
            return true;
    return false;
}

// Warnings that it goes on after.
static const char *const harmless[] = {"(ignored)", "ignored - instrument", "nitial calibrate",
                                       "nitial-calibrate", NULL};

static const char *const calibrations[] = {"calibration position", "reflective white reference",
                                           "Sensor should be in", NULL};

static const char *const failures[] = {"fail",
                                       "Fail",
                                       "Saturat",
                                       "saturat",
                                       "too low",
                                       "stopped at",
                                       "nrecognised",
                                       "fatal error",
                                       "No device",
                                       "instrument detected",
                                       "No instrument",
                                       "doesn't support",
                                       "Diagnostic:",
                                       "Error -",
                                       NULL};

static const char *const too_bright[] = {"aturat",      "oo much light", "oo bright",  "too high",
                                         "verexposure", "verrange",      "over range", NULL};

static const char *const losses[] = {"ommunication",        "comms",     "nitialis",
                                     "instrument detected", "No device", "No instrument",
                                     "nrecognised",         NULL};

enum spotread_line spotread_line(const char *text)
{
    text = skip_blanks(text);
    if (begins(text, "Result is XYZ:"))
        return SPOTREAD_XYZ;
    if (begins(text, "Spectrum from"))
        return SPOTREAD_SPECTRUM;
    if (has_any(text, calibrations))
        return SPOTREAD_CALIBRATION;
    if (strstr(text, "to take a reading"))
        return SPOTREAD_READY;
    if (strstr(text, "key to retry"))
        return SPOTREAD_RETRY;
    if (strstr(text, "Need spectral information"))
        return SPOTREAD_NO_SPECTRA;
    if (!has_any(text, harmless) && has_any(text, failures))
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
    if (spotread_line(line) == SPOTREAD_NO_SPECTRA)
        return fail(err, ERROR_CONFIG,
                    "spotread's instrument has no spectra: set spectral = auto or no, and no "
                    "option that needs them");
    return fail(err,
                has_any(line, too_bright) ? ERROR_RANGE
                : has_any(line, losses)   ? ERROR_GONE
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

static void take_failure(const char *line, struct reading *g)
{
    if (!g->failed)
        g->failed = !spotread_failure(line, &g->why);
}

static void take_line(struct radiometer *r, const char *line, struct reading *g)
{
    enum spotread_line what = spotread_line(line);
    bool blank = !*skip_blanks(line);
    if (what == SPOTREAD_XYZ)
        g->has_xyz = spotread_xyz(line, &g->xyz);
    else if (what == SPOTREAD_SPECTRUM &&
             !spotread_spectrum_head(line, &g->first_nm, &g->last_nm, &g->wanted))
        g->failed = !fail(&g->why, ERROR_DATA, "spotread: \"%.80s\"", line);
    else if (what == SPOTREAD_FAILED || what == SPOTREAD_NO_SPECTRA)
        take_failure(line, g);
    else if (what == SPOTREAD_OTHER && g->got < g->wanted && !blank &&
             !spotread_spectrum_values(line, g->values, g->wanted, &g->got))
        g->failed = !fail(&g->why, ERROR_DATA, "spotread: \"%.80s\" amidst the spectrum", line);
    else
        take_name(r, line);
    g->no_spectra = g->no_spectra || what == SPOTREAD_NO_SPECTRA;
    if (what == SPOTREAD_OTHER && !blank)
        snprintf(g->last, sizeof g->last, "%.*s", (int)sizeof g->last - 1, skip_blanks(line));
}

static bool fail_calibration(struct error *err)
{
    return fail(err, ERROR_GONE,
                "spotread asks for calibration: put the instrument on its calibration position and "
                "set calibrate = yes, or calibrate with spotread itself first");
}

// The program ended, or its terminal makes no sense any more.
static bool fail_ended(const struct reading *g, const struct error *why, struct error *err)
{
    if (g->failed)
        return fail(err, g->why.code == ERROR_CONFIG ? ERROR_CONFIG : ERROR_GONE, "%s",
                    g->why.text);
    return fail(err, ERROR_GONE, "%s%s%s", why->text, *g->last ? ": " : "", g->last);
}

// Reads lines into g until spotread waits for a key: READY, CALIBRATION or
// RETRY. Its last line has no end, and differs between versions, so that a
// pause ends the first two.
static bool await_prompt(struct radiometer *r, struct reading *g, int64_t deadline_ns,
                         struct error *err)
{
    enum spotread_line prompted = SPOTREAD_OTHER;
    for (;;) {
        char line[CHILD_LINE];
        bool whole;
        struct error why = {0};
        if (!child_line(&r->child, line, sizeof line, prompted ? QUIET_MS : 1000, deadline_ns,
                        &whole, &why)) {
            if (why.code != ERROR_RETRY)
                return fail_ended(g, &why, err);
            r->waits = prompted;
            if (prompted)
                return true;
        } else {
            enum spotread_line is = spotread_line(line);
            if (is == SPOTREAD_READY || is == SPOTREAD_RETRY) {
                r->waits = is;
                return true;
            }
            if (is == SPOTREAD_CALIBRATION)
                prompted = is;
            else if (!prompted && strstr(line, "Place instrument on spot"))
                prompted = SPOTREAD_READY;
            else if (whole && !prompted)
                take_line(r, line, g);
        }
        if (deadline_ms(deadline_ns, 1) <= 0)
            return fail(err, ERROR_RETRY, "%s",
                        g->failed  ? g->why.text
                        : why.code ? why.text
                                   : "spotread does not come to an end");
    }
}

static bool press(struct radiometer *r, int64_t deadline_ns, struct error *err)
{
    if (!child_write(&r->child, KEY_READ, deadline_ns, err))
        return false;
    child_forget(&r->child); // the prompt that was answered
    r->waits = SPOTREAD_OTHER;
    return true;
}

// After a reading that failed any key brings the usual prompt back. A lost
// instrument stays lost to this process, and a calibration that failed would
// fail again: those end it.
static bool answer_retry(struct radiometer *r, struct reading *g, int64_t deadline_ns,
                         struct error *err)
{
    if (!g->failed)
        g->failed =
            !fail(&g->why, ERROR_RETRY, "spotread: %s", *g->last ? g->last : "no reason given");
    if (!r->opened || g->why.code == ERROR_GONE)
        return fail(err, ERROR_GONE, "%s", g->why.text);
    return press(r, deadline_ns, err);
}

// Until it waits for a key to read. At the start it may calibrate; later the
// instrument looks at a light.
static bool get_ready(struct radiometer *r, struct reading *g, int64_t deadline_ns,
                      struct error *err)
{
    bool calibrated = !r->options.calibrate || r->opened;
    while (r->waits != SPOTREAD_READY) {
        if (r->waits == SPOTREAD_CALIBRATION) {
            if (calibrated)
                return fail_calibration(err);
            if (!press(r, deadline_ns, err))
                return false;
            calibrated = true;
        } else if (r->waits == SPOTREAD_RETRY) {
            if (!answer_retry(r, g, deadline_ns, err))
                return false;
        } else if (!await_prompt(r, g, deadline_ns, err)) {
            return while_doing(err, "waiting for spotread");
        }
    }
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
    *g = (struct reading){0};
    if (!get_ready(r, g, deadline_ns, err))
        return false;
    *g = (struct reading){0}; // without what an earlier reading left
    taken->earliest_ns = clock_now_ns();
    if (!press(r, deadline_ns, err) || !await_prompt(r, g, deadline_ns, err))
        return while_doing(err, "waiting for a reading");
    taken->latest_ns = clock_now_ns();
    if (r->waits == SPOTREAD_CALIBRATION)
        return fail_calibration(err);
    if (r->waits == SPOTREAD_RETRY && !answer_retry(r, g, deadline_ns, err))
        return false;
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

// Verbose (who it is), emissive, no needless calibration, with the spectrum; then
// what the settings add, such as "-y l -X panel.ccss".
static bool start(struct radiometer *r, struct error *err)
{
    char words[sizeof r->options.arguments];
    const char *argv[ARGUMENTS_MOST + 1] = {r->options.program, "-v", "-e", "-N"};
    int argc = 4;
    char *rest = NULL;
    if (r->spectral)
        argv[argc++] = "-s";
    snprintf(words, sizeof words, "%s", r->options.arguments);
    for (char *w = strtok_r(words, " \t", &rest); w; w = strtok_r(NULL, " \t", &rest)) {
        if (argc == ARGUMENTS_MOST)
            return fail(err, ERROR_CONFIG, "arguments: more than %d words", ARGUMENTS_MOST - 5);
        argv[argc++] = w;
    }
    return child_start(&r->child, argv, "ARGYLL_NOT_INTERACTIVE=1", err);
}

// A colorimeter that is asked for spectra ends spotread before anything else;
// then once more without.
static bool begin(struct radiometer *r, int64_t deadline_ns, struct error *err)
{
    struct reading g = {0};
    r->spectral = r->options.spectral != RADIOMETER_SPECTRAL_NO;
    if (start(r, err) && get_ready(r, &g, deadline_ns, err))
        return true;
    if (!g.no_spectra || r->options.spectral != RADIOMETER_SPECTRAL_AUTO)
        return false;
    child_end(&r->child);
    r->spectral = false;
    g = (struct reading){0};
    return start(r, err) && get_ready(r, &g, deadline_ns, err);
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
    r->opened = begin(r, deadline_ns, err);
    if (r->opened)
        return r;
    if (err->code == ERROR_RETRY)
        err->code = ERROR_GONE;
    spotread_close(r);
    return NULL;
}

static void spotread_identify(const struct radiometer *r, struct instrument_identity *out)
{
    memset(out, 0, sizeof *out);
    snprintf(out->model, sizeof out->model, "%.*s%s", MODEL_MOST,
             *r->model ? r->model : "by spotread", r->spectral ? "" : " (no spectra)");
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
