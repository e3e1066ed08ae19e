// SPDX-License-Identifier: Apache-2.0
#include "calibration/bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "calibration/raw_counts.h"

static const int TIMEOUT_MS = 60000;

bool bench_open(struct bench *b, const struct booth_settings *settings, const char *socket,
                const char *booth, struct error *err)
{
    char path[128];
    snprintf(path, sizeof path, "%s", socket ? socket : settings->control.socket);
    *b = (struct bench){.terminal = isatty(STDERR_FILENO)};
    if (!*path && !booth_socket_default(getenv("XDG_RUNTIME_DIR"), path, sizeof path, err))
        return false;
    if (!(b->daemon = control_connect(path, err)) ||
        (booth && !(b->booth = control_connect(booth, err)))) {
        bench_close(b);
        return false;
    }
    b->readings = json_array();
    return true;
}

void bench_close(struct bench *b)
{
    control_close(b->daemon);
    control_close(b->booth);
    json_decref(b->readings);
    json_decref(b->lit);
    *b = (struct bench){0};
}

bool bench_emulated(const struct bench *b)
{
    size_t i;
    json_t *reading;
    bool any = b->booth;
    json_array_foreach(b->readings, i, reading)
        any = any || json_is_true(json_object_get(reading, "emulated"));
    return any;
}

static bool done(json_t *reply)
{
    json_decref(reply);
    return reply;
}

static json_t *daemon_call(struct bench *b, json_t *request, struct error *err)
{
    return control_call(b->daemon, request, TIMEOUT_MS, err);
}

json_t *bench_status(struct bench *b, struct error *err)
{
    return daemon_call(b, json_pack("{ss}", "do", CONTROL_STATUS), err);
}

bool bench_patch(struct bench *b, struct counts c, struct error *err)
{
    return done(daemon_call(b, json_pack("{ss,s[fff]}", "do", CONTROL_PATCH, "rgb", c.r, c.g, c.b), err));
}

bool bench_show(struct bench *b, const char *material, const char *patch, struct error *err)
{
    json_t *request = json_pack("{ss,ss}", "do", CONTROL_SHOW, "material", material);
    if (patch)
        json_object_set_new(request, "patch", json_string(patch));
    return done(daemon_call(b, request, err));
}

static bool take_numbers(const json_t *reply, const char *key, double *out, size_t count,
                         struct error *err)
{
    const json_t *v = json_object_get(reply, key);
    if (json_array_size(v) != count)
        return fail(err, ERROR_DATA, "the reply has no %s", key);
    for (size_t i = 0; i < count; i++) {
        out[i] = json_number_value(json_array_get(v, i));
        if (!isfinite(out[i]))
            return fail(err, ERROR_DATA, "%s is not finite", key);
    }
    return true;
}

static bool take_xyz(const json_t *reply, const char *key, struct xyz *out, struct error *err)
{
    double v[3];
    if (!take_numbers(reply, key, v, 3, err))
        return false;
    *out = (struct xyz){v[0], v[1], v[2]};
    return true;
}

bool bench_measure(struct bench *b, const char *what, struct xyz *xyz, int *index, struct error *err)
{
    json_t *reply = NULL;
    for (int attempt = 0; attempt < 3 && !reply; attempt++) {
        reply = daemon_call(b, json_pack("{ss,sf}", "do", CONTROL_MEASURE, "timeout_s", 50.0), err);
        if (!reply && err->code != ERROR_RETRY)
            break;
    }
    if (!reply)
        return while_doing(err, "measuring %s", what);
    if (!take_xyz(reply, "XYZ", xyz, err)) {
        json_decref(reply);
        return while_doing(err, "measuring %s", what);
    }
    json_object_del(reply, "ok");
    json_object_set_new(reply, "what", json_string(what));
    if (index)
        *index = (int)json_array_size(b->readings);
    json_array_append_new(b->readings, reply);
    return true;
}

bool bench_pixel(struct bench *b, int x_px, int y_px, struct proofed_pixel *out, struct error *err)
{
    json_t *reply =
        daemon_call(b, json_pack("{ss,si,si}", "do", CONTROL_PROBE, "x_px", x_px, "y_px", y_px), err);
    if (!reply)
        return false;
    struct proofed_pixel p = {.lux = json_number_value(json_object_get(reply, "lux")),
                      .in_gamut = json_is_true(json_object_get(reply, "in_gamut"))};
    bool fine = take_xyz(reply, "surface", &p.surface, err) &&
                take_xyz(reply, "emitted", &p.emitted, err) &&
                take_xyz(reply, "sent", &p.sent, err) &&
                take_numbers(reply, "rgb", (double *)&p.counts, 3, err) &&
                take_numbers(reply, "linear", (double *)&p.linear, 3, err) &&
                take_numbers(reply, "gains", p.gains, 4, err);
    json_decref(reply);
    if (fine)
        *out = p;
    return fine || while_doing(err, "probing the screen");
}

bool bench_capture(struct bench *b, const char *path, struct error *err)
{
    return done(daemon_call(b, json_pack("{ss,ss}", "do", CONTROL_CAPTURE, "file", path), err));
}

bool bench_reload(struct bench *b, struct error *err)
{
    return done(daemon_call(b, json_pack("{ss}", "do", CONTROL_RELOAD), err));
}

static bool take_spectrum(const json_t *reply, const char *key, struct spectrum *out,
                          struct error *err)
{
    const json_t *values = json_object_get(reply, key);
    if (json_array_size(values) != SPECTRUM_COUNT)
        return fail(err, ERROR_DATA, "the reply has no %s of %d values", key, SPECTRUM_COUNT);
    for (size_t i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = json_number_value(json_array_get(values, i));
    return true;
}

void bench_instrument(const json_t *reply, char *name, size_t size)
{
    const char *model = json_string_value(json_object_get(reply, "instrument"));
    const char *serial = json_string_value(json_object_get(reply, "serial"));
    snprintf(name, size, "%s %s", model ? model : "unnamed", serial ? serial : "");
}

static json_t *teach_call(struct bench *b, const char *lamp, int readings, struct error *err)
{
    return daemon_call(
        b, json_pack("{ss,ss,si}", "do", CONTROL_TEACH, "lamp", lamp, "readings", readings), err);
}

bool bench_probe(struct bench *b, const char *lamp, int readings, double *lux, struct error *err)
{
    json_t *reply = teach_call(b, lamp, readings, err);
    if (!reply)
        return while_doing(err, "watching lamp %s", lamp);
    *lux = json_number_value(json_object_get(reply, "lux"));
    json_object_del(reply, "ok");
    json_object_del(reply, "nm");
    json_object_del(reply, "irradiance");
    json_object_set_new(reply, "what", json_sprintf("light of %s", lamp));
    json_array_append_new(b->readings, reply);
    return true;
}

bool bench_teach(struct bench *b, const char *lamp, int readings, struct taught *out,
                 struct error *err)
{
    json_t *reply = teach_call(b, lamp, readings, err);
    if (!reply || !take_spectrum(reply, "irradiance", &out->irradiance, err) ||
        !take_spectrum(reply, "sigma", &out->sigma, err)) {
        json_decref(reply);
        return while_doing(err, "teaching lamp %s", lamp);
    }
    out->spread = json_number_value(json_object_get(reply, "spread"));
    out->lux = json_number_value(json_object_get(reply, "lux"));
    bench_instrument(reply, out->instrument, sizeof out->instrument);
    json_object_del(reply, "ok");
    json_object_set_new(reply, "what", json_sprintf("teach %s", lamp));
    json_array_append_new(b->readings, reply);
    return true;
}

// Readings with those that do not count, and a unit that is slow to obey.
static double raw_timeout_s(int integration_us, int readings)
{
    return 20 + (readings + 8) * (integration_us * 1e-6 + 0.05);
}

bool bench_raw(struct bench *b, int integration_us, int readings, struct raw_counts *out,
               struct error *err)
{
    double timeout_s = raw_timeout_s(integration_us, readings);
    json_t *request = json_pack("{ss,si,si,sf}", "do", CONTROL_RAW, "integration_us", integration_us,
                                "readings", readings, "timeout_s", timeout_s);
    json_t *reply = control_call(b->daemon, request, (int)(1000 * timeout_s) + TIMEOUT_MS, err);
    bool fine = reply && raw_counts_of(reply, out, err);
    json_decref(reply);
    return fine || while_doing(err, "raw counts of %d us", integration_us);
}

static bool lamp_is(const json_t *status, const char *lamp)
{
    const json_t *belief = json_object_get(status, "lamp");
    const char *verdict = json_string_value(json_object_get(belief, "verdict"));
    const char *name = json_string_value(json_object_get(belief, "name"));
    if (!verdict)
        return false;
    if (!*lamp)
        return !strcmp(verdict, "none");
    return !strcmp(verdict, "known") && name && !strcmp(name, lamp);
}

bool bench_await_lamp(struct bench *b, const char *lamp, double timeout_s, struct error *err)
{
    int64_t deadline = clock_now_ns() + (int64_t)(timeout_s * 1e9);
    for (;;) {
        json_t *status = bench_status(b, err);
        if (!status)
            return false;
        bool there = lamp_is(status, lamp);
        json_decref(status);
        if (there)
            return true;
        if (clock_now_ns() > deadline)
            return fail(err, ERROR_RETRY, "boothd did not recognise %s within %.0f s",
                        *lamp ? lamp : "the dark booth", timeout_s);
        clock_sleep_until_ns(clock_now_ns() + 50 * NS_PER_MS);
    }
}

// Steals request.
static bool by_hand(struct bench *b, json_t *request, struct error *err, const char *please)
{
    if (b->booth)
        return done(control_call(b->booth, request, TIMEOUT_MS, err));
    json_decref(request);
    fprintf(stderr, "\n%s, then press Enter. ", please);
    for (int c = getchar(); c != '\n'; c = getchar())
        if (c == EOF)
            return fail(err, ERROR_GONE, "nobody answered: %s", please);
    return true;
}

bool bench_lamp(struct bench *b, const char *lamp, struct error *err)
{
    char please[128];
    snprintf(please, sizeof please, "Switch the booth's lamp to: %s", lamp);
    return by_hand(b, json_pack("{ss,ss}", "do", CONTROL_LAMP, "name", lamp), err, please);
}

// All lamps off, remembering which were on.
static bool darken(struct bench *b, struct error *err)
{
    json_t *now = control_call(b->booth, json_pack("{ss}", "do", CONTROL_TRUTH), TIMEOUT_MS, err);
    if (!now)
        return false;
    json_decref(b->lit);
    b->lit = json_incref(json_object_get(now, "levels"));
    json_decref(now);
    return bench_lamp(b, "none", err);
}

static bool relight(struct bench *b, struct error *err)
{
    const char *name;
    json_t *level;
    bool fine = true;
    json_object_foreach(b->lit, name, level)
    {
        double on = json_number_value(level);
        fine = fine && (!(on > 0) || done(control_call(b->booth,
                                                       json_pack("{ss,ss,sf,sb}", "do", CONTROL_LAMP,
                                                                 "name", name, "level", on, "add", 1),
                                                       TIMEOUT_MS, err)));
    }
    json_decref(b->lit);
    b->lit = NULL;
    return fine;
}

bool bench_lid(struct bench *b, bool closed, struct error *err)
{
    if (b->booth)
        return closed ? darken(b, err) : relight(b, err);
    if (closed)
        return by_hand(b, NULL, err, "Close the lid of the spectrometer's diffuser, against all light");
    fprintf(stderr, "Open the lid of the spectrometer's diffuser again.\n");
    return true;
}

bool bench_light(struct bench *b, const char *lamp, const char *what, struct error *err)
{
    char please[160];
    snprintf(please, sizeof please, "Shine %s into the spectrometer", what);
    if (b->booth && !lamp)
        return true;
    return by_hand(b, b->booth ? json_pack("{ss,ss}", "do", CONTROL_LAMP, "name", lamp) : NULL, err,
                   please);
}

bool bench_tilt(struct bench *b, double deg, struct error *err)
{
    char please[128];
    snprintf(please, sizeof please, "Tilt the screen to %.0f degrees", deg);
    return by_hand(b, json_pack("{ss,sf}", "do", CONTROL_TILT, "deg", deg), err, please);
}

bool bench_head(struct bench *b, struct vec3 eye, struct error *err)
{
    char please[128];
    snprintf(please, sizeof please, "Bring your eyes to x %.2f, y %.2f, z %.2f m", eye.x, eye.y, eye.z);
    return by_hand(b, json_pack("{ss,s[fff]}", "do", CONTROL_HEAD, "eye_m", eye.x, eye.y, eye.z), err,
                   please);
}

bool bench_aim_screen(struct bench *b, double x_px, double y_px, struct error *err)
{
    char please[128];
    snprintf(please, sizeof please, "Aim the radiometer at the screen, pixel %.0f, %.0f", x_px, y_px);
    return by_hand(b,
                   json_pack("{ss,ss,sf,sf}", "do", CONTROL_AIM, "target", "screen", "x_px", x_px,
                             "y_px", y_px),
                   err, please);
}

bool bench_aim_screen_from(struct bench *b, double x_px, double y_px, struct vec3 from,
                           struct error *err)
{
    char please[192];
    snprintf(please, sizeof please,
             "Bring the radiometer to x %.3f, y %.3f, z %.3f m and aim it at the screen, pixel %.0f, "
             "%.0f",
             from.x, from.y, from.z, x_px, y_px);
    return by_hand(b,
                   json_pack("{ss,ss,sf,sf,s[fff]}", "do", CONTROL_AIM, "target", "screen", "x_px",
                             x_px, "y_px", y_px, "from_m", from.x, from.y, from.z),
                   err, please);
}

bool bench_aim_ceiling(struct bench *b, double x_m, double z_m, struct error *err)
{
    char please[128];
    snprintf(please, sizeof please, "Aim the radiometer at the ceiling, x %.3f m, z %.3f m", x_m, z_m);
    return by_hand(b,
                   json_pack("{ss,ss,sf,sf}", "do", CONTROL_AIM, "target", "ceiling", "x_m", x_m,
                             "z_m", z_m),
                   err, please);
}

bool bench_place_spectrometer(struct bench *b, const char *where, struct error *err)
{
    char please[128];
    if (b->booth)
        return fail(err, ERROR_CONFIG, "the emulated booth's spectrometer cannot be moved");
    snprintf(please, sizeof please, "Place the spectrometer at %s", where);
    return by_hand(b, NULL, err, please);
}

bool bench_photograph(struct bench *b, const char *folder, struct error *err)
{
    char please[640];
    snprintf(please, sizeof please,
             "Photograph the ceiling at several exposures; put the pictures, list.csv and "
             "camera.ini into %s",
             folder);
    return by_hand(b, json_pack("{ss,ss}", "do", CONTROL_PHOTOGRAPH, "folder", folder), err, please);
}

static json_t *sample_of(const struct spectrum *reflectance)
{
    json_t *nm = json_array(), *values = json_array();
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        json_array_append_new(nm, json_integer(SPECTRUM_FIRST_NM + i));
        json_array_append_new(values, json_real(reflectance->v[i]));
    }
    return json_pack("{so,so}", "nm", nm, "values", values);
}

bool bench_truth(struct bench *b, const struct spectrum *reflectances, int count, struct xyz *out,
                 struct error *err)
{
    for (int i = 0; i < count; i++) {
        json_t *request = json_pack("{ss,so}", "do", CONTROL_TRUTH, "reflectance",
                                    sample_of(&reflectances[i]));
        json_t *reply = control_call(b->booth, request, TIMEOUT_MS, err);
        if (!reply || !take_xyz(reply, "XYZ", &out[i], err)) {
            json_decref(reply);
            return while_doing(err, "asking the emulated booth for a physical sample");
        }
        json_decref(reply);
    }
    return true;
}

static void show_time_left(const struct bench *b, int at, int all)
{
    double each_s = (double)(clock_now_ns() - b->step_ns) / NS_PER_S / (at - b->step_at);
    int left = (int)ceil(each_s * (all - at));
    if (left >= 60)
        fprintf(stderr, ", %d min left", (left + 30) / 60);
    else
        fprintf(stderr, ", %d s left", left);
}

void bench_progress(struct bench *b, const char *step, int at, int all)
{
    if (!b->terminal)
        return;
    if (!b->step || strcmp(b->step, step) || at < b->step_at) {
        b->step = step;
        b->step_ns = clock_now_ns();
        b->step_at = at;
    }
    fprintf(stderr, "\r\033[K%s: %d of %d", step, at, all);
    if (at > b->step_at && at < all)
        show_time_left(b, at, all);
    if (at >= all)
        fputc('\n', stderr);
}
