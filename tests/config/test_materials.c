// SPDX-License-Identifier: Apache-2.0
// Materials on disk, and every way of getting them wrong.
#include "tests/fakes/support.h"

#include "colorimetry/illuminant.h"
#include "config/materials.h"
#include "files/exr.h"
#include "tests/fakes/folder.h"

static const double EXACT = 1e-12;

static struct folder here;
static struct booth_settings booth;

static int open_here(void **state)
{
    (void)state;
    folder_open(&here);
    snprintf(booth.materials.folder, sizeof booth.materials.folder, "%s", here.path);
    folder_put(&here, "two.csv",
               "nm,red,blue\n380,.1,.5\n420,.1,.5\n450,.1,.5\n480,.1,.4\n520,.1,.4\n560,.2,.3\n"
               "600,.6,.2\n640,.7,.1\n670,.8,.1\n700,.8,.1\n780,.8,.1\n");
    return 0;
}

static int close_here(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

static bool load(const char *text, struct material *out, struct error *err)
{
    folder_put(&here, "m.ini", text);
    return material_load(&booth, "m", out, err);
}

static void load_well(const char *text, struct material *out)
{
    struct error err = {0};
    if (!load(text, out, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
}

static void a_flat_material_has_its_reflectance_everywhere(void **state)
{
    (void)state;
    struct material m;
    load_well("[material]\nname = half\nkind = flat\nreflectance = 0.5\nwidth_m = 0.1\n", &m);
    assert_string_equal(m.name, "half");
    assert_int_equal(m.palette_count, 1);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        assert_near(m.palette[0].v[i], 0.5, EXACT);
    assert_near(m.width_m, 0.1, EXACT);
    material_fini(&m);
}

static void a_chart_shows_its_spectra_with_a_background_by_name_or_number(void **state)
{
    (void)state;
    struct material m;
    load_well("[material]\nname = c\nkind = chart\nsource = two.csv\ncolumns = 2\nrows = 1\n"
              "gap = 0.2\nbackground = blue\n",
              &m);
    assert_int_equal(m.palette_count, 2);
    assert_int_equal(m.index[0], 1); // the gap at the top left is blue
    assert_string_equal(m.palette_names[0], "red");
    material_fini(&m);
    load_well("[material]\nname = c\nkind = chart\nsource = two.csv\ncolumns = 2\nrows = 1\n"
              "gap = 0.2\nbackground = 0.18\n",
              &m);
    assert_near(m.palette[m.index[0]].v[100], 0.18, EXACT);
    material_fini(&m);
}

static void a_patch_of_a_chart_is_a_uniform_surface(void **state)
{
    (void)state;
    struct material m, patch;
    struct error err = {0};
    load_well("[material]\nname = c\nkind = chart\nsource = two.csv\ncolumns = 2\n", &m);
    assert_true(material_patch(&m, "blue", &patch, &err));
    assert_int_equal(patch.palette_count, 1);
    assert_near(patch.palette[0].v[560 - SPECTRUM_FIRST_NM], 0.3, 1e-6);
    material_fini(&patch);
    assert_false(material_patch(&m, "green", &patch, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_holds(err.text, "green");
    assert_holds(err.text, "red, blue");
    material_fini(&m);
}

static void a_material_is_found_by_path_too(void **state)
{
    (void)state;
    struct material m;
    struct booth_settings elsewhere = {0};
    const char *path = folder_put(&here, "m.ini", "[material]\nname = w\nkind = flat\n");
    assert_true(material_load(&elsewhere, path, &m, NULL));
    assert_string_equal(m.name, "w");
    material_fini(&m);
}

static void band_coefficients_come_from_an_image(void **state)
{
    (void)state;
    struct exr image;
    struct material m;
    assert_true(exr_init(&image, 4, 3, 6, NULL));
    for (int c = 0; c < 6; c++) {
        snprintf(image.names[c], sizeof image.names[c], "band%d", c);
        for (int i = 0; i < 12; i++)
            image.pixels[c * 12 + i] = 0.1f * (float)c;
    }
    assert_true(exr_save(folder_at(&here, "b.exr"), &image, NULL));
    exr_fini(&image);
    load_well("[material]\nname = b\nkind = bands\nsource = b.exr\n", &m);
    assert_int_equal(m.width, 4);
    assert_int_equal(m.bands.count, 6);
    assert_near(m.coefficients[5 * 12], 0.5, 1e-6);
    material_fini(&m);
}

static void every_bad_material_is_named(void **state)
{
    (void)state;
    folder_put(&here, "loud.csv", "nm,x\n380,0.5\n780,80\n");
    folder_put(&here, "back.csv", "nm,x\n780,0.5\n380,0.4\n");
    static const struct {
        const char *text, *parts[3];
    } bad[] = {
        {"[material]\nkind = flat\n", {"m.ini", "name", "must be given"}},
        {"[material]\nname = x\n", {"m.ini", "kind", "must be given"}},
        {"[material]\nname = x\nkind = foil\n", {"m.ini:3", "foil", "chart, flat, bands"}},
        {"[material]\nname = x\nkind = flat\nreflectance = 1.5\n", {"m.ini:4", "1.5", "0..1"}},
        {"[material]\nname = x\nkind = flat\nsource = two.csv\n", {"m.ini", "source", "2 spectra"}},
        {"[material]\nname = x\nkind = flat\nsource = no.csv\n", {"m.ini", "no.csv", ""}},
        {"[material]\nname = x\nkind = flat\nsource = loud.csv\n", {"loud.csv:3", "80", "-0.02..1.3"}},
        {"[material]\nname = x\nkind = flat\nsource = back.csv\n", {"back.csv", "", ""}},
        {"[material]\nname = x\nkind = chart\n", {"m.ini", "source", "table of spectra"}},
        {"[material]\nname = x\nkind = chart\nsource = two.csv\ncolumns = 2\nrows = 2\n",
         {"m.ini", "2 x 2", "2 spectra"}},
        {"[material]\nname = x\nkind = chart\nsource = two.csv\ngap = 0.7\n",
         {"m.ini:5", "gap", "0..0.5"}},
        {"[material]\nname = x\nkind = chart\nsource = two.csv\nbackground = grey\n",
         {"m.ini", "background", "grey"}},
        {"[material]\nname = x\nkind = bands\n", {"m.ini", "source", "EXR"}},
        {"[material]\nname = x\nkind = bands\nsource = two.csv\n", {"m.ini", "two.csv", ""}},
        {"[metal]\nname = x\n", {"m.ini:1", "metal", "material"}},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct material m;
        struct error err = {0};
        assert_false(load(bad[i].text, &m, &err));
        for (int k = 0; k < 3; k++)
            assert_holds(err.text, bad[i].parts[k]);
    }
}

static void an_unknown_material_lists_what_there_is(void **state)
{
    (void)state;
    struct material m;
    struct error err = {0};
    folder_put(&here, "m.ini", "[material]\nname = w\nkind = flat\n");
    assert_false(material_load(&booth, "nothing", &m, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_holds(err.text, "nothing");
    assert_holds(err.text, "there is: m");
}

static void the_shipped_materials_load_and_bake(void **state)
{
    (void)state;
    static const char *const names[] = {"white", "grey18", "colorchecker24"};
    struct booth_settings shipped = {0};
    struct spectrum d65;
    strcpy(shipped.materials.folder, "config/materials");
    assert_true(illuminant("D65", &d65, NULL));
    for (size_t i = 0; i < 3; i++) {
        struct material m;
        struct xyz white;
        struct error err = {0};
        if (!material_load(&shipped, names[i], &m, &err))
            print_error("%s\n", err.text);
        assert_int_equal(err.code, ERROR_NONE);
        float *texels = material_bake(&m, &d65, OBSERVER_1931_2, SPECTRAL_AUTO, NULL, &white, &err);
        assert_non_null(texels);
        assert_near(white.Y, 1, 1e-9);
        if (i < 2)
            assert_near(texels[1], i ? 0.18 : 1, 1e-6); // floats
        free(texels);
        assert_int_equal(m.palette_count, i < 2 ? 1 : 24);
        material_fini(&m);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flat_material_has_its_reflectance_everywhere),
        cmocka_unit_test(a_chart_shows_its_spectra_with_a_background_by_name_or_number),
        cmocka_unit_test(a_patch_of_a_chart_is_a_uniform_surface),
        cmocka_unit_test(a_material_is_found_by_path_too),
        cmocka_unit_test(band_coefficients_come_from_an_image),
        cmocka_unit_test(every_bad_material_is_named),
        cmocka_unit_test(an_unknown_material_lists_what_there_is),
        cmocka_unit_test(the_shipped_materials_load_and_bake),
    };
    return cmocka_run_group_tests(tests, open_here, close_here);
}
