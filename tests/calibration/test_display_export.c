// SPDX-License-Identifier: Apache-2.0
// Exported models as other software reads them: lcms2 evaluates the profile, a
// reader of our own the .cube.
#include <lcms2.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>
#undef fail // ours is a function

#include "calibration/display_export.h"

// 33 nodes a side, interpolated by lcms2 in 16 bits, CIEDE2000.
static const double FORWARD_MEAN = 0.05, FORWARD_MOST = 0.6;
// 41 nodes over all of CIELAB: coarse where the gamut's surface cuts a cell.
static const double INVERSE_MEAN = 0.5;
static const double CUBE_NODE = 1e-6; // digits of the file

static struct display_model *model;
static char path[] = "/tmp/export-XXXXXX";
static uint64_t seed = 7;

static double uniform(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 9007199254740992.0;
}

// A wide-gamut panel, black 0.3 cd/m2, white not D65.
static int open_model(void **state)
{
    (void)state;
    static const double matrix[3][4] = {
        {243, 125, 90, 0.3}, {114, 346, 40, 0.3}, {0.5, 22, 500, 0.4}};
    model = calloc(1, sizeof *model);
    strcpy(model->name, "made up for tests");
    memcpy(model->matrix, matrix, sizeof matrix);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < DISPLAY_NODES; k++)
            model->curve[c][k] = 0.99 * pow(k / 1020.0, 2.1 + 0.1 * c) + 0.01 * k / 1020.0;
    close(mkstemp(path));
    return display_model_prepare(model, NULL) ? 0 : -1;
}

static int close_model(void **state)
{
    (void)state;
    free(model);
    return unlink(path);
}

// Relative to white by Bradford, as lcms2 itself adapts.
static struct lab expected(struct counts c)
{
    struct xyz w = display_forward(model, (struct counts){1, 1, 1}), v = display_forward(model, c);
    cmsCIEXYZ white = {w.X / w.Y, 1, w.Z / w.Y}, in = {v.X / w.Y, v.Y / w.Y, v.Z / w.Y}, out;
    cmsCIELab lab;
    cmsAdaptToIlluminant(&out, &white, cmsD50_XYZ(), &in);
    cmsXYZ2Lab(NULL, &lab, &out);
    return (struct lab){lab.L, lab.a, lab.b};
}

static void the_profile_says_what_the_model_says(void **state)
{
    (void)state;
    struct error err;
    assert_true(display_export_icc(model, path, &err));
    cmsHPROFILE profile = cmsOpenProfileFromFile(path, "r"), lab = cmsCreateLab4Profile(NULL);
    assert_non_null(profile);
    assert_float_equal(cmsGetProfileVersion(profile), 4.3, 1e-6);
    const cmsCIEXYZ *luminance = cmsReadTag(profile, cmsSigLuminanceTag);
    assert_float_equal(luminance->Y, display_forward(model, (struct counts){1, 1, 1}).Y, 0.01);
    cmsHTRANSFORM there = cmsCreateTransform(profile, TYPE_RGB_DBL, lab, TYPE_Lab_DBL,
                                             INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE);
    cmsHTRANSFORM back = cmsCreateTransform(lab, TYPE_Lab_DBL, profile, TYPE_RGB_DBL,
                                            INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE);
    double sum = 0, most = 0, around = 0;
    enum { COUNT = 1000 };
    for (int i = 0; i < COUNT; i++) {
        double rgb[3] = {uniform(), uniform(), uniform()}, again[3];
        cmsCIELab got;
        cmsDoTransform(there, rgb, &got, 1);
        cmsDoTransform(back, &got, again, 1);
        struct lab is = expected((struct counts){rgb[0], rgb[1], rgb[2]});
        double de = delta_e_2000((struct lab){got.L, got.a, got.b}, is);
        sum += de / COUNT;
        most = fmax(most, de);
        around += delta_e_2000(expected((struct counts){again[0], again[1], again[2]}), is) / COUNT;
    }
    print_message("profile: mean %.3f, largest %.3f; there and back: mean %.3f\n", sum, most,
                  around);
    assert_true(sum < FORWARD_MEAN && most < FORWARD_MOST && around < INVERSE_MEAN);
    cmsDeleteTransform(there);
    cmsDeleteTransform(back);
    cmsCloseProfile(profile);
    cmsCloseProfile(lab);
}

static void white_is_the_white_of_the_connection_space(void **state)
{
    (void)state;
    struct error err;
    assert_true(display_export_icc(model, path, &err));
    cmsHPROFILE profile = cmsOpenProfileFromFile(path, "r"), lab = cmsCreateLab4Profile(NULL);
    cmsHTRANSFORM there = cmsCreateTransform(profile, TYPE_RGB_DBL, lab, TYPE_Lab_DBL,
                                             INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOOPTIMIZE);
    double rgb[3] = {1, 1, 1};
    cmsCIELab got;
    cmsDoTransform(there, rgb, &got, 1);
    assert_float_equal(got.L, 100, 0.01);
    assert_float_equal(got.a, 0, 0.02);
    assert_float_equal(got.b, 0, 0.02);
    cmsDeleteTransform(there);
    cmsCloseProfile(profile);
    cmsCloseProfile(lab);
}

static void the_cube_turns_srgb_into_counts_that_give_it(void **state)
{
    (void)state;
    enum { SIDE = 5 };
    struct error err;
    double scale = 0, r, g, b;
    char line[256];
    assert_true(display_export_cube(model, SIDE, path, &scale, &err));
    assert_true(scale > 0.5 && scale < 1); // this white is not D65
    FILE *in = fopen(path, "r");
    int nodes = 0;
    while (fgets(line, sizeof line, in))
        if (sscanf(line, "%lf %lf %lf", &r, &g, &b) == 3) {
            assert_true(r >= 0 && r <= 1 && g >= 0 && g <= 1 && b >= 0 && b <= 1);
            if (nodes++ != SIDE * SIDE * SIDE - 1)
                continue;
            struct xyz white = display_forward(model, (struct counts){r, g, b});
            assert_float_equal(xy_of(white).x, 0.3127, 1e-4); // IEC 61966-2-1
            assert_float_equal(xy_of(white).y, 0.3290, 1e-4);
            assert_float_equal(fmax(r, fmax(g, b)), 1, CUBE_NODE);
        }
    assert_int_equal(nodes, SIDE * SIDE * SIDE);
    fclose(in);
    assert_false(display_export_cube(model, 1, path, &scale, &err));
    assert_int_equal(err.code, ERROR_RANGE);
}

static void nothing_half_written_is_left(void **state)
{
    (void)state;
    struct error err;
    assert_false(display_export_icc(model, "/nowhere/x.icc", &err));
    assert_false(display_export_cube(model, 3, "/nowhere/x.cube", NULL, &err));
    assert_non_null(strstr(err.text, "/nowhere"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_profile_says_what_the_model_says),
        cmocka_unit_test(white_is_the_white_of_the_connection_space),
        cmocka_unit_test(the_cube_turns_srgb_into_counts_that_give_it),
        cmocka_unit_test(nothing_half_written_is_left),
    };
    return cmocka_run_group_tests_name("display export", tests, open_model, close_model);
}
