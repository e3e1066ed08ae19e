// SPDX-License-Identifier: Apache-2.0
// Files that are either whole or not there. Half-written files are made with
// the process's own limit of file size.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <png.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "files/cgats.h"
#include "files/exr.h"
#include "files/ini.h"
#include "files/png.h"
#include "files/write.h"
#include "tests/files/place.h"

enum { FULL_AFTER = 8192 };

// From here on every write beyond FULL_AFTER bytes of a file fails.
static void fill_disk(struct rlimit *before)
{
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, before);
    struct rlimit full = {FULL_AFTER, before->rlim_max};
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &full), 0);
}

static void free_disk(const struct rlimit *before)
{
    assert_int_equal(setrlimit(RLIMIT_FSIZE, before), 0);
}

static void a_file_appears_with_its_commit_and_not_before(void **state)
{
    (void)state;
    struct whole_file file;
    assert_true(whole_file_begin(&file, at("a"), NULL));
    fputs("new", file.stream);
    assert_int_equal(access(at("a"), F_OK), -1);
    assert_true(whole_file_commit(&file, NULL));
    assert_holds(at("a"), "new");
    whole_file_abandon(&file);
    assert_holds(at("a"), "new");
    assert_int_equal(unlink(at("a")), 0);
    assert_int_equal(files_in_place(), 0);
}

static void an_abandoned_file_leaves_the_old_one_and_nothing_else(void **state)
{
    (void)state;
    struct whole_file file;
    put_text("a", "old");
    assert_true(whole_file_begin(&file, at("a"), NULL));
    fputs("new", file.stream);
    whole_file_abandon(&file);
    whole_file_abandon(&file);
    whole_file_abandon(&(struct whole_file){0});
    assert_holds(at("a"), "old");
    unlink(at("a"));
    assert_int_equal(files_in_place(), 0);
}

static void two_writers_of_one_path_do_not_mix(void **state)
{
    (void)state;
    struct whole_file first, second;
    assert_true(whole_file_begin(&first, at("a"), NULL));
    assert_true(whole_file_begin(&second, at("a"), NULL));
    fputs("first", first.stream);
    fputs("second", second.stream);
    assert_true(whole_file_commit(&second, NULL));
    assert_true(whole_file_commit(&first, NULL));
    assert_holds(at("a"), "first");
    unlink(at("a"));
    assert_int_equal(files_in_place(), 0);
}

static void a_link_stays_a_link_to_the_new_content(void **state)
{
    (void)state;
    struct stat there;
    put_text("real", "old");
    assert_int_equal(symlink("real", at("link")), 0);
    assert_true(whole_file_write(at("link"), "new", 3, NULL));
    assert_holds(at("real"), "new");
    assert_int_equal(lstat(at("link"), &there), 0);
    assert_true(S_ISLNK(there.st_mode));
    unlink(at("link"));
    unlink(at("real"));
}

static void a_new_file_has_the_permissions_of_any_other(void **state)
{
    (void)state;
    struct stat there;
    mode_t mask = umask(027);
    assert_true(whole_file_write(at("a"), "x", 1, NULL));
    umask(mask);
    assert_int_equal(stat(at("a"), &there), 0);
    assert_int_equal(there.st_mode & 0777, 0640);
    unlink(at("a"));
}

static void what_is_no_regular_file_is_refused(void **state)
{
    (void)state;
    struct error err = {0};
    assert_false(whole_file_write("/dev/null", "x", 1, &err));
    assert_string_equal(err.text, "/dev/null: is not a regular file");
    assert_false(whole_file_write(place, "x", 1, &err));
    assert_int_equal(err.code, ERROR_SYSTEM);
    assert_false(whole_file_write(at("no/such/folder"), "x", 1, &err));
    assert_complaint(err.text, "no/such/folder: cannot be written: No such file or directory");
    char longer[1100];
    memset(longer, 'a', sizeof longer);
    longer[1099] = 0;
    assert_false(whole_file_write(longer, "x", 1, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_int_equal(files_in_place(), 0);
}

static void a_full_disk_leaves_the_old_file_and_no_other(void **state)
{
    (void)state;
    struct error err = {0};
    struct rlimit before;
    char *bytes = calloc(1, 3 * FULL_AFTER);
    put_text("a", "old");
    fill_disk(&before);
    assert_false(whole_file_write(at("a"), bytes, 3 * FULL_AFTER, &err));
    free_disk(&before);
    assert_int_equal(err.code, ERROR_SYSTEM);
    assert_complaint(err.text, "a: writing failed, the file is as it was: File too large");
    assert_holds(at("a"), "old");
    assert_int_equal(files_in_place(), 1);
    unlink(at("a"));
    free(bytes);
}

static bool save_noise_exr(const char *path, struct error *err)
{
    struct exr image;
    uint32_t seed = 1;
    assert_true(exr_init(&image, 100, 100, 1, NULL));
    strcpy(image.names[0], "Y");
    for (int i = 0; i < 100 * 100; i++)
        image.pixels[i] = (seed = seed * 1664525 + 1013904223) / 4294967296.0f;
    bool ok = exr_save(path, &image, err);
    exr_fini(&image);
    return ok;
}

static bool save_noise_png(const char *path, struct error *err)
{
    uint8_t *rgb = malloc(100 * 100 * 3);
    uint32_t seed = 1;
    for (int i = 0; i < 100 * 100 * 3; i++)
        rgb[i] = (seed = seed * 1664525 + 1013904223) >> 24;
    bool ok = png_save_rgb8(path, 100, 100, rgb, err);
    free(rgb);
    return ok;
}

static bool save_long_cgats(const char *path, struct error *err)
{
    char name[] = "RGB_R", *names[] = {name};
    double values[3000] = {0};
    struct cgats file = {.identifier = "CTI3",
                         .table = {.columns = 1, .rows = 3000, .names = names, .values = values}};
    for (int i = 0; i < 3000; i++)
        values[i] = i / 7.0;
    return cgats_save(path, &file, err);
}

static bool save_long_ini(const char *path, struct error *err)
{
    static double curve[1000];
    for (int i = 0; i < 1000; i++)
        curve[i] = i / 999.0;
    const struct setting rows[] = {
        {"curve", SETTING_VECTOR, 0, 1000, 0, 1, "", NULL, NULL, "A curve."}, {0}};
    const struct settings_section sections[] = {{"display", rows, curve}, {0}};
    return ini_save(path, sections, err);
}

static void every_writer_leaves_the_old_file_when_the_disk_is_full(void **state)
{
    (void)state;
    bool (*const SAVE[])(const char *, struct error *) = {save_noise_exr, save_noise_png,
                                                          save_long_cgats, save_long_ini};
    for (size_t i = 0; i < sizeof SAVE / sizeof *SAVE; i++) {
        struct error err = {0};
        struct rlimit before;
        put_text("a", "old");
        fill_disk(&before);
        assert_false(SAVE[i](at("a"), &err));
        free_disk(&before);
        assert_int_equal(err.code, ERROR_SYSTEM);
        assert_non_null(strstr(err.text, "a: writing failed, the file is as it was: "));
        assert_holds(at("a"), "old");
        assert_int_equal(files_in_place(), 1);
        assert_true(SAVE[i](at("a"), &err));
        size_t size;
        char *bytes = take(at("a"), &size);
        assert_true(size > FULL_AFTER);
        free(bytes);
    }
    unlink(at("a"));
}

static void a_file_is_read_whole_up_to_its_bound(void **state)
{
    (void)state;
    struct error err = {0};
    size_t size, big = 200000;
    char *bytes = calloc(1, big), *back;
    for (size_t i = 0; i < big; i++)
        bytes[i] = i * 7;
    put("a", bytes, big);
    back = file_read(at("a"), big, &size, &err);
    assert_int_equal(size, big);
    assert_memory_equal(back, bytes, big);
    assert_int_equal(back[big], 0);
    free(back);
    assert_null(file_read(at("a"), big - 1, &size, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_complaint(err.text, "a: is larger than 199999 bytes");
    back = file_read(put("a", "", 0), 10, &size, &err);
    assert_non_null(back);
    assert_int_equal(size, 0);
    free(back);
    free(bytes);
    unlink(at("a"));
}

static void a_pipe_is_refused_at_once_until_a_program_takes_pipes(void **state)
{
    (void)state;
    struct error err = {0};
    size_t size;
    int ends[2];
    char path[32];
    assert_int_equal(mkfifo(at("pipe"), 0600), 0);
    assert_null(file_read(at("pipe"), 10, &size, &err)); // nobody will ever write into it
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_complaint(err.text, "pipe: is no regular file");
    unlink(at("pipe"));
    assert_null(file_read("/dev/zero", 10, &size, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(write(ends[1], "words", 5), 5);
    close(ends[1]);
    snprintf(path, sizeof path, "/dev/fd/%d", ends[0]);
    assert_null(file_read(path, 10, &size, &err));
    files_take_pipes();
    char *words = file_read(path, 10, &size, &err);
    assert_non_null(words);
    assert_string_equal(words, "words");
    free(words);
    close(ends[0]);
}

static void a_picture_comes_back_as_the_same_counts(void **state)
{
    (void)state;
    enum { W = 33, H = 17 };
    uint8_t rgb[W * H * 3], back[sizeof rgb];
    for (size_t i = 0; i < sizeof rgb; i++)
        rgb[i] = i * 37 >> 2;
    assert_true(png_save_rgb8(at("a.png"), W, H, rgb, NULL));
    png_image image = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_file(&image, at("a.png")));
    assert_int_equal(image.width, W);
    assert_int_equal(image.height, H);
    assert_int_equal(image.format, PNG_FORMAT_RGB);
    assert_true(png_image_finish_read(&image, NULL, back, W * 3, NULL));
    assert_memory_equal(back, rgb, sizeof rgb);
    unlink(at("a.png"));
}

static void a_picture_of_no_size_is_refused(void **state)
{
    (void)state;
    struct error err = {0};
    uint8_t rgb[3] = {0};
    assert_false(png_save_rgb8(at("a.png"), 0, 1, rgb, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_complaint(err.text, "a.png: picture of 0 x 1 pixels; allowed: 1..16384 each");
    assert_false(png_save_rgb8(at("a.png"), 1, 16385, rgb, &err));
    assert_int_equal(files_in_place(), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_file_appears_with_its_commit_and_not_before),
        cmocka_unit_test(an_abandoned_file_leaves_the_old_one_and_nothing_else),
        cmocka_unit_test(two_writers_of_one_path_do_not_mix),
        cmocka_unit_test(a_link_stays_a_link_to_the_new_content),
        cmocka_unit_test(a_new_file_has_the_permissions_of_any_other),
        cmocka_unit_test(what_is_no_regular_file_is_refused),
        cmocka_unit_test(a_full_disk_leaves_the_old_file_and_no_other),
        cmocka_unit_test(every_writer_leaves_the_old_file_when_the_disk_is_full),
        cmocka_unit_test(a_file_is_read_whole_up_to_its_bound),
        cmocka_unit_test(a_pipe_is_refused_at_once_until_a_program_takes_pipes),
        cmocka_unit_test(a_picture_comes_back_as_the_same_counts),
        cmocka_unit_test(a_picture_of_no_size_is_refused),
    };
    return cmocka_run_group_tests_name("write", tests, open_place, close_place);
}
