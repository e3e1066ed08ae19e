// SPDX-License-Identifier: Apache-2.0
#include "calibration/bench_pose.h"

#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/lines.h"

enum { MEANS_MOST = 12, OLD = 2, TIMEOUT_MS = 60000 };
static const int64_t SILENT_NS = 20 * NS_PER_S, UNSEEN_NS = 4 * NS_PER_S;
static const int64_t LOOK_EVERY_NS = 20 * NS_PER_MS;
static const double STILL = 3;        // standard deviations of a difference of two means …
static const double STILL_DEG = 0.02; // … and no less: what the sensors resolve
static const double STILL_M = 0.001;

enum { AXES = 4 };

// One reading of a status: up to four numbers.
struct look {
    double v[AXES];
    double believed;
};
typedef bool taker(const json_t *status, struct look *out);

// What is looked at, and how.
struct watch {
    const char *part, *instrument;
    int axes;
    taker *take;
    double still[AXES];
};

struct mean {
    double v[AXES], spread[AXES], believed;
};

static bool numbers(const json_t *array, double v[3])
{
    for (size_t i = 0; i < 3; i++)
        v[i] = json_number_value(json_array_get(array, i));
    return json_array_size(array) == 3;
}

static bool take_tilt(const json_t *tilt, struct look *out)
{
    const json_t *reading = json_object_get(tilt, "reading_deg");
    *out = (struct look){{json_number_value(reading)},
                         json_number_value(json_object_get(tilt, "tilt_deg"))};
    numbers(json_object_get(tilt, "gravity_m_s2"), out->v + 1); // 0 0 0 from one without
    return json_is_number(reading) && json_is_true(json_object_get(tilt, "plausible"));
}

static bool take_eye(const json_t *eye, struct look *out)
{
    *out = (struct look){.believed = 0};
    return numbers(json_object_get(eye, "tracker_m"), out->v);
}

static const struct watch TILT = {
    "tilt", "accelerometer", 4, take_tilt, {STILL_DEG, STILL_M * 10, STILL_M * 10, STILL_M * 10}};
static const struct watch EYE = {"eye", "tracker", 3, take_eye, {STILL_M, STILL_M, STILL_M}};

static bool is_there(const json_t *status, const struct watch *w, struct error *err)
{
    const json_t *instrument =
        json_object_get(json_object_get(status, "instruments"), w->instrument);
    const char *state = json_string_value(json_object_get(instrument, "state"));
    return (state && strcmp(state, "none")) ||
           fail(err, ERROR_GONE, "boothd has no %s", w->instrument);
}

// The next reading that is not number `last`. One that speaks but sees nothing is
// waited for less long than one that is silent.
static bool next_look(struct bench *b, const struct watch *w, json_int_t *last, struct look *out,
                      struct error *err)
{
    int64_t start_ns = clock_now_ns();
    json_int_t first = -1, number = -1;
    while (clock_now_ns() < start_ns + (number != first ? UNSEEN_NS : SILENT_NS)) {
        json_t *status = bench_status(b, err);
        if (!status || !is_there(status, w, err)) {
            json_decref(status);
            return false;
        }
        const json_t *part = json_object_get(status, w->part);
        number = json_integer_value(json_object_get(part, "number"));
        first = first < 0 ? number : first;
        bool fresh = number != *last && w->take(part, out);
        json_decref(status);
        if (fresh) {
            *last = number;
            return true;
        }
        clock_sleep_until_ns(clock_now_ns() + LOOK_EVERY_NS);
    }
    return fail(err, ERROR_RETRY, "the %s %s", w->instrument,
                number != first ? "sees nothing that can be used" : "says nothing");
}

static bool take_mean(struct bench *b, const struct watch *w, int looks, json_int_t *last,
                      struct mean *out, struct error *err)
{
    struct mean m = {{0}, {0}, 0};
    double first[AXES] = {0};
    for (int i = 0; i < looks; i++) {
        struct look l;
        if (!next_look(b, w, last, &l, err))
            return false;
        for (int k = 0; k < w->axes; k++) {
            first[k] = i ? first[k] : l.v[k];
            m.v[k] += (l.v[k] - first[k]) / looks;
            m.spread[k] += (l.v[k] - first[k]) * (l.v[k] - first[k]) / looks;
        }
        m.believed = l.believed;
    }
    for (int k = 0; k < w->axes; k++) {
        m.spread[k] = sqrt(fmax(m.spread[k] - m.v[k] * m.v[k], 0) * looks / fmax(looks - 1, 1));
        m.v[k] += first[k];
    }
    *out = m;
    return true;
}

static bool still(const struct watch *w, const struct mean *a, const struct mean *b, int looks)
{
    for (int k = 0; k < w->axes; k++) {
        double noise = hypot(a->spread[k], b->spread[k]) / sqrt(looks);
        if (!(fabs(a->v[k] - b->v[k]) <= fmax(STILL * noise, w->still[k])))
            return false;
    }
    return true;
}

static bool settled(struct bench *b, const struct watch *w, int looks, struct mean *out,
                    struct error *err)
{
    json_int_t last = -1;
    struct look l;
    struct mean before, now;
    for (int i = 0; i < OLD; i++) // taken before, perhaps
        if (!next_look(b, w, &last, &l, err))
            return false;
    if (!take_mean(b, w, looks, &last, &before, err))
        return false;
    for (int i = 0; i < MEANS_MOST; i++) {
        if (!take_mean(b, w, looks, &last, &now, err))
            return false;
        if (still(w, &before, &now, looks)) {
            *out = now;
            return true;
        }
        before = now;
    }
    return fail(err, ERROR_RETRY, "the %s does not come to rest", w->instrument);
}

bool bench_look_tilt(struct bench *b, int looks, struct tilt_look *out, struct error *err)
{
    struct mean m;
    if (!settled(b, &TILT, looks, &m, err))
        return false;
    struct vec3 gravity = {m.v[1], m.v[2], m.v[3]};
    *out = (struct tilt_look){.reading_deg = m.v[0],
                              .spread_deg = m.spread[0],
                              .has_gravity = vec3_length(gravity) > 0,
                              .gravity = gravity,
                              .believed_deg = m.believed,
                              .looks = looks};
    return true;
}

bool bench_look_eye(struct bench *b, int looks, struct eye_look *out, struct error *err)
{
    struct mean m;
    if (!settled(b, &EYE, looks, &m, err))
        return false;
    *out = (struct eye_look){
        {m.v[0], m.v[1], m.v[2]}, fmax(m.spread[0], fmax(m.spread[1], m.spread[2])), looks};
    return true;
}

// ---- by hand ------------------------------------------------------------------

static bool ask_numbers(const char *please, const char *names, int count, double *v,
                        struct error *err)
{
    struct lines l = {.in = stdin, .name = "standard input"};
    bool end = false, fine = false;
    while (!fine && !end) {
        fprintf(stderr, "\n%s: ", please);
        if (!lines_next(&l, &end, err))
            break;
        fine = line_numbers(l.text, count, names, v, err);
        if (!fine)
            fprintf(stderr, "%s\n", err->text);
    }
    lines_fini(&l);
    return fine || (end && fail(err, ERROR_GONE, "nobody answered: %s", please));
}

bool bench_protractor(struct bench *b, double *deg, struct error *err)
{
    if (!b->booth)
        return ask_numbers("The screen's tilt by the protractor, in degrees (0 lies flat)",
                           "one number, degrees", 1, deg, err);
    json_t *reply =
        control_call(b->booth, json_pack("{ss}", "do", CONTROL_PROTRACTOR), TIMEOUT_MS, err);
    *deg = json_number_value(json_object_get(reply, "deg"));
    json_decref(reply);
    return reply;
}

bool bench_tape(struct bench *b, const char *what, double x_m, double y_m, struct vec3 *at,
                struct error *err)
{
    double v[3];
    char please[160];
    snprintf(please, sizeof please,
             "Place of the screen's %s from the booth's origin, x y z in metres", what);
    if (!b->booth) {
        if (!ask_numbers(please, "three numbers, x y z in metres", 3, v, err))
            return false;
        *at = (struct vec3){v[0], v[1], v[2]};
        return true;
    }
    json_t *reply =
        control_call(b->booth, json_pack("{ss,sf,sf}", "do", CONTROL_TAPE, "x_m", x_m, "y_m", y_m),
                     TIMEOUT_MS, err);
    bool fine = reply && (numbers(json_object_get(reply, "point_m"), v) ||
                          fail(err, ERROR_DATA, "the reply has no point_m"));
    json_decref(reply);
    if (fine)
        *at = (struct vec3){v[0], v[1], v[2]};
    return fine;
}

bool bench_hold(struct bench *b, const char *where, struct vec3 at, struct error *err)
{
    if (b->booth)
        return bench_head(b, at, err);
    fprintf(stderr,
            "\nHold the marker's eye point %s (x %.3f, y %.3f, z %.3f m), then press Enter. ",
            where, at.x, at.y, at.z);
    for (int c = getchar(); c != '\n'; c = getchar())
        if (c == EOF)
            return fail(err, ERROR_GONE, "nobody answered: hold the marker %s", where);
    return true;
}
