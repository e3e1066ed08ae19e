// SPDX-License-Identifier: Apache-2.0
// Every reader against files cut off at every byte and with bits turned over.
// Whatever comes: no crash, one line of error or sound data, nothing left half
// filled. The random numbers are the same in every run.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <math.h>

#include "files/cgats.h"
#include "files/exr.h"
#include "files/ini.h"
#include "tests/files/place.h"

enum { FLIPS = 1500 };

typedef void reader_attack(const char *bytes, size_t size);

static uint32_t seed;

static uint32_t random_below(uint32_t bound)
{
    seed = seed * 1664525 + 1013904223;
    return (uint64_t)seed * bound >> 32;
}

static void assert_one_line(const struct error *err)
{
    assert_int_not_equal(err->code, ERROR_NONE);
    assert_true(strlen(err->text) > 0);
    assert_null(strpbrk(err->text, "\r\n"));
}

static void attack_csv(const char *bytes, size_t size)
{
    struct table t;
    struct error err = {0};
    // Exactly size bytes, so that a read beyond them shows.
    char *exact = malloc(size ? size : 1);
    memcpy(exact, bytes, size);
    memset(&t, 0x55, sizeof t);
    if (csv_parse("t.csv", exact, size, &t, &err)) {
        assert_true(t.rows > 0 && t.columns > 0);
        for (size_t i = 0; i < t.rows * t.columns; i++)
            assert_true(isfinite(t.values[i]));
    } else {
        assert_one_line(&err);
        assert_null(t.values);
    }
    table_fini(&t);
    free(exact);
}

static void attack_cgats(const char *bytes, size_t size)
{
    struct cgats file;
    struct error err = {0};
    memset(&file, 0x55, sizeof file);
    if (cgats_load(put("t.ti3", bytes, size), &file, &err)) {
        assert_true(file.table.rows > 0 && file.table.columns > 0);
        for (size_t c = 0; c < file.table.columns; c++)
            for (size_t r = 0; strncmp(file.table.names[c], "SAMPLE", 6) && r < file.table.rows;
                 r++)
                assert_true(isfinite(table_at(&file.table, r, c)) ||
                            !strcmp(file.table.names[c], "STRING"));
    } else {
        assert_one_line(&err);
        assert_null(file.table.values);
        assert_null(file.keywords);
    }
    cgats_fini(&file);
}

struct screen {
    double width_m;
    int bits;
    char name[20];
    double eye_m[3];
};

static void attack_ini(const char *bytes, size_t size)
{
    static const struct setting ROWS[] = {
        {"width_m", SETTING_DOUBLE, SETTING_FIELD(struct screen, width_m), 0, 0.01, 10, "m", NULL,
         NULL, "Width."},
        {"bits", SETTING_INT, SETTING_FIELD(struct screen, bits), 0, 6, 16, "", NULL, "8",
         "Depth."},
        {"name", SETTING_TEXT, SETTING_FIELD(struct screen, name),
         SETTING_SIZE(struct screen, name), 0, 0, "", NULL, "panel", "Name."},
        {"eye_m", SETTING_VECTOR, SETTING_FIELD(struct screen, eye_m), 3, -5, 5, "m", NULL,
         "0 0.55 0.65", "Eye."},
        {0}};
    struct screen screen = {0};
    struct error err = {0};
    const struct settings_section sections[] = {{"screen", ROWS, &screen}, {0}};
    if (ini_load(put("t.ini", bytes, size), sections, &err)) {
        assert_true(screen.width_m >= 0.01 && screen.width_m <= 10);
        assert_in_range(screen.bits, 6, 16);
        assert_true(strlen(screen.name) < sizeof screen.name);
        for (int i = 0; i < 3; i++)
            assert_true(fabs(screen.eye_m[i]) <= 5);
    } else {
        assert_one_line(&err);
    }
}

static void attack_exr(const char *bytes, size_t size)
{
    struct exr image;
    struct error err = {0};
    memset(&image, 0x55, sizeof image);
    if (exr_load(put("t.exr", bytes, size), &image, &err)) {
        size_t count = (size_t)image.width * image.height * image.channels;
        for (size_t i = 0; i < count; i++)
            assert_true(isfinite(image.pixels[i]));
        for (int c = 0; c < image.channels; c++)
            assert_int_equal(exr_channel(&image, image.names[c]), c);
    } else {
        assert_one_line(&err);
        assert_null(image.pixels);
    }
    exr_fini(&image);
}

static void cut(const char *bytes, size_t size, size_t step, reader_attack *attack)
{
    for (size_t kept = 0; kept <= size; kept += step)
        attack(bytes, kept);
}

// Turns over 1..4 bits, and now and then a whole byte, at a time.
static void flip(const char *bytes, size_t size, int count, reader_attack *attack)
{
    char *spoilt = malloc(size);
    seed = 20040401;
    for (int i = 0; i < count; i++) {
        memcpy(spoilt, bytes, size);
        for (uint32_t n = random_below(4) + 1; n; n--)
            spoilt[random_below(size)] ^= 1 << random_below(8);
        if (i % 5 == 0)
            spoilt[random_below(size)] = random_below(256);
        attack(spoilt, size);
    }
    free(spoilt);
}

// Takes out or doubles a stretch.
static void cut_and_paste(const char *bytes, size_t size, int count, reader_attack *attack)
{
    char *spoilt = malloc(2 * size);
    seed = 19991231;
    for (int i = 0; i < count; i++) {
        size_t from = random_below(size), to = from + random_below(size - from);
        size_t again = i % 2 ? from : to, rest = i % 2 ? to : from;
        memcpy(spoilt, bytes, rest);
        memcpy(spoilt + rest, bytes + again, size - again);
        attack(spoilt, rest + size - again);
    }
    free(spoilt);
}

static void attack_text(const char *text, reader_attack *attack)
{
    size_t size = strlen(text);
    attack(text, size);
    cut(text, size, 1, attack);
    flip(text, size, FLIPS, attack);
    cut_and_paste(text, size, FLIPS / 2, attack);
}

static void tables_stand(void **state)
{
    (void)state;
    attack_text("# lamp\n\"nm\",dark skin,E\n380,0.5,1e-3\n390,-.25,1e308\r\n\n400,+2.,3\n",
                attack_csv);
    attack_text("\xef\xbb\xbfnm;\xc2\xb5W\n380;0.5\n390;1\n", attack_csv);
    attack_text("380 0.5\t1\n390 1\t 2\n400\t1 3\n", attack_csv);
}

static void cgats_files_stand(void **state)
{
    (void)state;
    attack_text("CTI3   \n\nDESCRIPTOR \"a \"\"b\"\" \xc2\xa9\" # c\nKEYWORD \"WHITE\"\n"
                "WHITE \"95 100 108\"\nBEGIN_X_ARGS\n-v \"y\nEND_X_ARGS\nNUMBER_OF_FIELDS 4\n"
                "BEGIN_DATA_FORMAT\nSAMPLE_ID RGB_R RGB_G RGB_B\nEND_DATA_FORMAT\n"
                "NUMBER_OF_SETS 3\nBEGIN_DATA\n1 0 50 100\n2 1e1\n60.5 -1\n\"3 b\" 1 2 3\n"
                "END_DATA\nCAL\nNUMBER_OF_FIELDS 1\nBEGIN_DATA_FORMAT\nRGB_I\nEND_DATA_FORMAT\n"
                "NUMBER_OF_SETS 2\nBEGIN_DATA\n0 1\nEND_DATA\n",
                attack_cgats);
}

static void settings_files_stand(void **state)
{
    (void)state;
    attack_text("\xef\xbb\xbf# booth\n[screen]\nwidth_m = 0.52\r\n; depth\n  bits: 10\n"
                "name = EIZO CG ; #1 \xc3\xa9\neye_m = 0 0.55\t-0.65\n",
                attack_ini);
}

static char *an_image(size_t *size)
{
    struct exr image;
    assert_true(exr_init(&image, 29, 37, 2, NULL));
    strcpy(image.names[0], "Y");
    strcpy(image.names[1], "X");
    seed = 5;
    for (int i = 0; i < 29 * 37 * 2; i++)
        image.pixels[i] = random_below(1000) / 64.0f;
    exr_set_number(&image, "boothd.width_m", 0.9);
    exr_set_text(&image, "boothd.lamp", "D50");
    assert_true(exr_save(at("good.exr"), &image, NULL));
    exr_fini(&image);
    return take(at("good.exr"), size);
}

static void images_stand(void **state)
{
    (void)state;
    size_t size, head = 400;
    char *bytes = an_image(&size);
    attack_exr(bytes, size);
    cut(bytes, head, 1, attack_exr);
    cut(bytes, size, 61, attack_exr);
    flip(bytes, size, FLIPS, attack_exr);
    // The header is a small part of the file, and the part that is trusted.
    char *spoilt = malloc(size);
    seed = 77;
    for (int i = 0; i < FLIPS; i++) {
        memcpy(spoilt, bytes, size);
        spoilt[random_below(head)] ^= 1 << random_below(8);
        attack_exr(spoilt, size);
    }
    cut_and_paste(bytes, size, FLIPS / 4, attack_exr);
    free(spoilt);
    free(bytes);
}

// The other lossless compressions, which only other programs write: the data
// stays as deflate made it, under a name that does not fit.
static void images_under_a_wrong_compression_stand(void **state)
{
    (void)state;
    const char mark[] = "compression\0compression\0\x01\0\0";
    size_t size;
    char *bytes = an_image(&size), *found = memmem(bytes, size, mark, sizeof mark);
    assert_non_null(found);
    for (char compression = 0; compression < 12; compression++) {
        found[sizeof mark] = compression;
        attack_exr(bytes, size);
        flip(bytes, size, 60, attack_exr);
    }
    free(bytes);
}

static void real_files_stand(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        reader_attack *attack;
        int count;
    } REAL[] = {{"displays/samsung-20200831.ti3", attack_cgats, 300},
                {"displays/gpdwin-201906141510.test.ti3", attack_cgats, 100},
                {"lamps/TruluxPlus.sp", attack_cgats, 300},
                {"lamps/Philips.FT.TLD.36W.965.csv", attack_csv, 300},
                {"hdr/XYZ.exr", attack_exr, 25}};
    for (size_t i = 0; i < sizeof REAL / sizeof *REAL; i++) {
        size_t size;
        const char *path = shared_file(REAL[i].name);
        char *bytes = take(path, &size);
        REAL[i].attack(bytes, size);
        cut(bytes, size, size / 40 + 1, REAL[i].attack);
        flip(bytes, size, REAL[i].count, REAL[i].attack);
        free(bytes);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_stand),
        cmocka_unit_test(cgats_files_stand),
        cmocka_unit_test(settings_files_stand),
        cmocka_unit_test(images_stand),
        cmocka_unit_test(images_under_a_wrong_compression_stand),
        cmocka_unit_test(real_files_stand),
    };
    return cmocka_run_group_tests_name("attack", tests, open_place, close_place);
}
