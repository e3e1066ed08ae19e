// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/colour.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "colorimetry/illuminant.h"
#include "tests/fakes/near.h"

#define PUBLISHED_DE 1e-4   // the pairs are published with four decimals
#define CCT_K 1.0           // asked for; both sides tabulate the Planckian locus
#define CCT_DUV 1e-5        // likewise
#define ROUNDING 1e-12      // a few operations in double
#define KNEE 1e-12          // rational constants meet exactly, up to rounding
#define CMF_DIGITS 1e-9     // tables carry nine digits
#define SYMMETRIC 1e-9      // opposite hues may be summed in another order

static uint64_t chance_state = 1;

// A number in 0..1, the same sequence in every run.
static double chance(void)
{
    chance_state = chance_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(chance_state >> 11) / (double)(UINT64_C(1) << 53);
}

static struct lab any_lab(void)
{
    return (struct lab){100 * chance(), 200 * chance() - 100, 200 * chance() - 100};
}

static const struct xyz WHITE_D65 = {95.047, 100, 108.883};
static const struct xyz WHITE_A = {109.85, 100, 35.585};

// Sharma, Wu, Dalal 2005, table 1.
static const double SHARMA[34][7] = {
    {50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425},
    {50, 3.1571, -77.2803, 50, 0, -82.7485, 2.8615},
    {50, 2.8361, -74.0200, 50, 0, -82.7485, 3.4412},
    {50, -1.3802, -84.2814, 50, 0, -82.7485, 1.0000},
    {50, -1.1848, -84.8006, 50, 0, -82.7485, 1.0000},
    {50, -0.9009, -85.5211, 50, 0, -82.7485, 1.0000},
    {50, 0, 0, 50, -1, 2, 2.3669},
    {50, -1, 2, 50, 0, 0, 2.3669},
    {50, 2.4900, -0.0010, 50, -2.4900, 0.0009, 7.1792},
    {50, 2.4900, -0.0010, 50, -2.4900, 0.0010, 7.1792},
    {50, 2.4900, -0.0010, 50, -2.4900, 0.0011, 7.2195},
    {50, 2.4900, -0.0010, 50, -2.4900, 0.0012, 7.2195},
    {50, -0.0010, 2.4900, 50, 0.0009, -2.4900, 4.8045},
    {50, -0.0010, 2.4900, 50, 0.0010, -2.4900, 4.8045},
    {50, -0.0010, 2.4900, 50, 0.0011, -2.4900, 4.7461},
    {50, 2.5, 0, 50, 0, -2.5, 4.3065},
    {50, 2.5, 0, 73, 25, -18, 27.1492},
    {50, 2.5, 0, 61, -5, 29, 22.8977},
    {50, 2.5, 0, 56, -27, -3, 31.9030},
    {50, 2.5, 0, 58, 24, 15, 19.4535},
    {50, 2.5, 0, 50, 3.1736, 0.5854, 1.0000},
    {50, 2.5, 0, 50, 3.2972, 0, 1.0000},
    {50, 2.5, 0, 50, 1.8634, 0.5757, 1.0000},
    {50, 2.5, 0, 50, 3.2592, 0.3350, 1.0000},
    {60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644},
    {63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630},
    {61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731},
    {35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645},
    {22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373},
    {36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146},
    {90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441},
    {90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381},
    {6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377},
    {2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082},
};

static struct lab first_of(const double *row)
{
    return (struct lab){row[0], row[1], row[2]};
}

static struct lab second_of(const double *row)
{
    return (struct lab){row[3], row[4], row[5]};
}

static void ciede2000_gives_the_34_published_pairs(void **state)
{
    (void)state;
    for (int i = 0; i < 34; i++) {
        double got = delta_e_2000(first_of(SHARMA[i]), second_of(SHARMA[i]));
        assert_near(got, SHARMA[i][6], PUBLISHED_DE);
    }
}

static void ciede2000_is_the_same_both_ways_round(void **state)
{
    (void)state;
    for (int i = 0; i < 34; i++) {
        struct lab a = first_of(SHARMA[i]), b = second_of(SHARMA[i]);
        assert_near(delta_e_2000(a, b), delta_e_2000(b, a), SYMMETRIC);
    }
    for (int i = 0; i < 10000; i++) {
        struct lab a = any_lab(), b = any_lab();
        assert_near(delta_e_2000(a, b), delta_e_2000(b, a), SYMMETRIC);
    }
}

static void a_colour_does_not_differ_from_itself(void **state)
{
    (void)state;
    for (int i = 0; i < 1000; i++) {
        struct lab a = any_lab();
        assert_true(delta_e_2000(a, a) == 0);
        assert_true(delta_e_ab(a, a) == 0);
    }
}

static void greys_differ_by_lightness_alone(void **state)
{
    (void)state;
    // Sharma's S_L at a mean lightness of 50 is 1.
    assert_near(delta_e_2000((struct lab){49, 0, 0}, (struct lab){51, 0, 0}), 2, ROUNDING);
    struct delta_lch d = delta_lch_2000((struct lab){49, 0, 0}, (struct lab){51, 0, 0});
    assert_near(d.L, 2, ROUNDING);
    assert_true(d.C == 0 && d.H == 0);
}

static void the_parts_of_ciede2000_carry_their_signs(void **state)
{
    (void)state;
    struct delta_lch d = delta_lch_2000((struct lab){40, 20, 0}, (struct lab){50, 25, 5});
    assert_true(d.L > 0 && d.C > 0 && d.H > 0);
    d = delta_lch_2000((struct lab){50, 25, 5}, (struct lab){40, 20, 0});
    assert_true(d.L < 0 && d.C < 0 && d.H < 0);
}

static void ciede2000_stays_finite_for_huge_and_for_no_chroma(void **state)
{
    (void)state;
    const double sizes[] = {0, 1e-300, 1e-12, 1, 1e6, 1e60, 1e200, 1e300};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        for (size_t j = 0; j < sizeof sizes / sizeof *sizes; j++) {
            struct lab a = {sizes[i], sizes[j], -sizes[i]}, b = {sizes[j], -sizes[i], sizes[j]};
            assert_true(isfinite(delta_e_2000(a, b)));
            assert_true(isfinite(delta_e_2000((struct lab){50, 0, 0}, b)));
        }
    }
}

// The 1976 formula says 5 for 3, 4.
static void delta_e_ab_is_a_distance(void **state)
{
    (void)state;
    assert_near(delta_e_ab((struct lab){50, 0, 0}, (struct lab){50, 3, 4}), 5, ROUNDING);
}

static void white_is_lab_100_and_black_is_0(void **state)
{
    (void)state;
    struct lab lab;
    assert_true(lab_of(WHITE_D65, WHITE_D65, &lab, NULL));
    assert_near(lab.L, 100, ROUNDING);
    assert_true(fabs(lab.a) < ROUNDING && fabs(lab.b) < ROUNDING);
    assert_true(lab_of((struct xyz){0, 0, 0}, WHITE_D65, &lab, NULL));
    assert_near(lab.L, 0, ROUNDING);
    assert_near(hypot(lab.a, lab.b), 0, ROUNDING);
}

// CIE 015: L* = 50 stands at Y = 18.4187 %.
static void mid_grey_has_its_published_lightness(void **state)
{
    (void)state;
    struct lab lab;
    double y = 100 * pow(66.0 / 116, 3);
    assert_near(y, 18.4187, 1e-4); // four published decimals
    assert_true(lab_of((struct xyz){0, y, 0}, WHITE_D65, &lab, NULL));
    assert_near(lab.L, 50, ROUNDING);
}

static void lab_and_back_is_the_same_colour(void **state)
{
    (void)state;
    for (int i = 0; i < 10000; i++) {
        struct xyz c = {120 * chance() - 5, 120 * chance() - 5, 120 * chance() - 5};
        struct lab lab;
        assert_true(lab_of(c, WHITE_A, &lab, NULL));
        struct xyz back = xyz_of_lab(lab, WHITE_A);
        assert_near(back.X, c.X, 1e-11); // cubes of 100 in double
        assert_near(back.Y, c.Y, 1e-11);
        assert_near(back.Z, c.Z, 1e-11);
    }
}

static void lab_is_continuous_where_cube_root_meets_line(void **state)
{
    (void)state;
    double knee = 216.0 / 24389 * 100, step = 1e-15;
    struct lab below, above;
    struct xyz white = {100, 100, 100};
    assert_true(lab_of((struct xyz){50, knee * (1 - step), 50}, white, &below, NULL));
    assert_true(lab_of((struct xyz){50, knee * (1 + step), 50}, white, &above, NULL));
    assert_near(below.L, above.L, KNEE);
    assert_near(below.L, 8, KNEE);
}

static void lab_refuses_a_white_without_light(void **state)
{
    (void)state;
    struct lab lab = {1, 2, 3};
    struct error err;
    const struct xyz bad[] = {{0, 100, 100}, {95, 0, 108}, {95, 100, -1}, {NAN, 100, 100}};
    for (int i = 0; i < 4; i++) {
        assert_false(lab_of((struct xyz){1, 1, 1}, bad[i], &lab, &err));
        assert_int_equal(err.code, ERROR_RANGE);
        assert_true(lab.L == 1 && lab.a == 2 && lab.b == 3);
    }
}

static void hue_is_0_at_no_chroma_and_within_a_turn_elsewhere(void **state)
{
    (void)state;
    assert_true(lch_of((struct lab){50, 0, 0}).h == 0);
    assert_true(lch_of((struct lab){50, -0.0, -0.0}).h == 0);
    assert_near(lch_of((struct lab){50, 0, -1}).h, 270, ROUNDING);
    for (int i = 0; i < 1000; i++) {
        struct lch c = lch_of(any_lab());
        assert_true(c.h >= 0 && c.h < 360);
    }
}

static void chromaticity_of_black_is_zero(void **state)
{
    (void)state;
    struct xy xy = xy_of((struct xyz){0, 0, 0});
    struct uv uv = uv_of((struct xyz){0, 0, 0});
    assert_true(xy.x == 0 && xy.y == 0 && uv.u == 0 && uv.v == 0);
    uv = uv_of(WHITE_D65);
    assert_near(uv.u, 0.1978, 5e-5); // CIE 015: u' 0.1978, v' 0.4683
    assert_near(uv.v, 0.4683, 5e-5);
}

// ---- spectrum to XYZ ---------------------------------------------------------

// Colour-matching functions as printed in CIE 015 and CIE 170-2.
static void observers_carry_the_published_values(void **state)
{
    (void)state;
    const struct spectrum *c = observer_cmf(OBSERVER_1931_2);
    assert_near(c[1].v[555 - 360], 1, CMF_DIGITS);
    assert_near(c[0].v[445 - 360], 0.34806, 1e-5); // 445 nm: 0.3481 0.0298 1.7826
    assert_near(c[2].v[445 - 360], 1.7826, 1e-4);
    c = observer_cmf(OBSERVER_1964_10);
    assert_near(c[0].v[600 - 360], 1.123990, 1e-5); // 600 nm: 1.1240 0.6583 0.0000
    assert_near(c[1].v[600 - 360], 0.658341, 1e-5);
    for (int k = 0; k < 3; k++) {
        assert_true(observer_cmf(OBSERVER_2015_2)[k].v[389 - 360] == 0);
        assert_true(observer_cmf(OBSERVER_2015_10)[k].v[389 - 360] == 0);
    }
}

// The published functions of one observer have equal areas (CIE 015, 7.1).
static void equal_energy_is_white_for_every_observer(void **state)
{
    (void)state;
    struct spectrum e;
    assert_true(illuminant("E", &e, NULL));
    for (enum observer i = 0; i < OBSERVER_COUNT; i++) {
        struct xy c = xy_of(xyz_relative(&e, NULL, i));
        assert_near(c.x, 1.0 / 3, 5e-5); // 106.865, 106.857, 106.892 in 1931
        assert_near(c.y, 1.0 / 3, 5e-5);
    }
}

static void observers_are_found_by_name_and_never_replaced(void **state)
{
    (void)state;
    for (enum observer i = 0; i < OBSERVER_COUNT; i++) {
        enum observer found;
        assert_true(observer_from_name(observer_name(i), &found));
        assert_int_equal(found, i);
    }
    enum observer untouched = OBSERVER_2015_2;
    assert_false(observer_from_name("1931", &untouched));
    assert_false(observer_from_name("", &untouched));
    assert_int_equal(untouched, OBSERVER_2015_2);
}

// One watt at 555 nm is 683 lumens.
static void absolute_luminance_counts_683_lumens_a_watt(void **state)
{
    (void)state;
    struct spectrum s = {{0}};
    s.v[555 - 360] = 2;
    assert_near(xyz_absolute(&s, OBSERVER_1931_2).Y, 2 * 683, 1e-6); // table: 1.000000
}

static void tristimulus_values_are_linear(void **state)
{
    (void)state;
    struct spectrum a, b, sum;
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        a.v[i] = chance();
        b.v[i] = chance();
        sum.v[i] = 3 * a.v[i] + b.v[i];
    }
    struct xyz p = xyz_absolute(&a, OBSERVER_1964_10), q = xyz_absolute(&b, OBSERVER_1964_10);
    struct xyz s = xyz_absolute(&sum, OBSERVER_1964_10);
    assert_near(s.X / (3 * p.X + q.X), 1, ROUNDING);
    assert_near(s.Y / (3 * p.Y + q.Y), 1, ROUNDING);
    assert_near(s.Z / (3 * p.Z + q.Z), 1, ROUNDING);
}

static void a_surface_does_not_change_when_its_lamp_is_dimmed(void **state)
{
    (void)state;
    struct spectrum lamp, surface;
    assert_true(illuminant("FL8", &lamp, NULL));
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        surface.v[i] = chance();
    struct xyz full = xyz_relative(&lamp, &surface, OBSERVER_1931_2);
    spectrum_scale(&lamp, 1e-6);
    struct xyz dim = xyz_relative(&lamp, &surface, OBSERVER_1931_2);
    assert_near(dim.X, full.X, 1e-10);
    assert_near(dim.Y, full.Y, 1e-10);
    assert_near(dim.Z, full.Z, 1e-10);
}

static void the_perfect_white_has_y_100_and_a_dark_lamp_shows_nothing(void **state)
{
    (void)state;
    struct spectrum lamp, dark = {{0}};
    assert_true(illuminant("A", &lamp, NULL));
    assert_near(xyz_relative(&lamp, NULL, OBSERVER_2015_10).Y, 100, ROUNDING * 100);
    struct xyz c = xyz_relative(&dark, NULL, OBSERVER_1931_2);
    assert_true(c.X == 0 && c.Y == 0 && c.Z == 0);
}

// ---- adaptation --------------------------------------------------------------

static void adaptation_maps_white_to_white(void **state)
{
    (void)state;
    for (enum cat cat = CAT_02; cat <= CAT_16; cat++) {
        struct xyz got = xyz_apply(cat_matrix(cat, WHITE_A, WHITE_D65, 1), WHITE_A);
        assert_near(got.X, WHITE_D65.X, 1e-10); // values of about 100
        assert_near(got.Y, WHITE_D65.Y, 1e-10);
        assert_near(got.Z, WHITE_D65.Z, 1e-10);
    }
}

static void adaptation_between_equal_whites_changes_nothing(void **state)
{
    (void)state;
    struct xyz bright = {10 * WHITE_A.X, 10 * WHITE_A.Y, 10 * WHITE_A.Z};
    for (enum cat cat = CAT_02; cat <= CAT_16; cat++) {
        for (double degree = 0; degree <= 1; degree += 0.5) {
            struct mat3 m = cat_matrix(cat, WHITE_A, bright, degree);
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++)
                    assert_near(m.m[i][j], i == j, ROUNDING);
        }
        struct mat3 none = cat_matrix(cat, WHITE_A, WHITE_D65, 0);
        assert_near(none.m[0][0], 1, ROUNDING);
        assert_near(none.m[0][1], 0, ROUNDING);
    }
}

// The figures that the tests of colour-science carry, with eight decimals.
static void cat02_gives_known_figures(void **state)
{
    (void)state;
    const struct xyz d65 = {0.95045593, 1, 1.08905775};
    const struct {
        struct xyz colour, to, wanted;
    } rows[] = {
        {{0.20654008, 0.12197225, 0.05136952},
         {0.96429568, 1, 0.82510460},
         {0.21638819, 0.12570000, 0.03847494}},
        {{0.14222010, 0.23042768, 0.10495772},
         {1.09846607, 1, 0.35582280},
         {0.18673833, 0.23111171, 0.03285972}},
        {{0.07818780, 0.06157201, 0.28099326},
         {0.99144661, 1, 0.67315942},
         {0.06385467, 0.05509729, 0.17506386}},
    };
    for (int i = 0; i < 3; i++) {
        struct xyz got = xyz_apply(cat_matrix(CAT_02, d65, rows[i].to, 1), rows[i].colour);
        assert_near(got.X, rows[i].wanted.X, 1e-8);
        assert_near(got.Y, rows[i].wanted.Y, 1e-8);
        assert_near(got.Z, rows[i].wanted.Z, 1e-8);
    }
}

static void adaptation_to_a_white_without_light_changes_nothing(void **state)
{
    (void)state;
    struct mat3 one = mat3_identity(), m = cat_matrix(CAT_16, WHITE_A, (struct xyz){0, 0, 0}, 1);
    assert_memory_equal(&m, &one, sizeof one);
    m = cat_matrix(CAT_02, (struct xyz){NAN, NAN, NAN}, WHITE_A, 1);
    assert_memory_equal(&m, &one, sizeof one);
}

static void adaptation_there_and_back_is_the_identity(void **state)
{
    (void)state;
    for (enum cat cat = CAT_02; cat <= CAT_16; cat++) {
        struct mat3 m = mat3_mul(cat_matrix(cat, WHITE_D65, WHITE_A, 1),
                                 cat_matrix(cat, WHITE_A, WHITE_D65, 1));
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                assert_near(m.m[i][j], i == j, ROUNDING * 10);
    }
}

// ---- correlated colour temperature -------------------------------------------

// x, y and the Ohno values of 46 illuminants.
static void cct_and_duv_agree_with_ohno(void **state)
{
    (void)state;
    FILE *in = fopen("tests/data/illuminants.txt", "r");
    char line[256], name[32];
    int seen = 0;
    assert_non_null(in);
    while (fgets(line, sizeof line, in)) {
        double x, y, kelvin, duv;
        if (sscanf(line, "%31s %lf %lf %lf %lf", name, &x, &y, &kelvin, &duv) != 5)
            continue;
        struct cct got = cct_of((struct xy){x, y});
        assert_true(got.valid);
        assert_near(got.kelvin, kelvin, CCT_K);
        assert_near(got.duv, duv, CCT_DUV);
        seen++;
    }
    fclose(in);
    assert_int_equal(seen, 46);
}

static void planckian_light_has_its_own_temperature(void **state)
{
    (void)state;
    for (double kelvin = 1010; kelvin < 90000; kelvin *= 1.37) {
        struct spectrum s;
        planck(kelvin, &s);
        struct cct got = cct_of(xy_of(xyz_relative(&s, NULL, OBSERVER_1931_2)));
        assert_true(got.valid);
        assert_near(got.kelvin / kelvin, 1, 1e-6); // steps of the table are 5e-4
        assert_near(got.duv, 0, 1e-7);
    }
}

static void colours_far_from_the_locus_have_no_valid_cct(void **state)
{
    (void)state;
    const struct xy far[] = {{0, 0},     {0.1, 0.8}, {0.7, 0.3}, {0.15, 0.05},
                             {NAN, 0.3}, {-1, 0.3},  {0.5, 0.7}, {INFINITY, 0.3}};
    for (size_t i = 0; i < sizeof far / sizeof *far; i++)
        assert_false(cct_of(far[i]).valid);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ciede2000_gives_the_34_published_pairs),
        cmocka_unit_test(ciede2000_is_the_same_both_ways_round),
        cmocka_unit_test(a_colour_does_not_differ_from_itself),
        cmocka_unit_test(greys_differ_by_lightness_alone),
        cmocka_unit_test(the_parts_of_ciede2000_carry_their_signs),
        cmocka_unit_test(ciede2000_stays_finite_for_huge_and_for_no_chroma),
        cmocka_unit_test(delta_e_ab_is_a_distance),
        cmocka_unit_test(white_is_lab_100_and_black_is_0),
        cmocka_unit_test(mid_grey_has_its_published_lightness),
        cmocka_unit_test(lab_and_back_is_the_same_colour),
        cmocka_unit_test(lab_is_continuous_where_cube_root_meets_line),
        cmocka_unit_test(lab_refuses_a_white_without_light),
        cmocka_unit_test(hue_is_0_at_no_chroma_and_within_a_turn_elsewhere),
        cmocka_unit_test(chromaticity_of_black_is_zero),
        cmocka_unit_test(observers_carry_the_published_values),
        cmocka_unit_test(equal_energy_is_white_for_every_observer),
        cmocka_unit_test(observers_are_found_by_name_and_never_replaced),
        cmocka_unit_test(absolute_luminance_counts_683_lumens_a_watt),
        cmocka_unit_test(tristimulus_values_are_linear),
        cmocka_unit_test(a_surface_does_not_change_when_its_lamp_is_dimmed),
        cmocka_unit_test(the_perfect_white_has_y_100_and_a_dark_lamp_shows_nothing),
        cmocka_unit_test(adaptation_maps_white_to_white),
        cmocka_unit_test(adaptation_between_equal_whites_changes_nothing),
        cmocka_unit_test(cat02_gives_known_figures),
        cmocka_unit_test(adaptation_to_a_white_without_light_changes_nothing),
        cmocka_unit_test(adaptation_there_and_back_is_the_identity),
        cmocka_unit_test(cct_and_duv_agree_with_ohno),
        cmocka_unit_test(planckian_light_has_its_own_temperature),
        cmocka_unit_test(colours_far_from_the_locus_have_no_valid_cct),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
