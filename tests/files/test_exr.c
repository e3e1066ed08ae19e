// SPDX-License-Identifier: Apache-2.0
// Images of kinds that exr_save never writes are made here with the library.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <float.h>
#include <math.h>
#include <openexr.h>

#include "files/exr.h"
#include "tests/files/place.h"

enum { W = 37, H = 45 };

static float noise(uint32_t *seed)
{
    *seed = *seed * 1664525 + 1013904223;
    return ldexpf(*seed / 4294967296.0f, (int)(*seed % 60) - 30);
}

static void fill(struct exr *image, int width, int height, const char *const *names)
{
    int channels = 0;
    while (names[channels])
        channels++;
    uint32_t seed = 1;
    assert_true(exr_init(image, width, height, channels, NULL));
    for (int c = 0; c < channels; c++)
        strcpy(image->names[c], names[c]);
    for (int i = 0; i < width * height * channels; i++)
        image->pixels[i] = noise(&seed);
}

static void assert_same_pixels(const struct exr *a, const struct exr *b)
{
    size_t plane = (size_t)a->width * a->height;
    assert_int_equal(a->width, b->width);
    assert_int_equal(a->height, b->height);
    assert_int_equal(a->channels, b->channels);
    for (int c = 0; c < a->channels; c++) {
        int other = exr_channel(b, a->names[c]);
        assert_true(other >= 0);
        assert_memory_equal(a->pixels + c * plane, b->pixels + other * plane,
                            plane * sizeof(float));
    }
}

static void an_image_comes_back_to_the_last_bit_with_its_attributes(void **state)
{
    (void)state;
    static const char *const NAMES[] = {"Z", "Y", "X", "S0.407,000000nm", NULL};
    struct exr image, back;
    struct error err = {0};
    double value = 0;
    fill(&image, W, H, NAMES);
    image.pixels[0] = -0.0f;
    image.pixels[1] = FLT_MAX;
    image.pixels[2] = -FLT_TRUE_MIN;
    exr_set_number(&image, "boothd.width_m", 0.9);
    exr_set_number(&image, "boothd.depth_m", 1.0 / 3);
    exr_set_number(&image, "boothd.width_m", 0.1);
    exr_set_text(&image, "boothd.lamp", "D50 \xc2\xb0");
    exr_set_text(&image, "boothd.a_name_of_more_than_31_characters", "");
    assert_true(exr_save(at("a.exr"), &image, &err));
    assert_true(exr_load(at("a.exr"), &back, &err));
    assert_same_pixels(&image, &back);
    assert_true(exr_number(&back, "boothd.width_m", &value) && value == 0.1);
    assert_true(exr_number(&back, "boothd.depth_m", &value) && value == 1.0 / 3);
    assert_false(exr_number(&back, "boothd.height_m", &value));
    assert_string_equal(back.texts[0].name, "boothd.lamp");
    assert_string_equal(back.texts[0].value, "D50 \xc2\xb0");
    assert_string_equal(back.texts[1].value, "");
    assert_string_equal(back.texts[2].name, "");
    assert_int_equal(exr_channel(&back, "Q"), -1);
    exr_fini(&image);
    exr_fini(&back);
    exr_fini(&back);
}

static void every_size_around_a_block_comes_back(void **state)
{
    (void)state;
    static const char *const NAMES[] = {"Y", NULL};
    static const int SIZES[][2] = {{1, 1}, {1, 15}, {1, 16}, {1, 17}, {2, 31}, {300, 1}, {3, 33}};
    for (size_t i = 0; i < sizeof SIZES / sizeof *SIZES; i++) {
        struct exr image, back;
        fill(&image, SIZES[i][0], SIZES[i][1], NAMES);
        assert_true(exr_save(at("a.exr"), &image, NULL));
        assert_true(exr_load(at("a.exr"), &back, NULL));
        assert_same_pixels(&image, &back);
        exr_fini(&image);
        exr_fini(&back);
    }
}

static void an_image_of_one_value_packs_tightly_and_still_loads(void **state)
{
    (void)state;
    struct exr image, back;
    size_t size;
    assert_true(exr_init(&image, 1024, 512, 1, NULL));
    strcpy(image.names[0], "Y");
    assert_true(exr_save(at("a.exr"), &image, NULL));
    free(take(at("a.exr"), &size));
    assert_true(size < 16384);
    assert_true(exr_load(at("a.exr"), &back, NULL));
    assert_same_pixels(&image, &back);
    exr_fini(&image);
    exr_fini(&back);
}

static void attributes_beyond_the_room_are_refused_and_the_others_come_back(void **state)
{
    (void)state;
    static const char *const NAMES[] = {"Y", NULL};
    struct exr image, back;
    double value = 0;
    char name[16];
    fill(&image, 2, 2, NAMES);
    for (int i = 0; i <= EXR_ATTRIBUTES_MOST; i++) {
        snprintf(name, sizeof name, "n%02d", i);
        assert_int_equal(exr_set_number(&image, name, i), i < EXR_ATTRIBUTES_MOST);
        assert_int_equal(exr_set_text(&image, name + 1, name), i < EXR_ATTRIBUTES_MOST);
    }
    assert_true(exr_set_number(&image, "n00", -1)); // not a new one
    assert_true(exr_save(at("a.exr"), &image, NULL));
    assert_true(exr_load(at("a.exr"), &back, NULL));
    assert_true(exr_number(&back, "n00", &value) && value == -1);
    assert_true(exr_number(&back, "n63", &value) && value == 63);
    assert_false(exr_number(&back, "n64", &value));
    assert_string_equal(back.texts[63].value, "n63");
    exr_fini(&image);
    exr_fini(&back);
}

static void attributes_that_are_too_long_are_refused(void **state)
{
    (void)state;
    struct exr image = {0};
    char text[257];
    memset(text, 'x', sizeof text);
    text[256] = 0;
    assert_false(exr_set_text(&image, "a", text));
    assert_true(exr_set_text(&image, "a", text + 1));
    assert_false(exr_set_text(&image, text + 256 - 64, "v"));
    assert_false(exr_set_number(&image, text + 256 - 64, 1));
    assert_true(exr_set_number(&image, text + 256 - 63, 1));
    assert_string_equal(image.texts[1].name, "");
}

static void sizes_out_of_range_are_refused(void **state)
{
    (void)state;
    static const int BAD[][3] = {{0, 1, 1},     {1, 0, 1}, {-5, 1, 1}, {16385, 1, 1},
                                 {1, 16385, 1}, {1, 1, 0}, {1, 1, 65}, {16384, 16384, 5}};
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        struct exr image;
        struct error err = {0};
        assert_false(exr_init(&image, BAD[i][0], BAD[i][1], BAD[i][2], &err));
        assert_int_equal(err.code, ERROR_RANGE);
        assert_null(image.pixels);
    }
}

static void what_would_not_load_is_not_saved(void **state)
{
    (void)state;
    static const char *const NAMES[] = {"X", "Y", NULL};
    struct exr image;
    struct error err = {0};
    put_text("b.exr", "old");
    fill(&image, 4, 3, NAMES);
    image.pixels[4 * 3 + 4 * 2 + 1] = NAN;
    assert_false(exr_save(at("b.exr"), &image, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_complaint(err.text, "b.exr: channel Y, x 1, y 2: nan; allowed: a finite number");
    image.pixels[4 * 3 + 4 * 2 + 1] = -INFINITY;
    assert_false(exr_save(at("b.exr"), &image, &err));
    assert_complaint(err.text, "b.exr: channel Y, x 1, y 2: inf; allowed: a finite number");
    image.pixels[4 * 3 + 4 * 2 + 1] = 0;
    strcpy(image.names[1], "X");
    assert_false(exr_save(at("b.exr"), &image, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    strcpy(image.names[1], "");
    assert_false(exr_save(at("b.exr"), &image, &err));
    strcpy(image.names[1], "Y");
    exr_set_text(&image, "channels", "not an attribute of ours");
    assert_false(exr_save(at("b.exr"), &image, &err));
    assert_holds(at("b.exr"), "old");
    assert_int_equal(unlink(at("b.exr")), 0);
    exr_fini(&image);
}

// An image of one channel as another program might write it.
struct foreign {
    exr_compression_t compression;
    exr_storage_t storage;
    exr_pixel_type_t type;
    int parts, first_x, first_y;
    float odd; // value of the pixel at x 5, y 7, when not 0
};

static float foreign_value(const struct foreign *f, int x, int y)
{
    if (f->odd != 0 && x == 5 && y == 7)
        return f->odd;
    // Exact in half precision.
    return ((x * 31 + y * 17) % 512) * 0.25f;
}

static void ignore(exr_const_context_t context, exr_result_t code, const char *message)
{
    (void)context, (void)code, (void)message;
}

static void write_foreign_lines(exr_context_t context, const struct foreign *f, float *pixels)
{
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    exr_chunk_info_t chunk;
    for (int row = 0; row < H; row += chunk.height) {
        assert_int_equal(exr_write_scanline_chunk_info(context, 0, f->first_y + row, &chunk), 0);
        assert_int_equal(row ? exr_encoding_update(context, 0, &chunk, &pipeline)
                             : exr_encoding_initialize(context, 0, &chunk, &pipeline),
                         0);
        exr_coding_channel_info_t *channel = pipeline.channels;
        channel->user_bytes_per_element = f->type == EXR_PIXEL_UINT ? 4 : sizeof(float);
        channel->user_data_type = f->type == EXR_PIXEL_UINT ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT;
        channel->user_pixel_stride = sizeof(float);
        channel->user_line_stride = W * sizeof(float);
        channel->encode_from_ptr = (const uint8_t *)(pixels + row * W);
        if (!row)
            assert_int_equal(exr_encoding_choose_default_routines(context, 0, &pipeline), 0);
        assert_int_equal(exr_encoding_run(context, 0, &pipeline), 0);
    }
    exr_encoding_destroy(context, &pipeline);
}

static const char *write_foreign(struct foreign f)
{
    exr_context_t context;
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_attr_box2i_t window = {{{{f.first_x, f.first_y}}},
                               {{{f.first_x + W - 1, f.first_y + H - 1}}}};
    exr_attr_v2f_t centre = {{{0, 0}}};
    float pixels[W * H];
    for (int i = 0; i < W * H; i++)
        pixels[i] = foreign_value(&f, i % W, i / W);
    init.error_handler_fn = ignore;
    assert_int_equal(exr_start_write(&context, at("f.exr"), EXR_WRITE_FILE_DIRECTLY, &init), 0);
    for (int p = 0; p < f.parts; p++) {
        char name[20];
        int part;
        snprintf(name, sizeof name, "part%d", p);
        assert_int_equal(exr_add_part(context, name, f.storage, &part), 0);
        assert_int_equal(exr_initialize_required_attr(context, part, &window, &window, 1, &centre,
                                                      1, EXR_LINEORDER_INCREASING_Y, f.compression),
                         0);
        if (f.storage == EXR_STORAGE_TILED)
            assert_int_equal(exr_set_tile_descriptor(context, part, 16, 16, EXR_TILE_ONE_LEVEL,
                                                     EXR_TILE_ROUND_DOWN),
                             0);
        assert_int_equal(exr_add_channel(context, part, "Y", f.type, EXR_PERCEPTUALLY_LINEAR, 1, 1),
                         0);
    }
    assert_int_equal(exr_write_header(context), 0);
    if (f.parts == 1 && f.storage == EXR_STORAGE_SCANLINE) {
        write_foreign_lines(context, &f, pixels);
        exr_finish(&context);
        return at("f.exr");
    }
    // Only the header matters; the library takes an unfinished file away.
    size_t size;
    char *header = take(at("f.exr"), &size);
    exr_finish(&context);
    put("f.exr", header, size + 1024);
    free(header);
    return at("f.exr");
}

static const struct foreign PLAIN = {
    EXR_COMPRESSION_NONE, EXR_STORAGE_SCANLINE, EXR_PIXEL_FLOAT, 1, 0, 0, 0};

static void assert_reads_exactly(struct foreign f)
{
    struct exr image;
    struct error err = {0};
    if (!exr_load(write_foreign(f), &image, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    assert_int_equal(image.width, W);
    assert_int_equal(image.height, H);
    for (int y = 0; y < H; y++)
        for (int x = 0; x < W; x++)
            assert_true(image.pixels[y * W + x] == foreign_value(&f, x, y));
    exr_fini(&image);
}

static void assert_foreign_refused(struct foreign f, const char *expected)
{
    struct exr image;
    struct error err = {0};
    memset(&image, 0x55, sizeof image);
    assert_false(exr_load(write_foreign(f), &image, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_complaint(err.text, expected);
    assert_null(image.pixels);
}

static void every_lossless_compression_is_read_exactly(void **state)
{
    (void)state;
    struct foreign f = PLAIN;
    for (f.compression = EXR_COMPRESSION_NONE; f.compression <= EXR_COMPRESSION_PIZ;
         f.compression++)
        for (f.type = EXR_PIXEL_HALF; f.type <= EXR_PIXEL_FLOAT; f.type++)
            assert_reads_exactly(f);
}

static void a_window_that_begins_anywhere_is_read(void **state)
{
    (void)state;
    struct foreign f = PLAIN;
    f.first_x = -7;
    f.first_y = 1000;
    f.compression = EXR_COMPRESSION_ZIP;
    assert_reads_exactly(f);
}

static void lossy_compressions_are_refused_by_name(void **state)
{
    (void)state;
    static const char *const NAMES[] = {"PXR24", "B44", "B44A", "DWAA", "DWAB"};
    const char mark[] = "compression\0compression\0\x01\0\0";
    for (int i = 0; i < 5; i++) {
        struct exr image;
        struct error err = {0};
        char expected[128];
        size_t size;
        char *bytes = take(write_foreign(PLAIN), &size);
        char *found = memmem(bytes, size, mark, sizeof mark);
        assert_non_null(found);
        found[sizeof mark] = EXR_COMPRESSION_PXR24 + i;
        assert_false(exr_load(put("l.exr", bytes, size), &image, &err));
        snprintf(expected, sizeof expected,
                 "l.exr: compression is %s; allowed: NONE, RLE, ZIPS, ZIP, PIZ", NAMES[i]);
        assert_complaint(err.text, expected);
        assert_int_equal(err.code, ERROR_DATA);
        free(bytes);
    }
}

static void tiled_and_multi_part_files_are_refused(void **state)
{
    (void)state;
    struct foreign f = PLAIN;
    f.storage = EXR_STORAGE_TILED;
    assert_foreign_refused(f, "f.exr: storage is tiled; allowed: scan-line");
    f = PLAIN;
    f.parts = 2;
    assert_foreign_refused(f, "f.exr: has 2 parts; allowed: 1");
}

static void integer_channels_are_refused(void **state)
{
    (void)state;
    struct foreign f = PLAIN;
    f.type = EXR_PIXEL_UINT;
    assert_foreign_refused(f, "f.exr: channel Y; allowed: float or half at every pixel");
}

static void a_channel_entry_that_does_not_fit_is_refused(void **state)
{
    (void)state;
    const char mark[] = "chlist\0\x13\0\0\0Y"; // then type, linear, x and y sampling
    struct exr image;
    struct error err = {0};
    size_t size;
    char *bytes = take(write_foreign(PLAIN), &size);
    char *found = memmem(bytes, size, mark, sizeof mark);
    assert_non_null(found);
    found[sizeof mark + 8] = W;
    assert_false(exr_load(put("s.exr", bytes, size), &image, &err));
    assert_complaint(err.text, "s.exr: channel Y; allowed: float or half at every pixel");
    free(bytes);
}

static void pixels_that_are_not_finite_are_refused_with_their_place(void **state)
{
    (void)state;
    struct foreign f = PLAIN;
    f.odd = NAN;
    assert_foreign_refused(f, "f.exr: channel Y, x 5, y 7: nan; allowed: a finite number");
    f.odd = INFINITY;
    f.type = EXR_PIXEL_HALF;
    f.compression = EXR_COMPRESSION_PIZ;
    assert_foreign_refused(f, "f.exr: channel Y, x 5, y 7: inf; allowed: a finite number");
}

static void what_is_no_image_is_refused(void **state)
{
    (void)state;
    struct exr image;
    struct error err = {0};
    assert_false(exr_load(put_text("t.exr", "hello"), &image, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "t.exr: is not a sound OpenEXR image"));
    assert_false(exr_load(put_text("t.exr", ""), &image, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_false(exr_load(at("none.exr"), &image, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_complaint(err.text, "none.exr: cannot be read: No such file or directory");
}

static void a_header_that_promises_more_than_the_file_holds_is_refused(void **state)
{
    (void)state;
    struct exr image;
    struct error err = {0};
    size_t size;
    char *bytes = take(write_foreign(PLAIN), &size);
    const char mark[] = "dataWindow\0box2i\0\x10\0\0";
    char *found = memmem(bytes, size, mark, sizeof mark);
    assert_non_null(found);
    const int32_t huge[] = {0, 0, 16383, 16383};
    memcpy(found + sizeof mark, huge, sizeof huge);
    assert_false(exr_load(put("h.exr", bytes, size), &image, &err));
    assert_int_equal(err.code, ERROR_DATA);
    const int32_t beyond[] = {-2147483647, -2147483647, 2147483646, 2147483646};
    memcpy(found + sizeof mark, beyond, sizeof beyond);
    assert_false(exr_load(put("h.exr", bytes, size), &image, &err));
    free(bytes);
}

static void a_real_picture_loads(void **state)
{
    (void)state;
    struct exr image, back;
    const char *path = shared_file("hdr/XYZ.exr");
    assert_true(exr_load(path, &image, NULL));
    assert_int_equal(image.width, 610);
    assert_int_equal(image.height, 406);
    assert_int_equal(image.channels, 3);
    assert_true(exr_channel(&image, "G") >= 0);
    assert_true(exr_save(at("x.exr"), &image, NULL));
    assert_true(exr_load(at("x.exr"), &back, NULL));
    assert_same_pixels(&image, &back);
    exr_fini(&image);
    exr_fini(&back);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_image_comes_back_to_the_last_bit_with_its_attributes),
        cmocka_unit_test(every_size_around_a_block_comes_back),
        cmocka_unit_test(an_image_of_one_value_packs_tightly_and_still_loads),
        cmocka_unit_test(attributes_beyond_the_room_are_refused_and_the_others_come_back),
        cmocka_unit_test(attributes_that_are_too_long_are_refused),
        cmocka_unit_test(sizes_out_of_range_are_refused),
        cmocka_unit_test(what_would_not_load_is_not_saved),
        cmocka_unit_test(every_lossless_compression_is_read_exactly),
        cmocka_unit_test(a_window_that_begins_anywhere_is_read),
        cmocka_unit_test(lossy_compressions_are_refused_by_name),
        cmocka_unit_test(tiled_and_multi_part_files_are_refused),
        cmocka_unit_test(integer_channels_are_refused),
        cmocka_unit_test(a_channel_entry_that_does_not_fit_is_refused),
        cmocka_unit_test(pixels_that_are_not_finite_are_refused_with_their_place),
        cmocka_unit_test(what_is_no_image_is_refused),
        cmocka_unit_test(a_header_that_promises_more_than_the_file_holds_is_refused),
        cmocka_unit_test(a_real_picture_loads),
    };
    return cmocka_run_group_tests_name("exr", tests, open_place, close_place);
}
