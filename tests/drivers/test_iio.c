// SPDX-License-Identifier: Apache-2.0
// The driver and libiio above a tree of files that umockdev shows as /sys.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "drivers/found.h"
#include "drivers/iio.h"
#include "drivers/udev.h"

#include <cmocka.h>

#include "tests/fakes/folder.h"
#include "tests/fakes/near.h"

static const double arithmetic = 1e-9;
enum { BUDGET_MS = 2000, NOBODY = 65534 };

#define DEVICE "sys/devices/iio:device%d/%s"

static struct folder root;

static void put(int device, const char *name, const char *text)
{
    char path[128];
    snprintf(path, sizeof path, DEVICE, device, name);
    folder_put(&root, path, text);
}

static void add(int device, const char *name, const char *label, const char *y, const char *z)
{
    char target[64], link[128];
    snprintf(target, sizeof target, "../../../devices/iio:device%d", device);
    snprintf(link, sizeof link, "%s/sys/bus/iio/devices/iio:device%d", root.path, device);
    put(device, "name", name);
    put(device, "label", label);
    put(device, "in_accel_x_raw", "0\n");
    put(device, "in_accel_y_raw", y);
    put(device, "in_accel_z_raw", z);
    assert_int_equal(symlink(target, link), 0);
}

// A magnetometer, an accelerometer with shared scale, one with everything per axis.
static int a_tree(void **state)
{
    (void)state;
    const char *const folders[] = {"sys", "sys/bus", "sys/bus/iio", "sys/bus/iio/devices",
                                   "sys/devices"};
    folder_open(&root);
    for (size_t i = 0; i < sizeof folders / sizeof *folders; i++)
        assert_int_equal(mkdir(folder_at(&root, folders[i]), 0755), 0);
    put(0, "name", "compass\n");
    put(0, "in_magn_x_raw", "5\n");
    char link[128];
    snprintf(link, sizeof link, "%s/sys/bus/iio/devices/iio:device0", root.path);
    assert_int_equal(symlink("../../../devices/iio:device0", link), 0);
    add(1, "mma8452\n", "base\n", "0\n", "1024\n");
    put(1, "in_accel_scale", "0.00957686\n");
    put(1, "in_accel_sampling_frequency", "200.0\n");
    add(2, "lis3dh\n", "EMUtilt\n", "-990\n", "10\n");
    put(2, "in_accel_x_scale", "0.01\n");
    put(2, "in_accel_y_scale", "0.01\n");
    put(2, "in_accel_z_scale", "0.01\n");
    put(2, "in_accel_y_offset", "9\n");
    put(2, "in_accel_z_offset", "-10\n");
    put(2, "in_mount_matrix", "1, 0, 0; 0, -1, 0; 0, 0, 1\n");
    return setenv("UMOCKDEV_DIR", root.path, 1);
}

static int no_tree(void **state)
{
    (void)state;
    folder_close(&root);
    return 0;
}

static struct accelerometer *open_named(const char *name, struct error *err)
{
    struct accelerometer_options options;
    memset(&options, 0, sizeof options);
    settings_preset(accelerometer_settings, &options);
    snprintf(options.iio_device, sizeof options.iio_device, "%s", name);
    return iio_driver.open(&options, clock_now_ns() + NS_PER_S, err);
}

static bool read_one(struct accelerometer *a, struct tilt_sample *s, struct error *err)
{
    return iio_driver.read(a, clock_now_ns() + BUDGET_MS * NS_PER_MS, s, err);
}

static void mount_matrices_are_nine_numbers_that_keep_lengths(void **state)
{
    (void)state;
    struct mat3 m;
    struct error err = {0};
    assert_true(iio_mount_matrix("0, 1, 0; -1, 0, 0; 0, 0, 1\n", &m, &err));
    struct vec3 v = mat3_apply(m, (struct vec3){1, 2, 3});
    assert_near(v.x, 2, arithmetic);
    assert_near(v.y, -1, arithmetic);
    assert_near(v.z, 3, arithmetic);
    assert_true(iio_mount_matrix("-1,0,0;0,1,0;0,0,1", &m, &err));
    const char *const bad[] = {"",
                               "1, 0, 0; 0, 1, 0; 0, 0",
                               "1, 0, 0; 0, 1, 0; 0, 0, 1; 0",
                               "1, 0, 0; 0, 1, 0; 0, 0, 2",
                               "1, 0, 0; 1, 0, 0; 0, 0, 1",
                               "nan, 0, 0; 0, 1, 0; 0, 0, 1",
                               "identity"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_false(iio_mount_matrix(bad[i], &m, &err));
        assert_int_equal(err.code, ERROR_DATA);
    }
}

static void the_first_accelerometer_is_taken_and_a_shared_scale_counts(void **state)
{
    (void)state;
    struct error err = {0};
    struct instrument_identity who;
    struct tilt_sample s;
    struct accelerometer *a = open_named("", &err);
    if (!a)
        print_error("%s\n", err.text);
    assert_non_null(a);
    iio_driver.identify(a, &who);
    assert_string_equal(who.model, "mma8452");
    assert_string_equal(who.serial, "base");
    assert_false(who.emulated);
    assert_true(read_one(a, &s, &err));
    assert_near(s.gravity.z, 1024 * 0.00957686, arithmetic);
    assert_near(s.tilt_deg, 0, arithmetic);
    assert_true(s.plausible && isnan(s.angle_deg));
    assert_true(s.taken.earliest_ns < s.taken.latest_ns);
    iio_driver.close(a);
}

static void offsets_scales_and_the_mount_matrix_apply_in_their_order(void **state)
{
    (void)state;
    const char *const names[] = {"lis3dh", "EMUtilt", "iio:device2"};
    for (int i = 0; i < 3; i++) {
        struct error err = {0};
        struct instrument_identity who;
        struct tilt_sample s;
        struct accelerometer *a = open_named(names[i], &err);
        assert_non_null(a);
        iio_driver.identify(a, &who);
        assert_true(who.emulated);
        assert_true(read_one(a, &s, &err));
        assert_near(s.gravity.y, (990 - 9) * 0.01, arithmetic);
        assert_near(s.gravity.z, 0, arithmetic);
        assert_near(s.tilt_deg, 90, arithmetic);
        assert_true(s.plausible);
        iio_driver.close(a);
    }
}

static void new_values_are_read_and_shaking_is_implausible(void **state)
{
    (void)state;
    struct error err = {0};
    struct tilt_sample s;
    struct accelerometer *a = open_named("mma8452", &err);
    assert_non_null(a);
    assert_true(read_one(a, &s, &err));
    put(1, "in_accel_y_raw", "1024\n");
    put(1, "in_accel_z_raw", "0\n");
    assert_true(read_one(a, &s, &err));
    assert_near(s.tilt_deg, 90, arithmetic);
    put(1, "in_accel_z_raw", "1024\n");
    assert_true(read_one(a, &s, &err));
    assert_false(s.plausible);
    assert_int_equal(s.doubt, TILT_GRAVITY);
    put(1, "in_accel_y_raw", "0\n");
    iio_driver.close(a);
}

static void garbage_costs_a_reading_and_absence_is_gone(void **state)
{
    (void)state;
    struct error err = {0};
    struct tilt_sample s = {.tilt_deg = 77};
    struct accelerometer *a = open_named("mma8452", &err);
    assert_non_null(a);
    put(1, "in_accel_z_raw", "twelve\n");
    assert_false(read_one(a, &s, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_near(s.tilt_deg, 77, 0);
    put(1, "in_accel_z_raw", "1024\n");
    assert_true(read_one(a, &s, &err));
    char path[128];
    snprintf(path, sizeof path, "%s/" DEVICE, root.path, 1, "in_accel_x_raw");
    assert_int_equal(unlink(path), 0);
    assert_false(read_one(a, &s, &err));
    assert_int_equal(err.code, ERROR_GONE);
    iio_driver.close(a);
    put(1, "in_accel_x_raw", "0\n");
    assert_null(open_named("bma250", &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_non_null(strstr(err.text, "bma250"));
    iio_driver.close(NULL);
}

static void a_matrix_that_is_none_is_refused(void **state)
{
    (void)state;
    struct error err = {0};
    put(2, "in_mount_matrix", "1, 0, 0; 0, 1, 0\n");
    assert_null(open_named("lis3dh", &err));
    assert_int_equal(err.code, ERROR_DATA);
    put(2, "in_mount_matrix", "1, 0, 0; 0, -1, 0; 0, 0, 1\n");
}

static void accelerometers_are_listed_and_magnetometers_are_not(void **state)
{
    (void)state;
    static struct found_list list;
    found_iio(&list);
    assert_int_equal(list.count, 2);
    for (int i = 0; i < 2; i++) {
        bool first = !strcmp(list.of[i].model, "mma8452");
        assert_string_equal(list.of[i].serial, first ? "base" : "EMUtilt");
        assert_int_equal(list.of[i].access, FOUND_USABLE);
        assert_int_equal(list.of[i].emulated, !first);
    }
}

// Root may read everything, so the question is asked as nobody.
static void files_that_may_not_be_read_are_refused_and_the_rules_are_named(void **state)
{
    (void)state;
    char raw[128], scale[128];
    snprintf(raw, sizeof raw, "%s/" DEVICE, root.path, 1, "in_accel_x_raw");
    snprintf(scale, sizeof scale, "%s/" DEVICE, root.path, 2, "in_accel_x_scale");
    assert_int_equal(chmod(root.path, 0755), 0);
    assert_int_equal(chmod(raw, 0), 0);
    assert_int_equal(chmod(scale, 0), 0);
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        struct found_list list = {0};
        struct error open_err = {0}, read_err = {0};
        struct tilt_sample s;
        if (getuid() == 0 && setuid(NOBODY) != 0)
            _exit(77);
        found_iio(&list);
        struct accelerometer *one = open_named("mma8452", &open_err);
        bool none = !open_named("lis3dh", &open_err);
        bool read = one && read_one(one, &s, &read_err);
        iio_driver.close(one);
        _exit(!(list.count == 2 && list.of[0].access == FOUND_REFUSED &&
                strstr(list.of[0].note, UDEV_RULES_FILE) && list.of[1].access == FOUND_USABLE &&
                one && !read && udev_refused(&read_err) && none && udev_refused(&open_err)));
    }
    int status = -1;
    assert_int_equal(waitpid(child, &status, 0), child);
    chmod(raw, 0644);
    chmod(scale, 0644);
    assert_true(WIFEXITED(status));
    if (WEXITSTATUS(status) == 77) {
        print_message("skipped: this system gives no other user to ask as\n");
        return;
    }
    assert_int_equal(WEXITSTATUS(status), 0);
}

int main(int argc, char **argv)
{
    (void)argc;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mount_matrices_are_nine_numbers_that_keep_lengths),
        cmocka_unit_test(the_first_accelerometer_is_taken_and_a_shared_scale_counts),
        cmocka_unit_test(offsets_scales_and_the_mount_matrix_apply_in_their_order),
        cmocka_unit_test(new_values_are_read_and_shaking_is_implausible),
        cmocka_unit_test(garbage_costs_a_reading_and_absence_is_gone),
        cmocka_unit_test(a_matrix_that_is_none_is_refused),
        cmocka_unit_test(accelerometers_are_listed_and_magnetometers_are_not),
        cmocka_unit_test(files_that_may_not_be_read_are_refused_and_the_rules_are_named),
    };
    const char *preload = getenv("LD_PRELOAD");
    if (!preload || !strstr(preload, "umockdev")) {
        setenv("ASAN_OPTIONS", "verify_asan_link_order=0", 0); // the wrapper preloads before it
        execlp("umockdev-wrapper", "umockdev-wrapper", argv[0], (char *)NULL);
        perror("umockdev-wrapper");
        return 1;
    }
    return cmocka_run_group_tests(tests, a_tree, no_tree);
}
