// SPDX-License-Identifier: Apache-2.0
// Hinge, screen and inclinometer from poses whose truth is known.
#include "tests/fakes/support.h"

#include "calibration/stand_fit.h"
#include "drivers/accelerometer.h"

static const double EXACT_M = 1e-7, EXACT_DEG = 1e-5; // the solver's own end
static const double HAND_M = 1e-5;                    // of numbers written with five digits
static const double COVERED = 0.95, COVERED_WITHIN = 0.03;

static const struct screen SCREEN = {0.52, 0.325, 1280, 800};
static const struct stand TRUE_STAND = {{0, 0.012, -0.008}, {0.003, 0.196, 0.034}};
static const double TRUE_TURNED[3] = {1.5, -2, 3};
static const double TILTS[] = {12, 27, 41, 58, 76};

enum { ANGLES = 1, SENSOR = 2, GRAVITY = 4, PLACES = 8, HEIGHTS = 16 };

static uint64_t chance;

static double uniform(void) // splitmix64, Steele, Lea, Flood 2014
{
    uint64_t z = chance += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return ((double)((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
}

static double normal(void)
{
    double r = sqrt(-2 * log(uniform()));
    return r * cos(2 * acos(-1) * uniform());
}

// Where a place is, written out anew: hinge + right, up and out of the screen.
static void place_at(const struct stand *s, enum screen_place place, double tilt_deg, double at[3])
{
    double t = tilt_deg * acos(-1) / 180;
    struct vec3 p = screen_place_at(&SCREEN, place);
    double up = s->centre_from_hinge_m[1] + p.y, out = s->centre_from_hinge_m[2];
    at[0] = s->hinge_m[0] + s->centre_from_hinge_m[0] + p.x;
    at[1] = s->hinge_m[1] + up * sin(t) + out * cos(t);
    at[2] = s->hinge_m[2] - up * cos(t) + out * sin(t);
}

// Poses with what is read there; noise 1 = as STAND_INSTRUMENTS say.
static struct stand_problem problem(int what, const double *tilts, int count, double noise)
{
    struct stand_problem p = {.screen = SCREEN,
                              .stand = {{0, 0, 0}, {0, 0.2, 0.03}},
                              .instruments = STAND_INSTRUMENTS,
                              .count = count};
    const struct stand_instruments *u = &STAND_INSTRUMENTS;
    for (int i = 0; i < count; i++) {
        struct stand_pose_read *r = &p.poses[i];
        struct vec3 g = tilt_gravity_turned(tilts[i], TRUE_TURNED);
        *r = stand_pose_unread();
        if (what & ANGLES)
            r->protractor_deg = tilts[i] + noise * u->protractor_deg * normal();
        if (what & SENSOR)
            r->inclinometer_deg = tilt_of_gravity(g) + noise * u->inclinometer_deg * normal();
        if (what & GRAVITY)
            r->lateral = g.x + noise * u->lateral * normal();
        for (int k = PLACE_TOP_LEFT; what & (PLACES | HEIGHTS) && k < PLACE_COUNT;
             k += PLACE_BOTTOM_RIGHT - PLACE_TOP_LEFT) {
            place_at(&TRUE_STAND, k, tilts[i], r->at[k]);
            for (int c = 0; c < 3; c++)
                r->at[k][c] =
                    what & PLACES || c == 1 ? r->at[k][c] + noise * u->tape_m * normal() : NAN;
        }
    }
    return p;
}

static void truth(double v[STAND_PARAMETER_COUNT])
{
    const double all[] = {TRUE_STAND.hinge_m[1],
                          TRUE_STAND.hinge_m[2],
                          TRUE_STAND.centre_from_hinge_m[0],
                          TRUE_STAND.centre_from_hinge_m[1],
                          TRUE_STAND.centre_from_hinge_m[2],
                          TRUE_TURNED[0],
                          TRUE_TURNED[1],
                          TRUE_TURNED[2]};
    memcpy(v, all, sizeof all);
}

static struct stand_fit fitted(const struct stand_problem *p)
{
    struct stand_fit f;
    struct error err = {0};
    if (!stand_fit(p, &f, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    return f;
}

static void refused(const struct stand_problem *p, const char *part)
{
    struct stand_fit f = {.poses = 77};
    struct error err = {0};
    assert_false(stand_fit(p, &f, &err));
    assert_holds(err.text, part);
    assert_int_equal(err.code, ERROR_DATA);
    assert_int_equal(f.poses, 77); // untouched
}

static void readings_without_error_give_the_truth_back(void **state)
{
    (void)state;
    static const int SETS[] = {ANGLES | SENSOR | GRAVITY | PLACES, SENSOR | GRAVITY | PLACES};
    for (int set = 0; set < 2; set++) {
        struct stand_problem p = problem(SETS[set], TILTS, 5, 0);
        struct stand_fit f = fitted(&p);
        double t[STAND_PARAMETER_COUNT];
        truth(t);
        for (int i = 0; i < STAND_PARAMETER_COUNT; i++) {
            assert_true(f.fitted[i]);
            assert_near(f.value[i], t[i], i < STAND_TURN_X ? EXACT_M : EXACT_DEG);
        }
        assert_near(f.rms, 0, 1e-3);
        for (int i = 0; i < 5; i++)
            assert_near(f.tilt_deg[i], TILTS[i], EXACT_DEG);
        assert_string_equal(f.warning, "");
    }
}

// y = hinge + 0.3625 sin t + 0.03 cos t of the top, 0.0375 sin t + 0.03 cos t of the bottom.
static void three_heights_by_hand_give_height_and_arm_but_no_depth(void **state)
{
    (void)state;
    static const double tilts[] = {0, 30, 90}, top[] = {0.13, 0.30723, 0.4625},
                        bottom[] = {0.13, 0.14473, 0.1375};
    struct stand_problem p = problem(ANGLES, tilts, 3, 0);
    p.stand = (struct stand){{0.5, 0, 0.7}, {0.4, 0, 0}};
    for (int i = 0; i < 3; i++) {
        p.poses[i].at[PLACE_TOP_LEFT][1] = top[i];
        p.poses[i].at[PLACE_BOTTOM_RIGHT][1] = bottom[i];
    }
    struct stand_fit f = fitted(&p);
    assert_near(f.stand.hinge_m[1], 0.1, HAND_M);
    assert_near(f.stand.centre_from_hinge_m[1], 0.2, HAND_M);
    assert_near(f.stand.centre_from_hinge_m[2], 0.03, HAND_M);
    assert_false(f.fitted[STAND_HINGE_Z] || f.fitted[STAND_CENTRE_X] || f.fitted[STAND_TURN_X]);
    assert_near(f.stand.hinge_m[2], 0.7, 0); // as it was
    assert_near(f.stand.centre_from_hinge_m[0], 0.4, 0);
    assert_near(f.uncertainty[STAND_HINGE_Z], 0, 0);
}

static void a_booth_moved_moves_the_hinge_and_nothing_else(void **state)
{
    (void)state;
    chance = 7;
    struct stand_problem p = problem(ANGLES | SENSOR | GRAVITY | PLACES, TILTS, 5, 1), moved = p;
    for (int i = 0; i < 5; i++)
        for (int k = 0; k < PLACE_COUNT; k++) {
            moved.poses[i].at[k][1] += 0.25;
            moved.poses[i].at[k][2] -= 0.125;
        }
    struct stand_fit a = fitted(&p), b = fitted(&moved);
    assert_near(b.value[STAND_HINGE_Y], a.value[STAND_HINGE_Y] + 0.25, EXACT_M);
    assert_near(b.value[STAND_HINGE_Z], a.value[STAND_HINGE_Z] - 0.125, EXACT_M);
    for (int i = STAND_CENTRE_X; i < STAND_PARAMETER_COUNT; i++)
        assert_near(b.value[i], a.value[i], i < STAND_TURN_X ? EXACT_M : EXACT_DEG);
}

static void the_stated_uncertainty_covers_the_truth(void **state)
{
    (void)state;
    enum { SETS = 200 };
    double t[STAND_PARAMETER_COUNT];
    int covered = 0, all = 0;
    truth(t);
    chance = 20040912;
    for (int set = 0; set < SETS; set++) {
        struct stand_problem p = problem(ANGLES | SENSOR | GRAVITY | PLACES, TILTS, 5, 1);
        struct stand_fit f = fitted(&p);
        for (int i = 0; i < STAND_PARAMETER_COUNT; i++, all++)
            covered += fabs(f.value[i] - t[i]) <= f.uncertainty[i];
    }
    print_message("%.1f %% of %d values within their uncertainty\n", 100.0 * covered / all, all);
    assert_near((double)covered / all, COVERED, COVERED_WITHIN);
}

static void twice_the_noise_is_seen_and_twice_as_uncertain(void **state)
{
    (void)state;
    double rms = 0, wider = 0;
    for (int set = 0; set < 20; set++) {
        chance = 100 + set;
        struct stand_problem p = problem(ANGLES | SENSOR | GRAVITY | PLACES, TILTS, 5, 1);
        struct stand_fit one = fitted(&p);
        chance = 100 + set;
        p = problem(ANGLES | SENSOR | GRAVITY | PLACES, TILTS, 5, 2);
        struct stand_fit two = fitted(&p);
        rms += two.rms / one.rms / 20;
        wider += two.uncertainty[0] / one.uncertainty[0] / 20;
    }
    assert_near(rms, 2, 0.02);
    assert_true(wider > 1.6 && wider <= 2.01); // never below what the instruments say
}

static void the_inclinometer_alone_is_fitted_to_a_protractor(void **state)
{
    (void)state;
    struct stand_problem p = problem(ANGLES | SENSOR | GRAVITY, TILTS, 5, 0);
    struct stand_fit f = fitted(&p);
    assert_false(f.fitted[STAND_HINGE_Y] || f.fitted[STAND_CENTRE_Z]);
    assert_near(f.turned_deg[0], 1.5, EXACT_DEG);
    assert_near(f.turned_deg[1], -2, EXACT_DEG);
    assert_near(f.turned_deg[2], 3, EXACT_DEG);
    p = problem(ANGLES | SENSOR, TILTS, 5, 0); // a sensor that only knows its angle
    f = fitted(&p);
    assert_true(f.fitted[STAND_TURN_X] && !f.fitted[STAND_TURN_Y] && !f.fitted[STAND_TURN_Z]);
    assert_near(f.turned_deg[0], 1.5, 0.2); // its other turns are not known
}

static void without_any_angle_the_sensors_zero_is_believed_and_that_is_said(void **state)
{
    (void)state;
    struct stand_problem p = problem(SENSOR | PLACES, TILTS, 5, 0);
    for (int i = 0; i < 5; i++)
        for (int c = 0; c < 3; c++)
            p.poses[i].at[PLACE_BOTTOM_RIGHT][c] = NAN;
    memcpy(p.turned_deg, TRUE_TURNED, sizeof p.turned_deg);
    struct stand_fit f = fitted(&p);
    assert_holds(f.warning, "zero is taken for right");
    assert_near(f.stand.hinge_m[1], TRUE_STAND.hinge_m[1], EXACT_M);
    assert_near(f.stand.centre_from_hinge_m[2], TRUE_STAND.centre_from_hinge_m[2], EXACT_M);
}

static void poses_that_decide_nothing_are_refused_with_the_reason(void **state)
{
    (void)state;
    static const double NEAR[] = {30, 31, 32, 33}, TWO[] = {10, 12, 60, 61};
    int all = ANGLES | SENSOR | GRAVITY | PLACES;
    struct stand_problem p = problem(all, TILTS, 2, 0);
    refused(&p, "2 pose(s): at least 3");
    p = problem(all, NEAR, 4, 0);
    refused(&p, "from 30.0 to 33.0 degrees, are too close together");
    p = problem(all, TWO, 4, 0);
    refused(&p, "at least 3 of them must be 5 degrees apart");
    p = problem(ANGLES, TILTS, 5, 0);
    refused(&p, "nothing was read");
    p = problem(GRAVITY, TILTS, 5, 0);
    refused(&p, "pose 1 has no angle");
    p = problem(ANGLES | PLACES, TILTS, 5, 0);
    p.poses[3] = stand_pose_unread();
    refused(&p, "pose 4 has no angle");
    static const double SMALL[] = {30, 35.1, 40.2};
    p = problem(ANGLES | HEIGHTS, SMALL, 3, 0);
    refused(&p, "the poses do not decide");
}

static void a_reading_that_contradicts_the_others_is_named(void **state)
{
    (void)state;
    struct stand_problem p = problem(ANGLES | SENSOR | GRAVITY | PLACES, TILTS, 5, 0);
    p.poses[2].at[PLACE_TOP_LEFT][2] += 0.02;
    refused(&p, "pose 3 (");
    refused(&p, "top_left z is off");
    p = problem(ANGLES | SENSOR | GRAVITY | PLACES, TILTS, 5, 0);
    p.poses[4].protractor_deg += 3;
    refused(&p, "pose 5 (");
    refused(&p, "the protractor is off");
    p = problem(ANGLES | SENSOR | GRAVITY | PLACES, TILTS, 5, 30);
    refused(&p, "off any stand by");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(readings_without_error_give_the_truth_back),
        cmocka_unit_test(three_heights_by_hand_give_height_and_arm_but_no_depth),
        cmocka_unit_test(a_booth_moved_moves_the_hinge_and_nothing_else),
        cmocka_unit_test(the_stated_uncertainty_covers_the_truth),
        cmocka_unit_test(twice_the_noise_is_seen_and_twice_as_uncertain),
        cmocka_unit_test(the_inclinometer_alone_is_fitted_to_a_protractor),
        cmocka_unit_test(without_any_angle_the_sensors_zero_is_believed_and_that_is_said),
        cmocka_unit_test(poses_that_decide_nothing_are_refused_with_the_reason),
        cmocka_unit_test(a_reading_that_contradicts_the_others_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
