// SPDX-License-Identifier: Apache-2.0
#include "daemon/state.h"

#include <math.h>
#include <string.h>

#include "colorimetry/colour.h"

static const double LEVEL_STEP = 0.03; // a dimmer's, far above a reading's noise
static const int LEVEL_STEP_READINGS = 2;
static const double TILT_STEP_DEG = 0.3; // a hand's, far above a resting sensor's noise
static const double EYE_FARTHEST_M = 10;

const char *standing_name(enum standing standing)
{
    switch (standing) {
#define X(name, text)                                                                              \
    case STANDING_##name:                                                                          \
        return text;
        STANDINGS(X)
#undef X
    }
    return "preset";
}

static void limit(struct estimator *e, const struct booth_settings *settings,
                  const struct classifier *taught)
{
    e->limits = settings->state;
    e->booth_from_tracker = booth_from_tracker(settings);
    memcpy(e->turned_deg, settings->accelerometer.turned_deg, sizeof e->turned_deg);
    e->classifier = *taught;
    classifier_reset(&e->classifier);
    e->classifier.dark_lux = settings->state.dark_lux;
    e->classifier.distance = settings->state.lamp_distance;
    e->classifier.confirmations = settings->state.confirmations;
    e->state.lamp.index = -1;
    e->state.lamp.level = 0;
    e->state.lamp.verdict = LAMP_NONE;
    e->lamp = (struct memory){0};
    for (int i = 0; i < taught->count && !booth_spectrometer(settings); i++)
        if (!strcmp(taught->lamps[i].name, settings->lamps.declared)) {
            e->state.lamp.index = i;
            e->state.lamp.level = 1;
            e->state.lamp.verdict = LAMP_KNOWN;
        }
}

void estimator_init(struct estimator *e, const struct booth_settings *settings,
                    const struct classifier *taught)
{
    const double *eye = settings->tracker.default_eye_m;
    *e = (struct estimator){.now_ns = INT64_MIN};
    limit(e, settings, taught);
    e->state.tilt.deg = settings->stand.default_tilt_deg;
    e->state.eye.at = (struct vec3){eye[0], eye[1], eye[2]};
}

static bool finite_spectrum(const struct spectrum *s)
{
    return isfinite(spectrum_sum(s));
}

static bool spectrum_usable(const struct spectrum_sample *s)
{
    switch (s->status) {
    case SPECTROMETER_GOOD:
    case SPECTROMETER_WEAK: // too little light for a spectrum is darkness
        return finite_spectrum(&s->irradiance);
    case SPECTROMETER_SATURATED:
    case SPECTROMETER_SETTLING:
        return false;
    }
    return false;
}

void estimator_change(struct estimator *e, const struct booth_settings *settings,
                      const struct classifier *taught)
{
    const double *eye = settings->tracker.default_eye_m;
    limit(e, settings, taught);
    e->classifier.confirmations = 1;
    if (!e->tilt.ever)
        e->state.tilt.deg = settings->stand.default_tilt_deg;
    if (!e->eye.ever)
        e->state.eye.at = (struct vec3){eye[0], eye[1], eye[2]};
}

static double seconds(int64_t ns)
{
    return (double)ns / NS_PER_S;
}

// True when the sample is new and not older than what is known already; then
// the memory is up to date but for `usable` and what follows from it.
static bool fresh(struct memory *m, uint64_t number, const struct interval *taken)
{
    if (!number || number == m->number)
        return false;
    m->number = number;
    return !m->ever || taken->latest_ns >= m->seen_ns;
}

static void remember(struct memory *m, const struct interval *taken, int64_t now_ns,
                     double confidence)
{
    m->seen_ns = taken->latest_ns < now_ns ? taken->latest_ns : now_ns;
    m->ever = m->usable = true;
    m->confidence = confidence;
}

static void follow_level(struct estimator *e, double level, double dt_s)
{
    double *smooth = &e->state.lamp.level;
    double off = level - *smooth;
    int side = off > LEVEL_STEP * *smooth ? 1 : off < -LEVEL_STEP * *smooth ? -1 : 0;
    e->level_steps = side * e->level_steps > 0 ? e->level_steps + side : side;
    if (side * e->level_steps >= LEVEL_STEP_READINGS)
        e->level_readings = e->level_steps = 0;
    double mean = 1.0 / ++e->level_readings;
    double smoothing = e->limits.level_s > 0 ? -expm1(-dt_s / e->limits.level_s) : 1;
    *smooth += off * fmax(mean, smoothing);
}

// While another verdict waits for its confirmation, a reading speaks neither
// for the lamp that was on nor for its level.
static bool verdict_in_doubt(const struct classifier *c)
{
    return c->candidate_count > 0;
}

static void take_lamp(struct estimator *e, const struct spectrum_sample *s, int64_t now_ns)
{
    struct lamp_belief b = classifier_update(&e->classifier, &s->irradiance);
    e->classifier.confirmations = e->limits.confirmations;
    e->state.lamp.verdict = b.verdict;
    e->state.lamp.distance = b.distance;
    e->state.lamp.lux = xyz_absolute(&s->irradiance, OBSERVER_1931_2).Y;
    double dt_s = e->lamp.ever ? seconds(s->taken.latest_ns - e->lamp.seen_ns) : 0;
    e->lamp.usable = b.verdict != LAMP_UNKNOWN && !verdict_in_doubt(&e->classifier);
    if (!e->lamp.usable)
        return;
    if (b.verdict == LAMP_NONE) {
        e->state.lamp.index = -1;
        e->state.lamp.level = 0;
    } else {
        if (b.index != e->state.lamp.index)
            e->level_readings = e->level_steps = 0;
        follow_level(e, b.level, fmax(dt_s, 0.001));
        e->state.lamp.index = b.index;
    }
    remember(&e->lamp, &s->taken, now_ns, b.confidence);
}

static void take_spectrum(struct estimator *e, const struct samples *seen, int64_t now_ns)
{
    if (!fresh(&e->lamp, seen->spectrum_number, &seen->spectrum.taken))
        return;
    if (spectrum_usable(&seen->spectrum))
        take_lamp(e, &seen->spectrum, now_ns);
    else
        e->lamp.usable = false;
}

static double turn(double deg)
{
    return deg - 360 * rint(deg / 360);
}

static void take_tilt(struct estimator *e, const struct samples *seen, int64_t now_ns)
{
    const struct tilt_sample *t = &seen->tilt;
    if (!fresh(&e->tilt, seen->tilt_number, &t->taken))
        return;
    if (!t->plausible || !isfinite(t->tilt_deg)) {
        e->tilt.usable = false;
        return;
    }
    double off = turn(tilt_of_turned(t->tilt_deg, e->turned_deg) - e->state.tilt.deg);
    double dt_s = fmin(fmax(seconds(t->taken.latest_ns - e->tilt.seen_ns), 0.001), 0.1);
    bool rests = e->tilt.ever && fabs(off) < TILT_STEP_DEG && e->limits.tilt_s > 0;
    double share = rests ? -expm1(-dt_s / e->limits.tilt_s) : 1;
    e->state.tilt.deg = turn(e->state.tilt.deg + share * off);
    remember(&e->tilt, &t->taken, now_ns, 1);
}

static int64_t middle(const struct interval *taken)
{
    return taken->earliest_ns + (taken->latest_ns - taken->earliest_ns) / 2;
}

static void take_head(struct estimator *e, const struct samples *seen, int64_t now_ns)
{
    const struct head_sample *h = &seen->head;
    if (!fresh(&e->eye, seen->head_number, &h->taken))
        return;
    struct vec3 at = rigid_apply(e->booth_from_tracker, h->eye);
    double far = vec3_length(at);
    if (h->status != TRACKER_SEEN || !isfinite(far) || far > EYE_FARTHEST_M) {
        e->eye.usable = false;
        return;
    }
    struct vec3 sight = vec3_sub(at, e->booth_from_tracker.translation);
    eye_take(&e->track, &e->limits, at, sight, middle(&h->taken));
    double px = isfinite(h->reprojection_px) ? h->reprojection_px : INFINITY;
    remember(&e->eye, &h->taken, now_ns, 1 / (1 + px * px));
}

static struct belief believe(const struct memory *m, double hold_s, int64_t now_ns)
{
    if (!m->ever)
        return (struct belief){.standing = STANDING_PRESET};
    int64_t age_ns = now_ns - m->seen_ns;
    double age_s = seconds(age_ns);
    bool old = age_s > hold_s;
    return (struct belief){old         ? STANDING_STALE
                           : m->usable ? STANDING_FRESH
                                       : STANDING_HELD,
                           age_ns, m->confidence * (old ? hold_s / age_s : 1)};
}

static void clock_went_back(struct memory *m, int64_t now_ns)
{
    if (m->seen_ns > now_ns)
        m->seen_ns = now_ns;
}

struct state estimate(struct estimator *e, const struct samples *seen, int64_t now_ns)
{
    if (now_ns < e->now_ns) {
        clock_went_back(&e->lamp, now_ns);
        clock_went_back(&e->tilt, now_ns);
        clock_went_back(&e->eye, now_ns);
    }
    e->now_ns = now_ns;
    take_spectrum(e, seen, now_ns);
    take_tilt(e, seen, now_ns);
    take_head(e, seen, now_ns);
    if (e->track.known)
        e->state.eye.at =
            eye_at(&e->track, &e->limits, now_ns + (int64_t)(e->limits.eye_ahead_s * NS_PER_S));
    e->state.lamp.belief = believe(&e->lamp, e->limits.lamp_hold_s, now_ns);
    e->state.tilt.belief = believe(&e->tilt, e->limits.tilt_hold_s, now_ns);
    e->state.eye.belief = believe(&e->eye, e->limits.eye_hold_s, now_ns);
    if (e->state.lamp.verdict == LAMP_UNKNOWN && e->state.lamp.belief.standing != STANDING_HELD) {
        e->state.lamp.index = -1;
        e->state.lamp.level = 0;
    }
    return e->state;
}
