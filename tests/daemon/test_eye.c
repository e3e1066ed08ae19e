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
static const double REST_SPEED = 0.05; // m/s, as the header says

static struct state_settings preset(int filter)
{
    struct booth_settings booth;
    booth_preset(&booth);
    booth.state.eye_filter = filter;
    return booth.state;
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
        eye_take(&t, &s, (struct vec3){0.1, 0.5, 0.6}, 5 * NS_PER_S);
        struct vec3 at = eye_at(&t, &s, 5 * NS_PER_S + 40 * NS_PER_MS);
        assert_near(at.x, 0.1, EXACT);
        assert_near(at.z, 0.6, EXACT);
        eye_take(&t, &s, (struct vec3){-0.3, 0.5, 0.6}, 7 * NS_PER_S); // long forgotten
        assert_near(eye_at(&t, &s, 7 * NS_PER_S).x, -0.3, EXACT);
    }
}

// Kalata 1984: alpha = 1 - r^2, beta = 2 (2 - alpha) - 4 sqrt(1 - alpha) of the
// tracking index lambda = acceleration T^2 / noise.
static void the_kalman_filter_converges_to_the_published_gains(void **state)
{
    (void)state;
    struct state_settings s = preset(EYE_FILTER_KALMAN);
    struct eye_track t = {0};
    double T = 0.01, lambda = s.eye_acceleration * T * T / s.eye_noise_m;
    double r = (4 + lambda - sqrt(8 * lambda + lambda * lambda)) / 4;
    double alpha = 1 - r * r, beta = 2 * (2 - alpha) - 4 * sqrt(1 - alpha);
    for (int i = 0; i < 1000; i++)
        eye_take(&t, &s, (struct vec3){0, 0, 0.6}, NS_PER_S + i * SAMPLE_NS);
    double variance = s.eye_noise_m * s.eye_noise_m;
    assert_near(t.pp / variance / alpha, 1, CONVERGED);
    assert_near(t.pv * T / variance / beta, 1, CONVERGED);
}

static void constant_speed_is_met_at_photon_time(void **state)
{
    (void)state;
    struct state_settings s = preset(EYE_FILTER_KALMAN);
    struct eye_track t = {0};
    int64_t now = NS_PER_S;
    const double speed = 0.4;
    for (int i = 0; i < 300; i++, now += SAMPLE_NS)
        eye_take(&t, &s, (struct vec3){speed * 1e-9 * (double)now, 0.5, 0.6}, now);
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
            eye_take(&t, &s, (struct vec3){0.1 * i, 0, 0.6}, NS_PER_S + i * SAMPLE_NS); // 10 m/s
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
            eye_take(&t, &s, (struct vec3){0.01 * gauss(&dice), 0, 0.6}, now);
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
        eye_take(&t, &s, (struct vec3){x, 0.5, 0.6}, seen);
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

static void a_resting_head_is_steadier_than_its_samples(void **state)
{
    (void)state;
    assert_true(rms_of(EYE_FILTER_ONE_EURO, 0.03, 0.5, 0) < NOISE_M / 2);
    assert_true(rms_of(EYE_FILTER_KALMAN, 0.03, 0.5, 0) < NOISE_M); // prediction included
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_first_place_counts_as_it_is),
        cmocka_unit_test(the_kalman_filter_converges_to_the_published_gains),
        cmocka_unit_test(constant_speed_is_met_at_photon_time),
        cmocka_unit_test(nothing_is_carried_further_than_50_ms_and_15_cm),
        cmocka_unit_test(equal_and_backward_times_stay_finite),
        cmocka_unit_test(prediction_brings_a_swaying_head_nearer),
        cmocka_unit_test(a_resting_head_is_steadier_than_its_samples),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
