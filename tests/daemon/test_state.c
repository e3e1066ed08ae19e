// SPDX-License-Identifier: Apache-2.0
// The state estimator on an injected clock.
#include "tests/fakes/support.h"

#include "colorimetry/colour.h"
#include "colorimetry/illuminant.h"
#include "daemon/state.h"

enum { A, D50, D65, LAMPS };

static const double TAUGHT_LUX = 1500;
static const int64_t READING_NS = 200 * NS_PER_MS; // five a second, as the spectrometer gives
static const double EXACT = 1e-9;                  // pure arithmetic in double

struct world {
    struct booth_settings settings;
    struct classifier taught;
    struct spectrum lamps[LAMPS];
    struct estimator e;
    struct samples seen;
    struct state state;
    int64_t now_ns;
    uint64_t dice;
};

static double uniform(struct world *w)
{
    w->dice = w->dice * 6364136223846793005u + 1442695040888963407u;
    return (double)(w->dice >> 11) / 9007199254740992.0;
}

static double gauss(struct world *w)
{
    double sum = -6;
    for (int i = 0; i < 12; i++)
        sum += uniform(w);
    return sum;
}

static void lamp_at(const char *name, double lux, struct spectrum *out)
{
    assert_true(illuminant(name, out, NULL));
    spectrum_scale(out, lux / xyz_absolute(out, OBSERVER_1931_2).Y);
}

static int open_world(void **state)
{
    static const char *const names[LAMPS] = {"A", "FL8", "FL3.15"};
    static const char *const called[LAMPS] = {"A", "D50", "D65"};
    struct world *w = calloc(1, sizeof *w);
    booth_preset(&w->settings);
    w->taught.count = LAMPS;
    for (int i = 0; i < LAMPS; i++) {
        lamp_at(names[i], TAUGHT_LUX, &w->lamps[i]);
        w->taught.lamps[i].irradiance = w->lamps[i];
        w->taught.lamps[i].spread = 0.002;
        snprintf(w->taught.lamps[i].name, sizeof w->taught.lamps[i].name, "%s", called[i]);
    }
    w->now_ns = 1000 * NS_PER_S;
    w->dice = 7;
    estimator_init(&w->e, &w->settings, &w->taught);
    *state = w;
    return 0;
}

static int close_world(void **state)
{
    free(*state);
    return 0;
}

static struct interval just_now(const struct world *w)
{
    return (struct interval){w->now_ns - 20 * NS_PER_MS, w->now_ns};
}

static struct state pass(struct world *w, int64_t ns)
{
    w->now_ns += ns;
    return w->state = estimate(&w->e, &w->seen, w->now_ns);
}

static struct state read_light(struct world *w, const struct spectrum *light, double level)
{
    w->now_ns += READING_NS;
    w->seen.spectrum_number++;
    w->seen.spectrum = (struct spectrum_sample){
        .taken = just_now(w), .status = SPECTROMETER_GOOD, .averaged = 1, .irradiance = *light};
    spectrum_scale(&w->seen.spectrum.irradiance, level);
    return pass(w, 0);
}

static struct state read_noisy(struct world *w, int lamp, double level, double noise)
{
    return read_light(w, &w->lamps[lamp], level * (1 + noise * gauss(w)));
}

static struct state read_tilt(struct world *w, double deg, bool plausible)
{
    w->now_ns += 50 * NS_PER_MS;
    w->seen.tilt_number++;
    w->seen.tilt =
        (struct tilt_sample){.taken = just_now(w), .tilt_deg = deg, .plausible = plausible};
    return pass(w, 0);
}

static struct state read_head(struct world *w, struct vec3 eye, enum tracker_status status)
{
    w->now_ns += 10 * NS_PER_MS;
    w->seen.head_number++;
    w->seen.head =
        (struct head_sample){.taken = just_now(w), .status = status, .eye = eye, .markers = 3};
    return pass(w, 0);
}

static void nothing_seen_gives_the_presets_without_confidence(void **state)
{
    struct state s = pass(*state, 0);
    assert_int_equal(s.lamp.index, -1);
    assert_int_equal(s.lamp.belief.standing, STANDING_PRESET);
    assert_int_equal(s.tilt.belief.standing, STANDING_PRESET);
    assert_near(s.tilt.deg, 30, EXACT);
    assert_near(s.eye.at.y, 0.55, EXACT);
    assert_near(s.lamp.belief.confidence + s.tilt.belief.confidence + s.eye.belief.confidence, 0,
                EXACT);
}

static void a_lamp_is_believed_at_its_second_reading_and_not_before(void **state)
{
    struct world *w = *state;
    assert_int_equal(read_light(w, &w->lamps[D65], 1).lamp.index, -1);
    struct state s = read_light(w, &w->lamps[D65], 1);
    assert_int_equal(s.lamp.index, D65);
    assert_int_equal(s.lamp.verdict, LAMP_KNOWN);
    assert_int_equal(s.lamp.belief.standing, STANDING_FRESH);
    assert_near(s.lamp.level, 1, EXACT);
    assert_near(s.lamp.lux, TAUGHT_LUX, 1e-6 * TAUGHT_LUX);
    assert_true(s.lamp.belief.confidence > 0.9);
}

static void a_switched_lamp_takes_two_readings_and_its_level_is_its_own(void **state)
{
    struct world *w = *state;
    for (int i = 0; i < 10; i++)
        read_light(w, &w->lamps[A], 1);
    struct state between = read_light(w, &w->lamps[D50], 0.4);
    assert_int_equal(between.lamp.index, A);
    assert_near(between.lamp.level, 1, EXACT); // the other lamp's light is not A dimmed
    struct state after = read_light(w, &w->lamps[D50], 0.4);
    assert_int_equal(after.lamp.index, D50);
    assert_near(after.lamp.level, 0.4, EXACT);
}

static void a_sample_looked_at_twice_counts_once(void **state)
{
    struct world *w = *state;
    read_light(w, &w->lamps[A], 1);
    for (int i = 0; i < 50; i++)
        assert_int_equal(pass(w, NS_PER_MS).lamp.index, -1);
}

static void noise_of_readings_hardly_moves_the_level(void **state)
{
    struct world *w = *state;
    const double noise = 0.005;
    for (int i = 0; i < 50; i++)
        read_noisy(w, D65, 1, noise);
    double sum = 0, squares = 0, step = 0, before = w->state.lamp.level;
    for (int i = 0; i < 500; i++) {
        double level = read_noisy(w, D65, 1, noise).lamp.level;
        sum += level;
        squares += (level - 1) * (level - 1);
        step = fmax(step, fabs(level - before));
        before = level;
    }
    assert_near(sum / 500, 1, 0.001);
    assert_true(sqrt(squares / 500) < noise / 3); // smoothed over ten readings
    assert_true(step < noise / 2);                // never jumpy
}

static void a_dimmed_lamp_stays_itself_and_its_level_is_right_after_two_readings(void **state)
{
    struct world *w = *state;
    for (int i = 0; i < 20; i++)
        read_light(w, &w->lamps[D50], 1);
    read_light(w, &w->lamps[D50], 0.5);
    struct state s = read_light(w, &w->lamps[D50], 0.5);
    assert_int_equal(s.lamp.index, D50);
    assert_near(s.lamp.level, 0.5, EXACT);
}

static void one_odd_reading_moves_the_level_by_a_tenth_of_it_at_most(void **state)
{
    struct world *w = *state;
    for (int i = 0; i < 30; i++)
        read_light(w, &w->lamps[D50], 1);
    struct state s = read_light(w, &w->lamps[D50], 1.4);
    assert_true(fabs(s.lamp.level - 1) < 0.1 * 0.4);
}

static void darkness_is_a_lamp_of_its_own(void **state)
{
    struct world *w = *state;
    struct spectrum dark = {{0}};
    read_light(w, &w->lamps[A], 1);
    read_light(w, &w->lamps[A], 1);
    read_light(w, &dark, 1);
    struct state s = read_light(w, &dark, 1);
    assert_int_equal(s.lamp.verdict, LAMP_NONE);
    assert_int_equal(s.lamp.index, -1);
    assert_int_equal(s.lamp.belief.standing, STANDING_FRESH);
}

static void too_weak_a_reading_is_darkness_and_a_saturated_one_is_nothing(void **state)
{
    struct world *w = *state;
    struct spectrum dark = {{0}};
    read_light(w, &w->lamps[A], 1);
    read_light(w, &w->lamps[A], 1);
    for (int i = 0; i < 3; i++) {
        read_light(w, &dark, 1);
        w->seen.spectrum_number++;
        w->seen.spectrum.status = SPECTROMETER_SATURATED;
        w->seen.spectrum.irradiance = w->lamps[D65];
        pass(w, 0);
    }
    assert_int_equal(w->state.lamp.index, -1);
    assert_int_equal(w->state.lamp.belief.standing, STANDING_HELD); // the newest was saturated
}

static void unknown_light_holds_the_lamp_for_its_hold_time_then_gives_none(void **state)
{
    struct world *w = *state;
    struct spectrum mixed = w->lamps[A];
    read_light(w, &w->lamps[D65], 0.9);
    read_light(w, &w->lamps[D65], 0.9);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        mixed.v[i] += w->lamps[D65].v[i];
    int64_t changed_ns = w->now_ns;
    while (w->now_ns - changed_ns <= (int64_t)(w->settings.state.lamp_hold_s * NS_PER_S)) {
        assert_int_equal(w->state.lamp.index, D65);
        read_light(w, &mixed, 1);
    }
    assert_int_equal(w->state.lamp.verdict, LAMP_UNKNOWN);
    assert_int_equal(w->state.lamp.index, -1);
    read_light(w, &w->lamps[D65], 0.9);
    assert_int_equal(read_light(w, &w->lamps[D65], 0.9).lamp.index, D65);
    assert_near(w->state.lamp.level, 0.9, EXACT);
}

static void a_silent_spectrometer_leaves_the_lamp_and_says_how_old_it_is(void **state)
{
    struct world *w = *state;
    read_light(w, &w->lamps[D65], 1);
    read_light(w, &w->lamps[D65], 1);
    double sure = w->state.lamp.belief.confidence;
    struct state s = pass(w, 9 * NS_PER_S);
    assert_int_equal(s.lamp.belief.standing, STANDING_FRESH);
    assert_int_equal(s.lamp.belief.age_ns, 9 * NS_PER_S);
    assert_near(s.lamp.belief.confidence, sure, EXACT);
    s = pass(w, 3600 * NS_PER_S);
    assert_int_equal(s.lamp.index, D65);
    assert_int_equal(s.lamp.belief.standing, STANDING_STALE);
    assert_near(s.lamp.belief.confidence, sure * 10 / 3609, EXACT);
    s = read_light(w, &w->lamps[D65], 1);
    assert_int_equal(s.lamp.belief.standing, STANDING_FRESH);
}

static void a_resting_tilt_is_smoothed_and_a_moved_one_followed_at_once(void **state)
{
    struct world *w = *state;
    const double noise = 0.02;
    assert_near(read_tilt(w, 29.5, true).tilt.deg, 29.5, EXACT);
    for (int i = 0; i < 40; i++)
        read_tilt(w, 29.5 + noise * gauss(w), true);
    double squares = 0;
    for (int i = 0; i < 400; i++)
        squares += pow(read_tilt(w, 29.5 + noise * gauss(w), true).tilt.deg - 29.5, 2);
    assert_true(sqrt(squares / 400) < noise / 2); // 0.2 s at 20 readings a second
    assert_near(read_tilt(w, 45, true).tilt.deg, 45, EXACT);
}

static void a_slow_creep_of_the_tilt_is_followed(void **state)
{
    struct world *w = *state;
    for (int i = 0; i <= 200; i++)
        read_tilt(w, 20 + 0.01 * i, true);                // 0.2 degrees a second
    assert_near(w->state.tilt.deg, 22, 0.2 * 0.2 + 0.01); // behind by one time constant
}

static void an_implausible_tilt_is_passed_over(void **state)
{
    struct world *w = *state;
    read_tilt(w, 20, true);
    assert_near(read_tilt(w, 70, false).tilt.deg, 20, EXACT);
    assert_int_equal(w->state.tilt.belief.standing, STANDING_HELD);
    assert_near(read_tilt(w, NAN, true).tilt.deg, 20, EXACT);
    pass(w, 3 * NS_PER_S);
    assert_int_equal(w->state.tilt.belief.standing, STANDING_STALE);
    assert_near(w->state.tilt.deg, 20, EXACT);
    assert_int_equal(read_tilt(w, 21, true).tilt.belief.standing, STANDING_FRESH);
}

static void tilts_on_both_sides_of_the_half_turn_are_neighbours(void **state)
{
    struct world *w = *state;
    read_tilt(w, 179.9, true);
    double deg = read_tilt(w, -179.9, true).tilt.deg;
    assert_true(fabs(deg) > 179.8);
}

static void the_eye_is_placed_in_the_booth_and_held_while_lost(void **state)
{
    struct world *w = *state;
    w->settings.tracker.place_m[1] = 0.35;
    w->settings.tracker.place_m[2] = -0.20;
    w->settings.tracker.pitch_deg = 10;
    estimator_init(&w->e, &w->settings, &w->taught);
    struct state s = read_head(w, (struct vec3){0.05, 0, 0.8}, TRACKER_SEEN);
    double up = 10 * acos(-1) / 180;
    assert_near(s.eye.at.x, 0.05, EXACT);
    assert_near(s.eye.at.y, 0.35 + 0.8 * sin(up), EXACT);
    assert_near(s.eye.at.z, -0.20 + 0.8 * cos(up), EXACT);
    struct vec3 held = s.eye.at;
    s = read_head(w, (struct vec3){0.5, 0.5, 0.5}, TRACKER_AMBIGUOUS);
    assert_int_equal(s.eye.belief.standing, STANDING_HELD);
    s = pass(w, NS_PER_S);
    assert_int_equal(s.eye.belief.standing, STANDING_STALE);
    assert_near(vec3_length(vec3_sub(s.eye.at, held)), 0, EXACT);
    s = read_head(w, (struct vec3){NAN, 0, 1}, TRACKER_SEEN);
    assert_near(vec3_length(vec3_sub(s.eye.at, held)), 0, EXACT);
    s = read_head(w, (struct vec3){0, 0, 0.7}, TRACKER_SEEN);
    assert_int_equal(s.eye.belief.standing, STANDING_FRESH);
}

static void a_resting_eye_is_steadier_than_its_samples(void **state)
{
    struct world *w = *state;
    const double noise = 0.007; // m in depth, as the camera's pixels make it
    double squares = 0, farthest = 0;
    for (int i = 0; i < 2000; i++) {
        struct vec3 seen = {0.1, 0.5, 0.6 + noise * gauss(w)};
        double off = read_head(w, seen, TRACKER_SEEN).eye.at.z - 0.6;
        squares += i < 200 ? 0 : off * off;
        farthest = fmax(farthest, i < 200 ? 0 : fabs(off));
    }
    assert_true(sqrt(squares / 1800) < noise / 2.5);
    assert_true(farthest < 2 * noise);
}

static void a_moving_eye_is_followed_within_a_few_centimetres_and_then_reached(void **state)
{
    struct world *w = *state;
    static const double LAG_M = 0.055; // what the header promises, and a sample's way
    double farthest = 0;
    w->settings.state.eye_filter = EYE_FILTER_ONE_EURO; // kalman does not lag at constant speed
    estimator_init(&w->e, &w->settings, &w->taught);
    for (double speed = 0.1; speed < 2; speed *= 2) {
        struct vec3 at = {-0.4, 0.5, 0.6};
        pass(w, NS_PER_S); // forgotten meanwhile: the next place counts at once
        assert_near(read_head(w, at, TRACKER_SEEN).eye.at.x, -0.4, EXACT);
        for (; at.x < 0.4; at.x += speed * 0.01)
            farthest = fmax(farthest, at.x - read_head(w, at, TRACKER_SEEN).eye.at.x);
        for (int i = 0; i < 60; i++)
            read_head(w, at, TRACKER_SEEN);
        assert_near(w->state.eye.at.x, at.x, 0.001);
    }
    assert_true(farthest > 0.005 && farthest < LAG_M);
}

static void a_clock_that_goes_back_starts_ages_at_zero_and_blocks_nothing(void **state)
{
    struct world *w = *state;
    for (int i = 0; i < 5; i++) {
        read_light(w, &w->lamps[A], 1);
        read_tilt(w, 20, true);
    }
    w->now_ns -= 500 * NS_PER_S;
    struct state s = pass(w, 0);
    assert_int_equal(s.lamp.belief.age_ns, 0);
    assert_int_equal(s.tilt.belief.age_ns, 0);
    assert_int_equal(s.lamp.index, A);
    assert_near(read_tilt(w, 50, true).tilt.deg, 50, EXACT);
    read_light(w, &w->lamps[D65], 1);
    s = read_light(w, &w->lamps[D65], 1);
    assert_int_equal(s.lamp.index, D65);
    assert_true(isfinite(s.lamp.level) && isfinite(s.tilt.deg));
}

static void how_the_sensor_is_turned_counts_at_once_with_new_settings(void **state)
{
    struct world *w = *state;
    assert_near(read_tilt(w, 34, true).tilt.deg, 34, EXACT);
    w->settings.accelerometer.turned_deg[0] = 4;
    estimator_change(&w->e, &w->settings, &w->taught);
    assert_near(read_tilt(w, 34, true).tilt.deg, 30, EXACT);
    w->settings.accelerometer.turned_deg[1] = 60;
    estimator_change(&w->e, &w->settings, &w->taught);
    double upright_45 = atan(2) * 180 / acos(-1); // tan r = tan t / cos 60
    assert_near(read_tilt(w, upright_45, true).tilt.deg, 45 - 4, EXACT);
}

static void a_sample_older_than_the_last_one_is_passed_over(void **state)
{
    struct world *w = *state;
    read_tilt(w, 20, true);
    w->seen.tilt_number++;
    w->seen.tilt =
        (struct tilt_sample){.taken = {w->now_ns - 5 * NS_PER_S, w->now_ns - 5 * NS_PER_S},
                             .tilt_deg = 60,
                             .plausible = true};
    assert_near(pass(w, 0).tilt.deg, 20, EXACT);
    assert_int_equal(w->state.tilt.belief.age_ns, 0);
}

static void equal_times_divide_by_nothing(void **state)
{
    struct world *w = *state;
    for (int i = 0; i < 5; i++) {
        w->seen.spectrum_number++;
        w->seen.spectrum = (struct spectrum_sample){.taken = {w->now_ns, w->now_ns},
                                                    .status = SPECTROMETER_GOOD,
                                                    .irradiance = w->lamps[A]};
        w->seen.tilt_number++;
        w->seen.tilt = (struct tilt_sample){
            .taken = {w->now_ns, w->now_ns}, .tilt_deg = 20 + 0.01 * i, .plausible = true};
        struct state s = pass(w, 0);
        assert_true(isfinite(s.lamp.level) && isfinite(s.tilt.deg));
    }
    assert_near(w->state.lamp.level, 1, EXACT);
}

static void a_sample_from_the_future_has_no_age(void **state)
{
    struct world *w = *state;
    w->seen.tilt_number++;
    w->seen.tilt = (struct tilt_sample){
        .taken = {w->now_ns, w->now_ns + NS_PER_S}, .tilt_deg = 40, .plausible = true};
    assert_int_equal(pass(w, 0).tilt.belief.age_ns, 0);
}

static void new_settings_keep_tilt_and_decide_on_the_lamp_with_the_next_reading(void **state)
{
    struct world *w = *state;
    read_tilt(w, 12, true);
    read_light(w, &w->lamps[A], 1);
    read_light(w, &w->lamps[A], 1);
    estimator_change(&w->e, &w->settings, &w->taught);
    struct state s = pass(w, 0); // the mailbox still holds the newest reading
    assert_int_equal(s.lamp.index, A);
    assert_near(s.tilt.deg, 12, EXACT);
    assert_int_equal(read_light(w, &w->lamps[D65], 1).lamp.index, A); // and is careful again
}

static void without_a_spectrometer_the_declared_lamp_is_on_but_never_sure(void **state)
{
    struct world *w = *state;
    w->settings.spectrometer.driver = 0;
    strcpy(w->settings.lamps.declared, "D50");
    estimator_init(&w->e, &w->settings, &w->taught);
    struct state s = pass(w, 100 * NS_PER_S);
    assert_int_equal(s.lamp.index, D50);
    assert_near(s.lamp.level, 1, EXACT);
    assert_int_equal(s.lamp.belief.standing, STANDING_PRESET);
    assert_near(s.lamp.belief.confidence, 0, EXACT);
}

static void a_day_of_booth_life_changes_lamps_exactly_as_often_as_the_booth_did(void **state)
{
    struct world *w = *state;
    int changes = 0, lamp = -1;
    for (int hour = 0; hour < 24; hour++)
        for (int i = 0; i < 60; i++) {
            int on = hour % LAMPS;
            struct state s = read_noisy(w, on, 0.8 + 0.01 * (i % 20), 0.004);
            changes += s.lamp.index != lamp;
            lamp = s.lamp.index;
            pass(w, 60 * NS_PER_S);
        }
    assert_int_equal(changes, 24);
}

#define IN_A_WORLD(test) cmocka_unit_test_setup_teardown(test, open_world, close_world)

int main(void)
{
    const struct CMUnitTest tests[] = {
        IN_A_WORLD(nothing_seen_gives_the_presets_without_confidence),
        IN_A_WORLD(a_lamp_is_believed_at_its_second_reading_and_not_before),
        IN_A_WORLD(a_switched_lamp_takes_two_readings_and_its_level_is_its_own),
        IN_A_WORLD(a_sample_looked_at_twice_counts_once),
        IN_A_WORLD(noise_of_readings_hardly_moves_the_level),
        IN_A_WORLD(a_dimmed_lamp_stays_itself_and_its_level_is_right_after_two_readings),
        IN_A_WORLD(one_odd_reading_moves_the_level_by_a_tenth_of_it_at_most),
        IN_A_WORLD(darkness_is_a_lamp_of_its_own),
        IN_A_WORLD(too_weak_a_reading_is_darkness_and_a_saturated_one_is_nothing),
        IN_A_WORLD(unknown_light_holds_the_lamp_for_its_hold_time_then_gives_none),
        IN_A_WORLD(a_silent_spectrometer_leaves_the_lamp_and_says_how_old_it_is),
        IN_A_WORLD(a_resting_tilt_is_smoothed_and_a_moved_one_followed_at_once),
        IN_A_WORLD(a_slow_creep_of_the_tilt_is_followed),
        IN_A_WORLD(an_implausible_tilt_is_passed_over),
        IN_A_WORLD(tilts_on_both_sides_of_the_half_turn_are_neighbours),
        IN_A_WORLD(the_eye_is_placed_in_the_booth_and_held_while_lost),
        IN_A_WORLD(a_resting_eye_is_steadier_than_its_samples),
        IN_A_WORLD(a_moving_eye_is_followed_within_a_few_centimetres_and_then_reached),
        IN_A_WORLD(a_clock_that_goes_back_starts_ages_at_zero_and_blocks_nothing),
        IN_A_WORLD(how_the_sensor_is_turned_counts_at_once_with_new_settings),
        IN_A_WORLD(a_sample_older_than_the_last_one_is_passed_over),
        IN_A_WORLD(equal_times_divide_by_nothing),
        IN_A_WORLD(a_sample_from_the_future_has_no_age),
        IN_A_WORLD(new_settings_keep_tilt_and_decide_on_the_lamp_with_the_next_reading),
        IN_A_WORLD(without_a_spectrometer_the_declared_lamp_is_on_but_never_sure),
        IN_A_WORLD(a_day_of_booth_life_changes_lamps_exactly_as_often_as_the_booth_did),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
