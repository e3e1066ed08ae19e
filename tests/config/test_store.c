// SPDX-License-Identifier: Apache-2.0
// The store of calibrations: versions come, stay as they were, are refused when
// anything about them is wrong.
#include "tests/fakes/support.h"

#include <fcntl.h>

#include "base/clock.h"
#include "config/store.h"
#include "files/write.h"
#include "tests/fakes/folder.h"

static const double EXACT = 1e-12;

static struct folder here;
static struct store_place place;

static int open_here(void **state)
{
    (void)state;
    folder_open(&here);
    return !store_place(folder_at(&here, "store"), "lab 2", "CG247 \xc2\xb7 1234", &place, NULL);
}

static int close_here(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

static void fine(bool done, const struct error *err)
{
    if (!done)
        print_error("%s\n", err->text);
    assert_true(done);
}

static void put(struct store_draft *d, const char *path, const char *text)
{
    struct error err = {0};
    fine(store_put(d, folder_put(&here, "source", text), path, &err), &err);
}

static struct store_manifest facts(const char *note)
{
    struct store_manifest m = {.created = "2026-01-31T12:00:00Z",
                               .valid_until = "2026-03-02T12:00:00Z",
                               .software = "test 1"};
    snprintf(m.note, sizeof m.note, "%s", note);
    return m;
}

// A version that differs from the one before in display.ini alone.
static int version(const char *text)
{
    struct store_draft d;
    struct error err = {0};
    struct store_manifest m = facts(text);
    int number = 0;
    fine(store_begin(&place, true, &d, &err), &err);
    put(&d, "display.ini", text);
    if (!d.base.version) {
        put(&d, "lamps/A.ini", "a lamp");
        put(&d, "lamps/A.sp", "its spectrum");
    }
    fine(store_commit(&d, &m, &number, &err), &err);
    return number;
}

static const char *in_version(int number, const char *path)
{
    char name[160];
    snprintf(name, sizeof name, "store/lab-2/CG247----1234/%04d/%.80s", number, path);
    return folder_at(&here, name);
}

static void holds(int number, const char *path, const char *text)
{
    size_t size;
    struct error err = {0};
    char *bytes = file_read(in_version(number, path), 1000, &size, &err);
    if (!bytes)
        print_error("%s\n", err.text);
    assert_non_null(bytes);
    assert_string_equal(bytes, text);
    free(bytes);
}

static int current(void)
{
    struct error err = {0};
    int number = -1;
    fine(store_current(&place, &number, &err), &err);
    return number;
}

static void refused(int number, enum error_code code, const char *part)
{
    struct store_version v = {.count = 77};
    struct error err = {0};
    assert_false(store_open(&place, number, &v, &err));
    assert_holds(err.text, part);
    assert_int_equal(err.code, code);
    assert_int_equal(v.count, 77); // untouched
}

static int litter(void)
{
    char line[STORE_PATH + 64], answer[16] = "";
    snprintf(line, sizeof line, "ls -A '%s' | grep -c draft", place.folder);
    FILE *ls = popen(line, "r");
    assert_non_null(fgets(answer, sizeof answer, ls));
    pclose(ls);
    return atoi(answer);
}

static void a_store_that_is_not_there_is_empty(void **state)
{
    (void)state;
    int *numbers, count = -1;
    assert_int_equal(current(), 0);
    assert_true(store_numbers(&place, &numbers, &count, NULL));
    assert_int_equal(count, 0);
    free(numbers);
    refused(1, ERROR_CONFIG, "no version 0001");
}

static void a_version_holds_what_was_put_and_says_whose_it_is(void **state)
{
    (void)state;
    struct store_version v;
    struct error err = {0};
    assert_int_equal(version("one"), 1);
    assert_int_equal(current(), 1);
    fine(store_open(&place, 1, &v, &err), &err);
    assert_string_equal(v.manifest.booth, "lab 2");
    assert_string_equal(v.manifest.display, "CG247 \xc2\xb7 1234");
    assert_string_equal(v.manifest.created, "2026-01-31T12:00:00Z");
    assert_string_equal(v.manifest.note, "one");
    assert_int_equal(v.manifest.based_on, 0);
    assert_int_equal(v.count, 4); // with manifest.ini
    // echo -n one | sha256sum
    assert_string_equal(store_sum(&v, "display.ini")->hex,
                        "7692c3ad3540bb803c020b3aee66cd8887123234ea0c6e7143c0add73ff431ed");
    assert_null(store_sum(&v, "SHA256SUMS"));
    assert_null(store_sum(&v, "lamps"));
    store_version_fini(&v);
}

static void a_new_version_shares_what_did_not_change_and_leaves_the_old_one(void **state)
{
    (void)state;
    struct stat old, new;
    version("one");
    assert_int_equal(version("two"), 2);
    assert_int_equal(current(), 2);
    holds(1, "display.ini", "one");
    holds(2, "display.ini", "two");
    holds(2, "lamps/A.sp", "its spectrum");
    assert_int_equal(stat(in_version(1, "lamps/A.sp"), &old), 0);
    assert_int_equal(stat(in_version(2, "lamps/A.sp"), &new), 0);
    assert_true(old.st_ino == new.st_ino);
    assert_int_equal(old.st_mode & 0222, 0);
    struct store_version v;
    for (int i = 1; i <= 2; i++) {
        struct error err = {0};
        fine(store_open(&place, i, &v, &err), &err);
        assert_int_equal(v.manifest.based_on, i - 1);
        store_version_fini(&v);
    }
}

static void other_tools_verify_it_too(void **state)
{
    (void)state;
    char line[512];
    version("one");
    snprintf(line, sizeof line, "cd '%s' && sha256sum --quiet --strict -c SHA256SUMS",
             in_version(1, ""));
    assert_int_equal(system(line), 0);
}

static void a_version_from_nothing_has_nothing_of_the_one_in_force(void **state)
{
    (void)state;
    struct store_draft d;
    struct store_version v;
    struct error err = {0};
    struct store_manifest m = facts("bare");
    version("one");
    fine(store_begin(&place, false, &d, &err), &err);
    put(&d, "note.txt", "only this");
    fine(store_commit(&d, &m, NULL, &err), &err);
    fine(store_open(&place, 2, &v, &err), &err);
    assert_int_equal(v.count, 2);
    assert_int_equal(v.manifest.based_on, 0);
    store_version_fini(&v);
}

static void an_abandoned_draft_leaves_no_trace(void **state)
{
    (void)state;
    struct store_draft d;
    struct error err = {0};
    version("one");
    fine(store_begin(&place, true, &d, &err), &err);
    put(&d, "display.ini", "never");
    store_abandon(&d);
    store_abandon(&d);
    assert_int_equal(litter(), 0);
    assert_int_equal(current(), 1);
    holds(1, "display.ini", "one");
    assert_int_equal(version("two"), 2);
}

static void an_older_version_is_put_in_force_again(void **state)
{
    (void)state;
    struct error err = {0};
    version("one");
    version("two");
    fine(store_use(&place, 1, &err), &err);
    assert_int_equal(current(), 1);
    assert_int_equal(version("three"), 3); // no number comes twice
    assert_false(store_use(&place, 7, &err));
    assert_holds(err.text, "no version 0007");
    assert_int_equal(current(), 3);
}

static void change(const char *path, const char *text)
{
    int fd = open(path, O_WRONLY | O_TRUNC);
    if (fd < 0) { // read-only, as it should be
        assert_int_equal(chmod(path, 0644), 0);
        fd = open(path, O_WRONLY | O_TRUNC);
    }
    assert_true(write(fd, text, strlen(text)) == (ssize_t)strlen(text));
    close(fd);
}

static void a_changed_missing_or_added_file_is_named(void **state)
{
    (void)state;
    version("one");
    change(in_version(1, "display.ini"), "One");
    refused(1, ERROR_DATA, "0001/display.ini: was changed");
    change(in_version(1, "display.ini"), "one");
    assert_int_equal(unlink(in_version(1, "lamps/A.sp")), 0);
    refused(1, ERROR_DATA, "0001/lamps/A.sp: is missing");
    change(folder_put(&here, "A.sp", ""), "its spectrum");
    assert_int_equal(rename(folder_at(&here, "A.sp"), in_version(1, "lamps/A.sp")), 0);
    struct store_version v;
    assert_true(store_open(&place, 1, &v, NULL)); // as it was
    store_version_fini(&v);
    assert_int_equal(symlink("A.sp", in_version(1, "lamps/B.sp")), 0);
    refused(1, ERROR_DATA, "lamps/B.sp: is no regular file");
    assert_int_equal(unlink(in_version(1, "lamps/B.sp")), 0);
    folder_put(&here, "B.sp", "more");
    assert_int_equal(rename(folder_at(&here, "B.sp"), in_version(1, "lamps/B.sp")), 0);
    refused(1, ERROR_DATA, "lamps/B.sp: is not listed");
}

static void broken_lists_and_manifests_are_refused(void **state)
{
    (void)state;
    static const struct {
        const char *file, *text, *part;
    } bad[] = {
        {"SHA256SUMS", "", "not listed"},
        {"SHA256SUMS", "0123  display.ini\n", "SHA256SUMS:1: is no checksum"},
        {"manifest.ini", "[calibration]\nversion = 1\n", "booth is missing"},
        {"manifest.ini",
         "[calibration]\nversion = 2\nbooth = lab 2\ndisplay = CG247 \xc2\xb7 1234\n"
         "created = 2026-01-31T12:00:00Z\n",
         "not its folder's"},
        {"manifest.ini",
         "[calibration]\nversion = 1\nbooth = lab 2\ndisplay = CG247 \xc2\xb7 1234\n"
         "created = yesterday\n",
         "\"yesterday\" is no time"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        int number = version("x");
        if (number == 1) {
            change(in_version(1, bad[i].file), bad[i].text);
            refused(1, ERROR_DATA, bad[i].part);
        }
        folder_close(&here);
        open_here(NULL);
    }
}

static void a_foreign_version_is_refused_by_name(void **state)
{
    (void)state;
    struct store_place other;
    char line[2 * STORE_PATH + 32];
    assert_true(store_place(folder_at(&here, "store"), "lab 2", "PA32U 9", &other, NULL));
    version("one");
    snprintf(line, sizeof line, "cp -r '%s' '%s'", place.folder, other.folder);
    assert_int_equal(system(line), 0);
    place = other;
    refused(1, ERROR_CONFIG, "foreign: it is of the display \"CG247");
    struct store_draft d;
    struct error err = {0};
    assert_false(store_begin(&place, true, &d, &err));
    assert_holds(err.text, "no start");
    assert_holds(err.text, "foreign");
    assert_int_equal(litter(), 0);
    fine(store_begin(&place, false, &d, &err), &err);
    store_abandon(&d);
}

static void a_link_that_names_no_version_is_refused(void **state)
{
    (void)state;
    static const char *const TARGETS[] = {"0009", "../1", "x", "1", "0001/lamps"};
    int number;
    version("one");
    for (size_t i = 0; i < sizeof TARGETS / sizeof *TARGETS; i++) {
        struct error err = {0};
        char link[STORE_PATH + 16];
        snprintf(link, sizeof link, "%s/current", place.folder);
        unlink(link);
        assert_int_equal(symlink(TARGETS[i], link), 0);
        assert_false(store_current(&place, &number, &err));
        assert_holds(err.text, "names no version");
        assert_int_equal(err.code, ERROR_DATA);
    }
    assert_true(store_use(&place, 1, NULL)); // mends it
    assert_int_equal(current(), 1);
}

static void a_calibration_expires_after_its_last_second(void **state)
{
    (void)state;
    struct store_manifest m = facts("");
    int64_t until, created;
    assert_true(clock_utc_parse(m.valid_until, &until));
    assert_true(clock_utc_parse(m.created, &created));
    assert_false(store_expired(&m, until));
    assert_true(store_expired(&m, until + 1));
    assert_near(store_age_days(&m, until), 30, EXACT);
    *m.valid_until = 0;
    assert_false(store_expired(&m, until + 1000 * 86400));
}

static void a_second_writer_waits_for_the_first(void **state)
{
    (void)state;
    struct store_draft d, other;
    struct error err = {0};
    version("one");
    fine(store_begin(&place, true, &d, &err), &err);
    assert_false(store_begin(&place, true, &other, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_holds(err.text, "somebody else");
    assert_false(store_use(&place, 1, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    store_abandon(&d);
    fine(store_begin(&place, true, &other, &err), &err);
    store_abandon(&other);
}

static void paths_out_of_the_draft_are_refused(void **state)
{
    (void)state;
    static const char *const BAD[] = {"", "/etc/x", "../x", "lamps/../../x", ".x", "lamps/.x"};
    struct store_draft d;
    struct error err = {0};
    fine(store_begin(&place, true, &d, &err), &err);
    folder_put(&here, "source", "x");
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        assert_false(store_put(&d, folder_at(&here, "source"), BAD[i], &err));
        assert_int_equal(err.code, ERROR_RANGE);
    }
    assert_false(store_put(&d, folder_at(&here, "none"), "x", &err));
    assert_holds(err.text, "none");
    assert_false(store_put(&d, here.path, "x", &err));
    assert_holds(err.text, "no regular file");
    store_abandon(&d);
}

static void a_place_needs_booth_and_display(void **state)
{
    (void)state;
    struct store_place p;
    struct error err = {0};
    char folder[256];
    assert_false(store_place("s", "", "d", &p, &err));
    assert_holds(err.text, "booth");
    assert_false(store_place("s", "b", "", &p, &err));
    assert_holds(err.text, "display");
    assert_true(store_place("s//", "../b", "a/b", &p, NULL));
    assert_string_equal(p.folder, "s/-.-b/a-b");
    snprintf(folder, sizeof folder, "%s/new/", here.path);
    assert_true(store_place(folder, "b", "d", &p, NULL));
    struct store_draft d;
    fine(store_begin(&p, true, &d, &err), &err);
    store_abandon(&d);
    assert_true(store_place(folder_at(&here, "no/new"), "b", "d", &p, NULL));
    assert_false(store_begin(&p, true, &d, &err));
    assert_holds(err.text, "making");
}

#define TEST(name) cmocka_unit_test_setup_teardown(name, open_here, close_here)

int main(void)
{
    const struct CMUnitTest tests[] = {
        TEST(a_store_that_is_not_there_is_empty),
        TEST(a_version_holds_what_was_put_and_says_whose_it_is),
        TEST(a_new_version_shares_what_did_not_change_and_leaves_the_old_one),
        TEST(other_tools_verify_it_too),
        TEST(a_version_from_nothing_has_nothing_of_the_one_in_force),
        TEST(an_abandoned_draft_leaves_no_trace),
        TEST(an_older_version_is_put_in_force_again),
        TEST(a_changed_missing_or_added_file_is_named),
        TEST(broken_lists_and_manifests_are_refused),
        TEST(a_foreign_version_is_refused_by_name),
        TEST(a_link_that_names_no_version_is_refused),
        TEST(a_calibration_expires_after_its_last_second),
        TEST(a_second_writer_waits_for_the_first),
        TEST(paths_out_of_the_draft_are_refused),
        TEST(a_place_needs_booth_and_display),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
