// SPDX-License-Identifier: Apache-2.0
// Smoothing and prediction of the eye on an injected clock.
#include "tests/fakes/support.h"

#include "base/clock.h"
#include "daemon/eye.h"

static const double EXACT = 1e-12;
static const double CONVERGED = 1e-6; // relative, of a filter's gains after 10 s
static const int64_t SAMPLE_NS = 10 * NS_PER_MS;
static const int64_t LATENCY_NS = 15 * NS_PER_MS; // from the middle of an exposure to its sample
static const double NOISE_M = 0.002;
// Of the emulated camera at arm's length: across, up and along its line of sight.
static const double CAMERA_M[3] = {0.001, 0.002, 0.007};
static const double SEEN_M = 0.0008;   // twice a pixel: a mirror image moves less than half as far
static const double REST_SPEED = 0.05; // m/s, as the header says
static const double RESTING = 0.1;     // share of the acceleration, as the header says

static struct state_settings preset(int filter)
{
    struct booth_settings booth;
    booth_preset(&booth);
    booth.state.eye_filter = filter;
    return booth.state;
}

// The tracker looks along z.
static void take(struct eye_track *t, const struct state_settings *s, struct vec3 at, int64_t now)
{
    eye_take(t, s, at, (struct vec3){0, 0, 2}, now);
}

static double gauss(unsigned *dice)
{
    double sum = 0;
    for (int i = 0; i < 12; i++) {
        *dice = *dice * 1664525 + 1013904223;
        sum += *dice / 4294967296.0;
    }
    return sum - 6;
}

static void the_first_place_counts_as_it_is(void **state)
{
    (void)state;
    for (int filter = EYE_FILTER_NONE; filter <= EYE_FILTER_KALMAN; filter++) {
        struct state_settings s = preset(filter);
        struct eye_track t = {0};
        take(&t, &s, (struct vec3){0.1, 0.5, 0.6}, 5 * NS_PER_S);
        struct vec3 at = eye_at(&t, &s, 5 * NS_PER_S + 40 * NS_PER_MS);
        assert_near(at.x, 0.1, EXACT);
        assert_near(at.z, 0.6, EXACT);
        take(&t, &s, (struct vec3){-0.3, 0.5, 0.6}, 7 * NS_PER_S); // long forgotten
        assert_near(eye_at(&t, &s, 7 * NS_PER_S).x, -0.3, EXACT);
    }
}

// Kalata 1984: alpha = 1 - r^2, beta = 2 (2 - alpha) - 4 sqrt(1 - alpha) of the
// tracking index lambda = acceleration T^2 / noise.
static void check_gains(const struct eye_spread *k, double acceleration, double noise)
{
    double T = 0.01, lambda = RESTING * acceleration * T * T / noise;
    double r = (4 + lambda - sqrt(8 * lambda + lambda * lambda)) / 4;
    double alpha = 1 - r * r, beta = 2 * (2 - alpha) - 4 * sqrt(1 - alpha);
    assert_near(k->pp / (noise * noise) / alpha, 1, CONVERGED);
    assert_near(k->pv * T / (noise * noise) / beta, 1, CONVERGED);
}

static void the_kalman_filter_converges_to_the_published_gains(void **state)
{
    (void)state;
    struct state_settings s = preset(EYE_FILTER_KALMAN);
    struct eye_track t = {0};
    for (int i = 0; i < 1000; i++)
        take(&t, &s, (struct vec3){0, 0, 0.6}, NS_PER_S + i * SAMPLE_NS);
    check_gains(&t.across, s.eye_acceleration, s.eye_noise_m);
    check_gains(&t.along, s.eye_acceleration, s.eye_depth_noise_m);
}

// One place that is off by the same along and across the line of sight, however it lies.
static void depth_is_believed_less_than_what_lies_across(void **state)
{
    (void)state;
    static const struct vec3 sights[] = {{0, 0, 1}, {1, 0, 0}, {0, 0.6, 0.8}, {0, 0, 0}};
    struct state_settings s = preset(EYE_FILTER_KALMAN);
    for (int i = 0; i < 4; i++) {
        struct eye_track t = {0};
        for (int k = 0; k < 300; k++)
            eye_take(&t, &s, (struct vec3){0, 0, 0}, sights[i], NS_PER_S + k * SAMPLE_NS);
        struct vec3 off = vec3_add(vec3_scale(sights[i], 0.01),
                                   (struct vec3){0, 0.01 * sights[i].z, -0.01 * sights[i].y});
        if (i == 3)
            off = (struct vec3){0, 0, 0.01};
        eye_take(&t, &s, off, sights[i], NS_PER_S + 300 * SAMPLE_NS);
        double deep = vec3_dot(t.at, sights[i]);
        struct vec3 wide = vec3_sub(t.at, vec3_scale(sights[i], deep));
        if (i == 1) // nothing lies across
            assert_near(vec3_length(wide), 0, EXACT);
        else if (i == 3) // unknown: all counts as lying across
            assert_true(t.at.z > 0.0015);
        else
            assert_true(deep > 0.0002 && vec3_length(wide) > 1.5 * deep);
    }
}

static void constant_speed_is_met_at_photon_time(void **state)
{
    (void)state;
    struct state_settings s = preset(EYE_FILTER_KALMAN);
    struct eye_track t = {0};
    int64_t now = NS_PER_S;
    const double speed = 0.4;
    for (int i = 0; i < 300; i++, now += SAMPLE_NS)
        take(&t, &s, (struct vec3){speed * 1e-9 * (double)now, 0.5, 0.6}, now);
    int64_t photon = t.seen_ns + 40 * NS_PER_MS;
    double late = speed * 1e-9 * (double)photon - eye_at(&t, &s, photon).x;
    assert_near(late, REST_SPEED * 0.04, 1e-6);
}

static void nothing_is_carried_further_than_50_ms_and_15_cm(void **state)
{
    (void)state;
    for (int filter = EYE_FILTER_NONE; filter <= EYE_FILTER_KALMAN; filter++) {
        struct state_settings s = preset(filter);
        struct eye_track t = {0};
        for (int i = 0; i < 100; i++)
            take(&t, &s, (struct vec3){0.1 * i, 0, 0.6}, NS_PER_S + i * SAMPLE_NS); // 10 m/s
        struct vec3 soon = eye_at(&t, &s, t.seen_ns + 50 * NS_PER_MS);
        struct vec3 late = eye_at(&t, &s, t.seen_ns + 10 * NS_PER_S);
        assert_near(soon.x, late.x, EXACT);
        assert_true(late.x - t.at.x > 0.1 && late.x - t.at.x <= 0.15 + EXACT);
        assert_near(eye_at(&t, &s, t.seen_ns - NS_PER_S).x, t.at.x, EXACT);
        s.eye_ahead_s = 0;
        assert_near(eye_at(&t, &s, t.seen_ns + 50 * NS_PER_MS).x, t.at.x, EXACT);
    }
}

static void equal_and_backward_times_stay_finite(void **state)
{
    (void)state;
    for (int filter = EYE_FILTER_NONE; filter <= EYE_FILTER_KALMAN; filter++) {
        struct state_settings s = preset(filter);
        struct eye_track t = {0};
        unsigned dice = 3;
        int64_t now = NS_PER_S;
        for (int i = 0; i < 2000; i++) {
            now += (int64_t)(gauss(&dice) * 5e6); // hither and thither
            if (i % 5 == 0)
                now = t.seen_ns;
            take(&t, &s, (struct vec3){0.01 * gauss(&dice), 0, 0.6}, now);
            struct vec3 at = eye_at(&t, &s, now + 30 * NS_PER_MS);
            assert_true(fabs(at.x) < 0.3 && fabs(at.z - 0.6) < EXACT);
        }
    }
}

// Root mean square distance between where the eye is believed and where it is
// when the light comes; swaying at hz over +-reach_m, samples at 100 Hz, one
// frame after each.
static double rms_of(int filter, double ahead_s, double hz, double reach_m)
{
    struct state_settings s = preset(filter);
    struct eye_track t = {0};
    unsigned dice = 11;
    double squares = 0;
    int count = 0;
    s.eye_ahead_s = ahead_s;
    for (int i = 0; i < 2000; i++) {
        int64_t seen = NS_PER_S + i * SAMPLE_NS, photon = seen + LATENCY_NS + 30 * NS_PER_MS;
        double omega = 2 * acos(-1) * hz * 1e-9;
        double x = reach_m * sin(omega * (double)seen) + NOISE_M * gauss(&dice);
        take(&t, &s, (struct vec3){x, 0.5, 0.6}, seen);
        double off = eye_at(&t, &s, photon).x - reach_m * sin(omega * (double)photon);
        squares += i < 100 ? 0 : off * off;
        count += i >= 100;
    }
    return sqrt(squares / count);
}

static void prediction_brings_a_swaying_head_nearer(void **state)
{
    (void)state;
    static const struct {
        double hz, reach_m, share; // of the error without a filter that may be left
    } sways[] = {{0.5, 0.2, 0.5}, {1, 0.1, 0.5}, {2, 0.05, 0.85}};
    for (int i = 0; i < 3; i++) {
        double hz = sways[i].hz, reach = sways[i].reach_m;
        double before = rms_of(EYE_FILTER_NONE, 0, hz, reach);
        double euro = rms_of(EYE_FILTER_ONE_EURO, 0.03, hz, reach);
        double euro_still = rms_of(EYE_FILTER_ONE_EURO, 0, hz, reach);
        double kalman = rms_of(EYE_FILTER_KALMAN, 0.03, hz, reach);
        print_message(
            "%.1f Hz +-%.0f cm: as seen %.1f mm, one-euro %.1f (%.1f without prediction), "
            "kalman %.1f\n",
            hz, 100 * reach, 1000 * before, 1000 * euro, 1000 * euro_still, 1000 * kalman);
        assert_true(euro < euro_still);
        assert_true(kalman < before * sways[i].share);
    }
}

struct rest {
    double rms[3], jitter[3]; // x, y, z; from one frame at 50 Hz to the next
};

// At rest with the noise of the emulated camera, prediction included.
static struct rest rest_of(int filter)
{
    struct state_settings s = preset(filter);
    struct eye_track t = {0};
    struct rest r = {{0}, {0}};
    double last[3] = {0};
    unsigned dice = 11;
    int count = 0;
    for (int i = 0; i < 4000; i++) {
        int64_t seen = NS_PER_S + i * SAMPLE_NS;
        struct vec3 at = {CAMERA_M[0] * gauss(&dice), CAMERA_M[1] * gauss(&dice),
                          CAMERA_M[2] * gauss(&dice)};
        take(&t, &s, at, seen);
        struct vec3 p = eye_at(&t, &s, seen + LATENCY_NS + 30 * NS_PER_MS);
        const double now[] = {p.x, p.y, p.z};
        if (i < 300 || i % 2)
            continue;
        for (int k = 0; k < 3; k++) {
            r.rms[k] += now[k] * now[k];
            r.jitter[k] += count ? pow(now[k] - last[k], 2) : 0;
            last[k] = now[k];
        }
        count++;
    }
    for (int k = 0; k < 3; k++) {
        r.rms[k] = sqrt(r.rms[k] / count);
        r.jitter[k] = sqrt(r.jitter[k] / (count - 1));
    }
    return r;
}

static void a_resting_head_is_steadier_than_its_samples(void **state)
{
    (void)state;
    static const char *const names[] = {"none", "one-euro", "kalman"};
    struct rest r[3];
    for (int filter = EYE_FILTER_NONE; filter <= EYE_FILTER_KALMAN; filter++) {
        r[filter] = rest_of(filter);
        print_message("at rest, %s: %.2f %.2f %.2f mm rms, %.2f %.2f %.2f mm from frame to frame\n",
                      names[filter], 1000 * r[filter].rms[0], 1000 * r[filter].rms[1],
                      1000 * r[filter].rms[2], 1000 * r[filter].jitter[0],
                      1000 * r[filter].jitter[1], 1000 * r[filter].jitter[2]);
    }
    for (int k = 0; k < 3; k++) {
        assert_true(r[EYE_FILTER_ONE_EURO].rms[k] < CAMERA_M[k] / 2 + EXACT);
        assert_true(r[EYE_FILTER_KALMAN].rms[k] < CAMERA_M[k] / 2 + EXACT);
    }
    assert_true(r[EYE_FILTER_KALMAN].jitter[0] < SEEN_M);
    assert_true(r[EYE_FILTER_KALMAN].jitter[1] < SEEN_M);
}

static void a_head_that_begins_to_move_is_caught_up_with(void **state)
{
    (void)state;
    double worst[3] = {0};
    for (int filter = EYE_FILTER_NONE; filter <= EYE_FILTER_KALMAN; filter++) {
        struct state_settings s = preset(filter);
        struct eye_track t = {0};
        unsigned dice = 2;
        for (int i = 0; i < 400; i++) { // at rest for 3 s, then off with 3 m/s2 to 0.6 m/s
            double since = 0.01 * (i - 300), x = 0, begun = fmin(since, 0.2);
            int64_t seen = NS_PER_S + i * SAMPLE_NS;
            if (since > 0)
                x = 1.5 * begun * begun + 0.6 * (since - begun);
            double off = x - eye_at(&t, &s, seen).x;
            if (since > 0.3) // and now it should be there
                worst[filter] = fmax(worst[filter], fabs(off));
            take(&t, &s, (struct vec3){x + NOISE_M * gauss(&dice), 0.5, 0.6}, seen);
        }
    }
    print_message("0.3 s after a start: one-euro %.1f mm off, kalman %.1f mm\n",
                  1000 * worst[EYE_FILTER_ONE_EURO], 1000 * worst[EYE_FILTER_KALMAN]);
    assert_true(worst[EYE_FILTER_KALMAN] < worst[EYE_FILTER_ONE_EURO] / 2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_first_place_counts_as_it_is),
        cmocka_unit_test(the_kalman_filter_converges_to_the_published_gains),
        cmocka_unit_test(depth_is_believed_less_than_what_lies_across),
        cmocka_unit_test(constant_speed_is_met_at_photon_time),
        cmocka_unit_test(nothing_is_carried_further_than_50_ms_and_15_cm),
        cmocka_unit_test(equal_and_backward_times_stay_finite),
        cmocka_unit_test(prediction_brings_a_swaying_head_nearer),
        cmocka_unit_test(a_resting_head_is_steadier_than_its_samples),
        cmocka_unit_test(a_head_that_begins_to_move_is_caught_up_with),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
