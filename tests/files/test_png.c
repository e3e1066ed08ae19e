// SPDX-License-Identifier: Apache-2.0
#include "tests/fakes/support.h"

#include <unistd.h>

#include "files/png.h"
#include "tests/fakes/folder.h"

static struct folder folder;

static int make(void **state)
{
    (void)state;
    folder_open(&folder);
    return 0;
}

static int clear(void **state)
{
    (void)state;
    folder_close(&folder);
    return 0;
}

static void a_picture_of_any_kind_comes_back_as_it_was(void **state)
{
    (void)state;
    const char *path = folder_at(&folder, "any.png");
    struct error err;
    for (int channels = 1; channels <= 3; channels += 2)
        for (int bits = 8; bits <= 16; bits += 8) {
            struct picture a, b;
            assert_true(picture_init(&a, 37, 11, channels, bits, &err));
            for (int i = 0; i < 37 * 11 * channels; i++)
                a.samples[i] = (uint16_t)((unsigned)i * 40503u >> (bits == 8 ? 8 : 0) &
                                          (bits == 8 ? 255u : 65535u));
            assert_true(png_save(path, &a, &err));
            assert_true(png_load(path, &b, &err));
            assert_int_equal(b.width, 37);
            assert_int_equal(b.height, 11);
            assert_int_equal(b.channels, channels);
            assert_int_equal(b.bits, bits);
            assert_memory_equal(a.samples, b.samples, 37u * 11u * (unsigned)channels * 2u);
            picture_fini(&a);
            picture_fini(&b);
        }
}

static void eight_bit_rgb_is_read_as_it_was_written(void **state)
{
    (void)state;
    const char *path = folder_at(&folder, "rgb.png");
    uint8_t rgb[4 * 2 * 3];
    struct picture b;
    struct error err;
    for (int i = 0; i < 24; i++)
        rgb[i] = (uint8_t)(i * 11);
    assert_true(png_save_rgb8(path, 4, 2, rgb, &err));
    assert_true(png_load(path, &b, &err));
    for (int i = 0; i < 24; i++)
        assert_int_equal(b.samples[i], rgb[i]);
    picture_fini(&b);
}

// One pixel, grey and alpha of 8 bits.
static const unsigned char WITH_ALPHA[] = {
    0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49,
    0x48, 0x44, 0x52, 0x00, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00, 0x01, 0x08, 0x04,
    0x00, 0x00, 0x00, 0xb5, 0x1c, 0x0c, 0x02, 0x00, 0x00, 0x00, 0x0b, 0x49, 0x44,
    0x41, 0x54, 0x78, 0xda, 0x63, 0x64, 0xf8, 0x0f, 0x00, 0x01, 0x05, 0x01, 0x01};

// A head whose check sum is wrong.
static const unsigned char FALSE_SUM[] = {0x89, 0x50, 0x4e,      0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00,
                                          0x00, 0x00, 0x0d,      0x49, 0x48, 0x44, 0x52, 0x00, 0x00,
                                          0x00, 0x02, 0x00,      0x00, 0x00, 0x01, 0x02, 0x00, 0x00,
                                          0x00, 0x00, /*CRC*/ 0, 0,    0,    0};

static void put_bytes(const char *path, const void *bytes, size_t size)
{
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    assert_int_equal(fwrite(bytes, 1, size, out), size);
    fclose(out);
}

static void refused(const char *path, enum error_code code, const char *says)
{
    struct picture image = {.width = 77};
    struct error err = {0};
    assert_false(png_load(path, &image, &err));
    if (err.code != code)
        print_error("%s\n", err.text);
    assert_int_equal(err.code, code);
    assert_holds(err.text, says);
    assert_int_equal(image.width, 77);
}

static void what_is_no_sound_png_is_refused(void **state)
{
    (void)state;
    char path[256];
    snprintf(path, sizeof path, "%s", folder_at(&folder, "bad.png"));
    refused(folder_at(&folder, "none.png"), ERROR_CONFIG, "none.png");
    put_bytes(path, "hello, this is text", 19);
    refused(path, ERROR_DATA, "PNG");
    put_bytes(path, "", 0);
    refused(path, ERROR_DATA, "ends too soon");
    put_bytes(path, WITH_ALPHA, sizeof WITH_ALPHA);
    refused(path, ERROR_DATA, "alpha");
    put_bytes(path, FALSE_SUM, sizeof FALSE_SUM);
    refused(path, ERROR_DATA, "CRC");
}

static void a_picture_cut_off_anywhere_is_refused_whole(void **state)
{
    (void)state;
    struct picture a;
    struct error err;
    unsigned char bytes[4096];
    char path[256];
    snprintf(path, sizeof path, "%s", folder_at(&folder, "whole.png"));
    assert_true(picture_init(&a, 20, 20, 3, 16, &err));
    for (int i = 0; i < 1200; i++)
        a.samples[i] = (uint16_t)(i * i);
    assert_true(png_save(path, &a, &err));
    picture_fini(&a);
    FILE *in = fopen(path, "r");
    size_t size = fread(bytes, 1, sizeof bytes, in);
    fclose(in);
    assert_true(size > 500 && size < sizeof bytes);
    for (size_t kept = 0; kept < size - 12; kept += 37) { // 12: the end chunk says nothing
        put_bytes(path, bytes, kept);
        refused(path, ERROR_DATA, "whole.png");
    }
}

static void sizes_that_are_not_allowed_are_refused(void **state)
{
    (void)state;
    struct picture a = {0};
    struct error err;
    assert_false(picture_init(&a, 0, 4, 1, 8, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_false(picture_init(&a, 16385, 4, 1, 8, &err));
    assert_false(picture_init(&a, 4, 4, 2, 8, &err));
    assert_false(picture_init(&a, 4, 4, 1, 12, &err));
    assert_null(a.samples);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_of_any_kind_comes_back_as_it_was),
        cmocka_unit_test(eight_bit_rgb_is_read_as_it_was_written),
        cmocka_unit_test(what_is_no_sound_png_is_refused),
        cmocka_unit_test(a_picture_cut_off_anywhere_is_refused_whole),
        cmocka_unit_test(sizes_that_are_not_allowed_are_refused),
    };
    return cmocka_run_group_tests(tests, make, clear);
}
