// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include "tests/render/support.h"

#include "colorimetry/illuminant.h"
#include "render/material.h"

// Baked texels are single precision.
static const double TEXEL = 1e-6;

enum { ENTRIES = 7 };
static struct spectrum palette[ENTRIES];
static char names[ENTRIES][64];
static struct spectrum lamp;

// Greys of 0.9, 0.6, 0.3, three coloured edges, and a perfect diffuser.
static int make_palette(void **state)
{
    (void)state;
    struct error err = {0};
    for (int i = 0; i < ENTRIES; i++) {
        snprintf(names[i], sizeof names[i], "patch %d", i);
        for (int k = 0; k < SPECTRUM_COUNT; k++) {
            double nm = SPECTRUM_FIRST_NM + k, edge = 1 / (1 + exp((460 + 40 * i - nm) / 15));
            palette[i].v[k] = i < 3 ? 0.9 - 0.3 * i : i == ENTRIES - 1 ? 1 : 0.05 + 0.8 * edge;
        }
    }
    return illuminant("FL8", &lamp, &err) ? 0 : -1;
}

static struct material chart(int columns, int rows, double gap, int background)
{
    struct material m;
    struct error err = {0};
    assert_good(
        material_chart("chart", palette, names, ENTRIES, columns, rows, gap, background, &m, &err),
        err);
    return m;
}

static float *bake(const struct material *m, enum spectral_mode mode, int bands, struct xyz *white)
{
    struct error err = {0};
    struct band_set set;
    assert_true(!bands || band_set_shipped(bands, &set, NULL));
    float *texels =
        material_bake(m, &lamp, OBSERVER_1931_2, mode, bands ? &set : NULL, white, &err);
    assert_good(texels, err);
    return texels;
}

static void a_chart_has_its_patches_in_reading_order_with_gaps_around(void **state)
{
    (void)state;
    struct material m = chart(3, 2, 0.1, 6);
    assert_int_equal(m.width, 3 * 100 + 4 * 10);
    assert_int_equal(m.height, 2 * 100 + 3 * 10);
    assert_int_equal(m.index[0], 6);
    for (int row = 0; row < 2; row++)
        for (int column = 0; column < 3; column++) {
            int left = 10 + 110 * column, top = 10 + 110 * row;
            int corners[4][2] = {
                {left, top}, {left + 99, top}, {left, top + 99}, {left + 99, top + 99}};
            for (int i = 0; i < 4; i++)
                assert_int_equal(m.index[corners[i][1] * m.width + corners[i][0]],
                                 3 * row + column);
            assert_int_equal(m.index[top * m.width + left + 100], 6);
            assert_int_equal(m.index[(top + 100) * m.width + left], 6);
        }
    assert_string_equal(m.palette_names[4], "patch 4");
    material_fini(&m);
}

static void a_chart_without_gap_is_all_patches(void **state)
{
    (void)state;
    struct material m = chart(2, 2, 0, 0);
    assert_int_equal(m.width, 200);
    for (int y = 0; y < 200; y++)
        for (int x = 0; x < 200; x++)
            assert_int_equal(m.index[y * 200 + x], 2 * (y / 100) + x / 100);
    material_fini(&m);
}

static void charts_that_cannot_be_are_refused(void **state)
{
    (void)state;
    struct material m;
    struct error err = {0};
    struct spectrum broken = palette[0];
    broken.v[100] = NAN;
    assert_false(material_chart("c", palette, names, ENTRIES, 4, 2, 0.1, 0, &m, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_false(material_chart("c", palette, names, ENTRIES, 70000, 70000, 0.1, 0, &m, &err));
    assert_false(material_chart("c", palette, names, ENTRIES, 2, 2, 0.6, 0, &m, &err));
    assert_false(material_chart("c", palette, names, ENTRIES, 2, 2, NAN, 0, &m, &err));
    assert_false(material_chart("c", palette, names, ENTRIES, 2, 2, 0.1, 7, &m, &err));
    assert_false(material_chart("c", palette, names, 0, 1, 1, 0.1, 0, &m, &err));
    assert_false(material_flat("c", &broken, &m, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "460 nm"));
}

static void the_longest_chart_still_fits_the_texel_limit(void **state)
{
    (void)state;
    struct spectrum *many = calloc(256, sizeof *many);
    struct material m;
    struct error err = {0};
    assert_good(material_chart("long", many, NULL, 256, 256, 1, 0.5, 0, &m, &err), err);
    assert_true(m.width <= 8192 && m.width >= 256 * 10);
    material_fini(&m);
    free(many);
}

static void the_perfect_diffuser_bakes_to_white_with_y_1_in_every_mode(void **state)
{
    (void)state;
    struct material m;
    struct error err = {0};
    static const enum spectral_mode modes[] = {SPECTRAL_AUTO, SPECTRAL_FULL, SPECTRAL_BANDS,
                                               SPECTRAL_PRODUCT};
    assert_good(material_flat("white", &palette[ENTRIES - 1], &m, &err), err);
    for (int i = 0; i < 4; i++) {
        struct xyz white;
        float *texels = bake(&m, modes[i], BANDS_SHIPPED, &white);
        assert_relative(texels[0], white.X, TEXEL);
        assert_relative(texels[1], 1, 1e-6);
        assert_relative(texels[2], white.Z, TEXEL);
        assert_relative(white.Y, 1, 1e-9);
        free(texels);
    }
    material_fini(&m);
}

static void full_mode_bakes_each_patch_to_its_exact_tristimulus_values(void **state)
{
    (void)state;
    struct material m = chart(3, 2, 0.1, 6);
    struct xyz white;
    float *texels = bake(&m, SPECTRAL_AUTO, 0, &white);
    for (int i = 0; i < m.width * m.height; i += 173) {
        struct xyz c = xyz_relative(&lamp, &palette[m.index[i]], OBSERVER_1931_2);
        assert_relative(texels[3 * i], c.X / 100, TEXEL);
        assert_relative(texels[3 * i + 1], c.Y / 100, TEXEL);
        assert_relative(texels[3 * i + 2], c.Z / 100, TEXEL);
    }
    free(texels);
    material_fini(&m);
}

static void bands_come_close_to_full_spectra_and_more_of_them_closer(void **state)
{
    (void)state;
    struct material m = chart(3, 2, 0, 0);
    double error[2];
    for (int k = 0; k < 2; k++) {
        struct xyz white, same;
        float *full = bake(&m, SPECTRAL_FULL, 0, &white);
        float *bands = bake(&m, SPECTRAL_BANDS, k ? 16 : 3, &same);
        error[k] = 0;
        for (int i = 0; i < 3 * m.width * m.height; i++)
            error[k] = fmax(error[k], fabs(full[i] - bands[i]));
        free(full);
        free(bands);
    }
    print_message("greatest error of relative XYZ: 3 bands %.4f, 16 bands %.4f\n", error[0],
                  error[1]);
    assert_true(error[1] < 0.25 * error[0]);
    assert_true(error[1] < 0.01);
    material_fini(&m);
}

static void a_dark_lamp_and_bands_that_nobody_named_are_refused(void **state)
{
    (void)state;
    struct material m = chart(2, 2, 0, 0);
    struct spectrum dark = {{0}};
    struct xyz white;
    struct error err = {0};
    assert_null(material_bake(&m, &dark, OBSERVER_1931_2, SPECTRAL_FULL, NULL, &white, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_null(material_bake(&m, &lamp, OBSERVER_1931_2, SPECTRAL_BANDS, NULL, &white, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    material_fini(&m);
}

// ---- EXR -------------------------------------------------------------------

static char path[64];

// Four texels of one row: black, grey 0.5, white, and the first coloured patch.
static struct exr band_image(const struct band_set *set)
{
    struct exr image;
    struct error err = {0};
    struct bands colour = bands_of(set, &palette[3]);
    assert_good(exr_init(&image, 4, 1, set->count, &err), err);
    for (int j = 0; j < set->count; j++) {
        snprintf(image.names[j], sizeof image.names[j], "band%d", j);
        float *plane = image.pixels + 4 * j;
        plane[1] = 0.5f;
        plane[2] = 1;
        plane[3] = (float)colour.v[j];
    }
    return image;
}

static void save(const struct exr *image)
{
    struct error err = {0};
    snprintf(path, sizeof path, "/tmp/boothd-material-%d.exr", (int)getpid());
    assert_good(exr_save(path, image, &err), err);
}

static int remove_file(void **state)
{
    (void)state;
    unlink(path);
    return 0;
}

static void bands_from_an_image_bake_like_the_surfaces_they_stand_for(void **state)
{
    (void)state;
    struct band_set set;
    struct error err = {0};
    struct material m;
    struct xyz white, flat_white;
    assert_good(band_set_shipped(BANDS_SHIPPED, &set, &err), err);
    struct exr image = band_image(&set);
    save(&image);
    exr_fini(&image);
    assert_good(material_from_exr("image", path, &m, &err), err);
    assert_int_equal(m.bands.count, BANDS_SHIPPED);
    float *texels = bake(&m, SPECTRAL_AUTO, 0, &white);
    struct material flat;
    assert_good(material_flat("flat", &palette[3], &flat, &err), err);
    float *same = bake(&flat, SPECTRAL_BANDS, BANDS_SHIPPED, &flat_white);
    for (int c = 0; c < 3; c++) {
        double w = c == 0 ? white.X : c == 1 ? white.Y : white.Z;
        assert_float_within(texels[c], 0, TEXEL);
        assert_relative(texels[3 + c], w / 2, TEXEL);
        assert_relative(texels[6 + c], w, TEXEL);
        assert_relative(texels[9 + c], same[c], 1e-5);
    }
    free(texels);
    free(same);
    assert_null(material_bake(&m, &lamp, OBSERVER_1931_2, SPECTRAL_FULL, NULL, &white, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    material_fini(&flat);
    material_fini(&m);
}

static void an_image_may_bring_its_own_band_set_but_not_half_of_one(void **state)
{
    (void)state;
    struct band_set set;
    struct error err = {0};
    struct material m;
    static const double centre[4] = {430, 500, 570, 640}, width[4] = {30, 31, 32, 33};
    assert_good(band_set_make(4, centre, width, &set, &err), err);
    struct exr image = band_image(&set);
    for (int j = 0; j < 4; j++) {
        char name[64];
        snprintf(name, sizeof name, "boothd.centre_nm%d", j);
        exr_set_number(&image, name, centre[j]);
        snprintf(name, sizeof name, "boothd.width_nm%d", j);
        if (j < 3)
            exr_set_number(&image, name, width[j]);
    }
    save(&image);
    assert_false(material_from_exr("image", path, &m, &err));
    assert_int_equal(err.code, ERROR_DATA);
    exr_set_number(&image, "boothd.width_nm3", width[3]);
    save(&image);
    assert_good(material_from_exr("image", path, &m, &err), err);
    for (int j = 0; j < 4; j++) {
        assert_true(m.bands.centre_nm[j] == centre[j]);
        assert_true(m.bands.width_nm[j] == width[j]);
    }
    material_fini(&m);
    exr_fini(&image);
}

static void an_image_of_the_most_bands_brings_all_its_shapes(void **state)
{
    (void)state;
    struct band_set set;
    struct error err = {0};
    struct material m;
    double centre[BANDS_MOST], width[BANDS_MOST];
    for (int j = 0; j < BANDS_MOST; j++) {
        centre[j] = 400 + 20 * j;
        width[j] = 15 + 0.25 * j;
    }
    assert_good(band_set_make(BANDS_MOST, centre, width, &set, &err), err);
    struct exr image = band_image(&set);
    for (int j = 0; j < BANDS_MOST; j++) {
        char name[64];
        snprintf(name, sizeof name, "boothd.centre_nm%d", j);
        assert_true(exr_set_number(&image, name, centre[j]));
        snprintf(name, sizeof name, "boothd.width_nm%d", j);
        assert_true(exr_set_number(&image, name, width[j]));
    }
    save(&image);
    exr_fini(&image);
    assert_good(material_from_exr("image", path, &m, &err), err);
    assert_int_equal(m.bands.count, BANDS_MOST);
    assert_memory_equal(m.bands.centre_nm, centre, sizeof centre);
    assert_memory_equal(m.bands.width_nm, width, sizeof width);
    material_fini(&m);
}

static void an_image_without_bands_or_without_file_is_refused_by_name(void **state)
{
    (void)state;
    struct error err = {0};
    struct material m;
    struct exr image;
    assert_good(exr_init(&image, 2, 2, 1, &err), err);
    snprintf(image.names[0], sizeof image.names[0], "Y");
    save(&image);
    exr_fini(&image);
    assert_false(material_from_exr("image", path, &m, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, path));
    assert_false(material_from_exr("image", "/nowhere/bands.exr", &m, &err));
    assert_non_null(strstr(err.text, "/nowhere/bands.exr"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_chart_has_its_patches_in_reading_order_with_gaps_around),
        cmocka_unit_test(a_chart_without_gap_is_all_patches),
        cmocka_unit_test(charts_that_cannot_be_are_refused),
        cmocka_unit_test(the_longest_chart_still_fits_the_texel_limit),
        cmocka_unit_test(the_perfect_diffuser_bakes_to_white_with_y_1_in_every_mode),
        cmocka_unit_test(full_mode_bakes_each_patch_to_its_exact_tristimulus_values),
        cmocka_unit_test(bands_come_close_to_full_spectra_and_more_of_them_closer),
        cmocka_unit_test(a_dark_lamp_and_bands_that_nobody_named_are_refused),
        cmocka_unit_test(bands_from_an_image_bake_like_the_surfaces_they_stand_for),
        cmocka_unit_test(an_image_may_bring_its_own_band_set_but_not_half_of_one),
        cmocka_unit_test(an_image_of_the_most_bands_brings_all_its_shapes),
        cmocka_unit_test(an_image_without_bands_or_without_file_is_refused_by_name),
    };
    return cmocka_run_group_tests(tests, make_palette, remove_file);
}
