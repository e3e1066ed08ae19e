// SPDX-License-Identifier: Apache-2.0
// Place and direction of a tracker from points whose truth is known.
#include "tests/fakes/support.h"

#include "calibration/tracker_fit.h"
#include "config/booth.h"

static const double EXACT_M = 1e-7, EXACT_DEG = 1e-5; // the solver's own end
static const double COVERED = 0.95, COVERED_WITHIN = 0.03;
static const double POINT_M = 0.003;

static const double TRUTH[] = {0.02, 0.36, -0.19, 11.5, -2, 1.5};

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

static struct rigid pose(const double *v)
{
    static struct booth_settings b;
    memcpy(b.tracker.place_m, v, sizeof b.tracker.place_m);
    b.tracker.pitch_deg = v[3];
    b.tracker.yaw_deg = v[4];
    b.tracker.roll_deg = v[5];
    return booth_from_tracker(&b);
}

// Corners and centre of a screen before the camera, at two distances.
static struct tracker_problem problem(const double *v, double noise)
{
    struct tracker_problem p = {.point_m = POINT_M};
    struct rigid tracker_from_booth = rigid_inverse(pose(v));
    for (int k = 0; k < 10; k++) {
        int corner = k % 5;
        struct vec3 at = {corner == 4 ? 0 : (corner & 1 ? 0.26 : -0.26),
                          corner == 4 ? 0.45 : (corner & 2 ? 0.6 : 0.3), k < 5 ? 0.6 : 0.8};
        struct tracker_point *q = &p.points[p.count++];
        q->held = at;
        q->seen = rigid_apply(tracker_from_booth, at);
        q->seen =
            vec3_add(q->seen, (struct vec3){noise * POINT_M * normal(), noise * POINT_M * normal(),
                                            noise * POINT_M * normal()});
    }
    return p;
}

static struct tracker_fit fitted(const struct tracker_problem *p)
{
    struct tracker_fit f;
    struct error err = {0};
    if (!tracker_fit(p, &f, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    return f;
}

static void refused(const struct tracker_problem *p, const char *part)
{
    struct tracker_fit f = {.points = 77};
    struct error err = {0};
    assert_false(tracker_fit(p, &f, &err));
    assert_holds(err.text, part);
    assert_int_equal(err.code, ERROR_DATA);
    assert_int_equal(f.points, 77); // untouched
}

static void points_without_error_give_the_truth_back_wherever_it_looks(void **state)
{
    (void)state;
    static const double MORE[][6] = {{0.02, 0.36, -0.19, 11.5, -2, 1.5},
                                     {0, 0.9, 1.2, -30, 180, 0},
                                     {1, 0.4, 0.7, -5, -90, 90},
                                     {0, 0, 0, 80, 40, -170}};
    for (int i = 0; i < 4; i++) {
        struct tracker_problem p = problem(MORE[i], 0);
        struct tracker_fit f = fitted(&p);
        for (int k = 0; k < TRACKER_PARAMETER_COUNT; k++) {
            double off = f.value[k] - MORE[i][k];
            assert_near(k < TRACKER_PITCH ? off : remainder(off, 360), 0,
                        k < TRACKER_PITCH ? EXACT_M : EXACT_DEG);
        }
        assert_near(f.rms_m, 0, EXACT_M);
        assert_near(f.stretch, 1, EXACT_M);
        assert_string_equal(f.warning, "");
    }
}

// A camera at (0, 0.3, 0) that looks along z, pitched up by 90 degrees: what is 0.5 m ahead of
// it and 0.2 m to its right is above it.
static void three_points_by_hand_give_place_and_pitch(void **state)
{
    (void)state;
    struct tracker_problem p = {POINT_M,
                                3,
                                {{{0, 0.70, 0.50}, {0, 0, 0.5}}, // up by 3, 4 and 5
                                 {{0.2, 0.70, 0.50}, {0.2, 0, 0.5}},
                                 {{0, 0.76, 0.42}, {0, 0.1, 0.5}}}};
    struct tracker_fit f = fitted(&p);
    struct vec3 axis = mat3_apply(f.booth_from_tracker.rotation, (struct vec3){0, 0, 1});
    assert_near(f.value[TRACKER_Y], 0.3, EXACT_M);
    assert_near(f.value[TRACKER_Z], 0.2, EXACT_M);
    assert_near(f.value[TRACKER_X], 0, EXACT_M);
    assert_near(axis.y, 0.8, EXACT_M);
}

static void the_booth_moved_moves_the_tracker_and_does_not_turn_it(void **state)
{
    (void)state;
    chance = 3;
    struct tracker_problem p = problem(TRUTH, 1), moved = p;
    for (int i = 0; i < p.count; i++)
        moved.points[i].held = vec3_add(p.points[i].held, (struct vec3){0.1, -0.2, 0.3});
    struct tracker_fit a = fitted(&p), b = fitted(&moved);
    static const double BY[] = {0.1, -0.2, 0.3, 0, 0, 0};
    for (int k = 0; k < TRACKER_PARAMETER_COUNT; k++)
        assert_near(b.value[k] - a.value[k], BY[k], k < TRACKER_PITCH ? 1e-6 : 1e-4);
}

static void the_stated_uncertainty_covers_the_truth(void **state)
{
    (void)state;
    enum { SETS = 150 };
    int covered = 0, all = 0;
    chance = 42;
    for (int set = 0; set < SETS; set++) {
        struct tracker_problem p = problem(TRUTH, 1);
        struct tracker_fit f = fitted(&p);
        for (int k = 0; k < TRACKER_PARAMETER_COUNT; k++, all++)
            covered += fabs(f.value[k] - TRUTH[k]) <= f.uncertainty[k];
    }
    print_message("%.1f %% of %d values within their uncertainty\n", 100.0 * covered / all, all);
    assert_near((double)covered / all, COVERED, COVERED_WITHIN);
}

static void places_that_decide_nothing_are_refused_with_the_reason(void **state)
{
    (void)state;
    struct tracker_problem p = problem(TRUTH, 0);
    p.count = 2;
    refused(&p, "2 point(s): at least 3");
    p = problem(TRUTH, 0);
    for (int i = 0; i < p.count; i++) {
        double along = 0.05 * i;
        p.points[i] = (struct tracker_point){{along, 0.4, 0.6}, {along, 0, 0.7}};
    }
    refused(&p, "collinear: all within 0 mm");
    p = problem(TRUTH, 0);
    for (int i = 0; i < p.count; i++)
        p.points[i].held = p.points[i].seen =
            (struct vec3){0.01 * i, 0.05 * (i % 2), 0.5 + 0.02 * (i % 3)};
    refused(&p, "too close together");
    p = problem(TRUTH, 0);
    p.point_m = 0.05;
    refused(&p, "the points do not decide");
}

static void a_point_that_contradicts_the_others_is_named(void **state)
{
    (void)state;
    struct tracker_problem p = problem(TRUTH, 0);
    p.points[6].held.y += 0.1;
    refused(&p, "point 7 is off");
    p = problem(TRUTH, 0);
    for (int i = 0; i < p.count; i++)
        p.points[i].seen = vec3_scale(p.points[i].seen, 1.5);
    refused(&p, "1.50 times");
    p = problem(TRUTH, 0);
    for (int i = 0; i < p.count; i++)
        p.points[i].seen = vec3_scale(p.points[i].seen, 1.06);
    assert_holds(fitted(&p).warning, "1.06 times");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(points_without_error_give_the_truth_back_wherever_it_looks),
        cmocka_unit_test(three_points_by_hand_give_place_and_pitch),
        cmocka_unit_test(the_booth_moved_moves_the_tracker_and_does_not_turn_it),
        cmocka_unit_test(the_stated_uncertainty_covers_the_truth),
        cmocka_unit_test(places_that_decide_nothing_are_refused_with_the_reason),
        cmocka_unit_test(a_point_that_contradicts_the_others_is_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
