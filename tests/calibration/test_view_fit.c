// SPDX-License-Identifier: Apache-2.0
// The fit of a display's light by direction and place, on a panel whose law is
// another than the fit's own.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#undef fail // ours is a function

#include "calibration/view_measure.h"

// A power of the cosine is no exponential of a polynomial: what is left over
// within 45 degrees, relative.
static const double OTHER_LAW = 0.003;
static const double RADIANS = M_PI / 180;
enum { SPOTS = 64 };

static const double PRIMARIES[3][3] = {{410, 200, 5}, {270, 630, 45}, {175, 70, 920}};
static const double BLACK[3] = {0.35, 0.38, 0.45};

static double gain(int c, double u, double v)
{
    double cosine = sqrt(1 - u * u - v * v);
    return pow(cosine, 2.5 + 0.3 * c) * (1 + 0.05 * u);
}

static double place(int c, double x, double y)
{
    return 1 - 0.05 * (x - 0.5) * (x - 0.5) - 0.02 * c * (y - 0.5) * (y - 0.5);
}

static struct view_spot spot(double u, double v, double x, double y)
{
    struct view_spot s = {.u = u, .v = v, .x = x, .y = y};
    for (int p = 0; p < VIEW_PATCHES; p++) {
        double out[3], glow = (1 + 2 * (u * u + v * v)) * place(1, x, y);
        for (int k = 0; k < 3; k++) {
            out[k] = BLACK[k] * glow;
            for (int c = 0; c < 3; c++)
                if (p == c || p == VIEW_WHITE)
                    out[k] += PRIMARIES[c][k] * gain(c, u, v) * place(c, x, y);
        }
        s.xyz[p] = (struct xyz){out[0], out[1], out[2]};
    }
    return s;
}

static int plan(struct view_spot *spots, double a, double b, int azimuths, bool places)
{
    const double angles[3] = {a, (a + b) / 2, b};
    int n = 0;
    spots[n++] = spot(0, 0, 0.5, 0.5);
    for (int i = 0; i < 3 * azimuths; i++) {
        double sine = sin(angles[i % 3] * RADIANS), turn = 2 * M_PI * (i / 3) / azimuths;
        spots[n++] = spot(sine * cos(turn), sine * sin(turn), 0.5, 0.5);
    }
    for (int i = 0; places && i < VIEW_GRID * VIEW_GRID; i++)
        spots[n++] = spot(0, 0, VIEW_PLACES[i % VIEW_GRID], VIEW_PLACES[i / VIEW_GRID]);
    return n;
}

static void another_law_is_met_between_the_measured_directions(void **state)
{
    (void)state;
    struct view_spot spots[SPOTS];
    struct display_view view;
    struct view_fit f;
    struct error err;
    assert_true(view_fit(spots, plan(spots, 15, 45, 6, true), &view, &f, &err));
    assert_int_equal(f.directions, 18);
    assert_int_equal(f.places, 25);
    for (int angle = 5; angle <= 45; angle += 5)
        for (int turn = 0; turn < 360; turn += 15) {
            double u = sin(angle * RADIANS) * cos(turn * RADIANS);
            double v = sin(angle * RADIANS) * sin(turn * RADIANS);
            struct view_gains g = display_view_gains(&view, u, v, 0.33, 0.61);
            for (int c = 0; c < 3; c++)
                assert_float_equal(g.c[c] / (gain(c, u, v) * place(c, 0.33, 0.61)), 1, OTHER_LAW);
        }
    assert_true(f.before_de00 > 10 && f.after_de00 < 0.3);
    assert_true(f.before_percent < -50 && fabs(f.after_percent) < 100 * OTHER_LAW);
}

static void places_may_be_left_out(void **state)
{
    (void)state;
    struct view_spot spots[SPOTS];
    struct display_view view;
    struct view_fit f;
    struct error err;
    assert_true(view_fit(spots, plan(spots, 15, 45, 4, false), &view, &f, &err));
    assert_int_equal(f.places, 0);
    for (int c = 0; c < VIEW_CHANNELS; c++)
        assert_float_equal(display_view_gains(&view, 0, 0, 0.1, 0.9).c[c], 1, 1e-12);
}

static void refuse(const struct view_spot *spots, int count, const char *word)
{
    struct display_view view = {.sine_most = 0.125};
    struct view_fit f = {.places = -7};
    struct error err;
    assert_false(view_fit(spots, count, &view, &f, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, word));
    assert_int_equal(f.places, -7);
    assert_float_equal(view.sine_most, 0.125, 0);
}

static void readings_that_decide_nothing_are_refused_with_the_reason(void **state)
{
    (void)state;
    struct view_spot spots[SPOTS], half[SPOTS];
    int all = plan(spots, 15, 45, 6, true), n = 0;
    refuse(spots, 0, "centre");
    refuse(spots, 8, "directions");
    refuse(spots, all - 1, "24 of 25");
    refuse(spots + 1, all - 1, "centre");
    struct view_spot one_angle[SPOTS];
    refuse(one_angle, plan(one_angle, 30, 31, 8, false), "5 degrees");
    half[n++] = spots[0];
    for (int i = 1; i <= 18; i++)
        if (spots[i].v >= -1e-9)
            half[n++] = spots[i];
    refuse(half, n, "turn");
    spots[4].xyz[VIEW_GREEN] = (struct xyz){0, 0, 0};
    refuse(spots, all, "green");
    spots[4].xyz[VIEW_GREEN].Y = NAN;
    refuse(spots, all, "green");
    plan(spots, 15, 45, 6, true);
    spots[0].xyz[VIEW_BLUE] = spots[0].xyz[VIEW_RED];
    refuse(spots, all, "primaries");
}

static void a_journal_that_is_cut_short_names_what_is_missing(void **state)
{
    (void)state;
    char path[] = "/tmp/view-journal-XXXXXX";
    FILE *file = fdopen(mkstemp(path), "w");
    fputs(
        "{\"journal\":\"display view\",\"model\":\"d.ini\"}\n"
        "{\"spot\":0,\"patch\":0,\"uv\":[0,0],\"place\":[0.5,0.5],\"reading\":{\"XYZ\":[1,2,3]}}\n",
        file);
    fclose(file);
    struct view_measured m;
    struct error err;
    assert_false(view_from_journal(path, &m, &err));
    assert_non_null(strstr(err.text, "green"));
    unlink(path);
    assert_false(view_from_journal(path, &m, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(another_law_is_met_between_the_measured_directions),
        cmocka_unit_test(places_may_be_left_out),
        cmocka_unit_test(readings_that_decide_nothing_are_refused_with_the_reason),
        cmocka_unit_test(a_journal_that_is_cut_short_names_what_is_missing),
    };
    return cmocka_run_group_tests_name("view fit", tests, NULL, NULL);
}
