// SPDX-License-Identifier: Apache-2.0
// Spectrometer and camera through unmodified libusb and hidapi, called as any
// other program would. Runs itself again under umockdev-wrapper.
#include <errno.h>
#include <hidapi/hidapi.h>
#include <libusb.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/wait.h>

#include "base/error.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/simulator/instruments_here.h"

// ---- spectrometer ---------------------------------------------------------------

static void the_spectrometer_tells_its_serial_and_a_spectrum(void **state)
{
    (void)state;
    libusb_context *usb;
    unsigned char bytes[4608];
    int size;
    assert_int_equal(libusb_init(&usb), 0);
    libusb_device_handle *handle = open_spectrometer(usb);
    assert_non_null(handle);
    assert_int_equal(libusb_get_string_descriptor_ascii(handle, 3, bytes, sizeof(bytes)), 11);
    assert_string_equal((char *)bytes, "EMU2+H00417");

    assert_int_equal(command(handle, "\x05\x00", 2), 0);
    assert_int_equal(libusb_bulk_transfer(handle, REPLIES, bytes, 64, &size, REPLY_MS), 0);
    assert_int_equal(size, 17);
    assert_string_equal((char *)bytes + 2, "EMU2+H00417");

    assert_int_equal(command(handle, "\x02\x10\x27\x00\x00", 5), 0); // 10 ms
    assert_int_equal(spectrum(handle, bytes, &size, REPLY_MS), 0);
    assert_int_equal(size, SPECTRUM_SIZE);
    assert_int_equal(bytes[SPECTRUM_SIZE - 1], 0x69);
    libusb_close(handle);
    libusb_exit(usb);
}

static void an_unknown_command_is_a_pipe_error(void **state)
{
    (void)state;
    struct opened o = open_usb();
    assert_int_equal(command(o.handle, "\x55", 1), LIBUSB_ERROR_PIPE);
    assert_int_equal(libusb_clear_halt(o.handle, COMMANDS), 0);
    expect_good_spectrum(&o);
    close_usb(&o);
}

static void a_buffer_too_small_overflows(void **state)
{
    (void)state;
    struct opened o = open_usb();
    int size;
    assert_int_equal(command(o.handle, "\x09", 1), 0);
    assert_int_equal(libusb_bulk_transfer(o.handle, SPECTRA, o.bytes, 1000, &size, REPLY_MS),
                     LIBUSB_ERROR_OVERFLOW);
    close_usb(&o);
}

static void a_stalled_spectrum_comes_back_after_clear_halt(void **state)
{
    (void)state;
    struct opened o = open_usb();
    set_fault(WIRE_SPECTROMETER, WIRE_STALL);
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, REPLY_MS), LIBUSB_ERROR_PIPE);
    assert_int_equal(libusb_clear_halt(o.handle, SPECTRA), 0);
    expect_good_spectrum(&o);
    set_fault(WIRE_SPECTROMETER, WIRE_FINE);
    close_usb(&o);
}

static void a_silent_spectrometer_times_out_and_recovers(void **state)
{
    (void)state;
    struct opened o = open_usb();
    set_fault(WIRE_SPECTROMETER, WIRE_SILENT);
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, SILENCE_MS), LIBUSB_ERROR_TIMEOUT);
    assert_int_equal(o.size, 0);
    set_fault(WIRE_SPECTROMETER, WIRE_FINE);
    expect_good_spectrum(&o);
    close_usb(&o);
}

static void garbage_and_short_spectra_show_as_such(void **state)
{
    (void)state;
    struct opened o = open_usb();
    set_fault(WIRE_SPECTROMETER, WIRE_GARBAGE);
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, REPLY_MS), 0);
    assert_int_equal(o.size, SPECTRUM_SIZE);
    int beyond = 0; // a real pixel never exceeds the saturation of 26000
    for (int p = 0; p < 2048; p++)
        beyond += (o.bytes[2 * p] | o.bytes[2 * p + 1] << 8) > 26000;
    assert_true(beyond > 500);
    set_fault(WIRE_SPECTROMETER, WIRE_SHORT);
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, REPLY_MS), 0);
    assert_in_range(o.size, 1, SPECTRUM_SIZE - 1);
    set_fault(WIRE_SPECTROMETER, WIRE_FINE);
    expect_good_spectrum(&o);
    close_usb(&o);
}

static int arrived, left;

static int on_hotplug(libusb_context *usb, libusb_device *device, libusb_hotplug_event event,
                      void *data)
{
    (void)usb, (void)device, (void)data;
    arrived += event == LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED;
    left += event == LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT;
    return 0;
}

static void on_transfer(struct libusb_transfer *transfer)
{
    *(int *)transfer->user_data = 1;
}

static void handle_events_until(libusb_context *usb, const int *flag, int value)
{
    for (int i = 0; i < 100 && *flag < value; i++)
        libusb_handle_events_timeout_completed(usb, &(struct timeval){0, REPLY_MS * 10}, NULL);
    assert_int_equal(*flag, value);
}

static void pulled_in_mid_transfer_and_plugged_again_ten_times(void **state)
{
    (void)state;
    struct opened o = open_usb();
    libusb_hotplug_callback_handle callback;
    arrived = left = 0;
    libusb_hotplug_register_callback(
        o.usb, LIBUSB_HOTPLUG_EVENT_DEVICE_ARRIVED | LIBUSB_HOTPLUG_EVENT_DEVICE_LEFT, 0,
        OCEAN_VENDOR, USB2000PLUS, LIBUSB_HOTPLUG_MATCH_ANY, on_hotplug, NULL, &callback);
    struct libusb_transfer *transfer = libusb_alloc_transfer(0);
    for (int cycle = 1; cycle <= 10; cycle++) {
        int done = 0;
        libusb_fill_bulk_transfer(transfer, o.handle, SPECTRA, o.bytes, sizeof(o.bytes),
                                  on_transfer, &done, 0);
        assert_int_equal(libusb_submit_transfer(transfer), 0);
        set_fault(WIRE_SPECTROMETER, WIRE_UNPLUGGED);
        handle_events_until(o.usb, &done, 1);
        assert_int_equal(transfer->status, LIBUSB_TRANSFER_NO_DEVICE);
        handle_events_until(o.usb, &left, cycle);
        assert_int_equal(command(o.handle, "\x09", 1), LIBUSB_ERROR_NO_DEVICE);
        libusb_close(o.handle);
        assert_null(open_spectrometer(o.usb));

        set_fault(WIRE_SPECTROMETER, WIRE_FINE);
        handle_events_until(o.usb, &arrived, cycle);
        o.handle = open_spectrometer(o.usb);
        assert_non_null(o.handle);
        command(o.handle, "\x02\xE8\x03\x00\x00", 5);
        expect_good_spectrum(&o);
    }
    libusb_free_transfer(transfer);
    libusb_hotplug_deregister_callback(o.usb, callback);
    close_usb(&o);
}

// What another process sees; the test programs run it as their child.
static int as_child(void)
{
    libusb_context *usb;
    unsigned char bytes[4608];
    int size;
    if (libusb_init(&usb) != 0)
        return 1;
    libusb_device_handle *handle = libusb_open_device_with_vid_pid(usb, OCEAN_VENDOR, USB2000PLUS);
    if (!handle || libusb_claim_interface(handle, 0) != 0)
        return 2;
    if (command(handle, "\x09", 1) != 0)
        return 3;
    if (libusb_bulk_transfer(handle, SPECTRA, bytes, sizeof(bytes), &size, REPLY_MS) != 0)
        return 4;
    libusb_close(handle);
    libusb_exit(usb);
    return size == SPECTRUM_SIZE && bytes[size - 1] == 0x69 ? 0 : 5;
}

static const char *own_path;

static void another_process_reads_a_spectrum(void **state)
{
    (void)state;
    pid_t child = fork();
    if (child == 0) {
        execl(own_path, own_path, "--child", (char *)NULL);
        _exit(127);
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

// Waits for a spectrum nobody asked for, to be killed meanwhile.
static int as_victim(void)
{
    libusb_context *usb;
    unsigned char bytes[4608];
    int size;
    if (libusb_init(&usb) != 0)
        return 1;
    libusb_device_handle *handle = libusb_open_device_with_vid_pid(usb, OCEAN_VENDOR, USB2000PLUS);
    if (!handle || libusb_claim_interface(handle, 0) != 0 || command(handle, "\xFE", 1) != 0)
        return 2;
    if (write(STDOUT_FILENO, "x", 1) != 1)
        return 3;
    return libusb_bulk_transfer(handle, SPECTRA, bytes, sizeof(bytes), &size, 0);
}

static void a_program_killed_in_mid_transfer_does_no_harm(void **state)
{
    (void)state;
    int ends[2];
    char byte;
    assert_int_equal(pipe(ends), 0);
    pid_t child = fork();
    if (child == 0) {
        dup2(ends[1], STDOUT_FILENO);
        execl(own_path, own_path, "--victim", (char *)NULL);
        _exit(127);
    }
    close(ends[1]);
    assert_int_equal(read(ends[0], &byte, 1), 1);
    kill(child, SIGKILL);
    assert_int_equal(waitpid(child, NULL, 0), child);
    close(ends[0]);
    struct opened o = open_usb();
    unsigned char left_over[64];
    int size;
    libusb_bulk_transfer(o.handle, REPLIES, left_over, sizeof(left_over), &size, REPLY_MS);
    expect_good_spectrum(&o);
    close_usb(&o);
}

// ---- camera ---------------------------------------------------------------------

static void the_camera_shows_points_through_hidapi(void **state)
{
    (void)state;
    hid_device *camera = open_camera();
    assert_non_null(camera);
    expect_points(camera);
    hid_close(camera);
}

static void the_camera_names_itself(void **state)
{
    (void)state;
    struct hid_device_info *info = hid_enumerate(NINTENDO, REMOTE);
    assert_non_null(info);
    assert_null(info->next);
    assert_int_equal(wcscmp(info->product_string, L"Nintendo RVL-CNT-01"), 0);
    assert_int_equal(wcscmp(info->serial_number, L"EMU:WII:01"), 0);
    hid_free_enumeration(info);
}

static void the_camera_s_faults_show(void **state)
{
    (void)state;
    unsigned char report[64];
    hid_device *camera = open_camera();
    assert_non_null(camera);
    set_fault(WIRE_CAMERA, WIRE_SILENT);
    while (camera_read(camera, report, 0) > 0)
        continue; // what had come before
    assert_int_equal(camera_read(camera, report, SILENCE_MS), 0);
    set_fault(WIRE_CAMERA, WIRE_SHORT);
    assert_int_equal(camera_read(camera, report, REPLY_MS), 9);
    set_fault(WIRE_CAMERA, WIRE_FINE);
    expect_points(camera);
    set_fault(WIRE_CAMERA, WIRE_STALL); // a status unasked, then nothing
    do
        assert_true(camera_read(camera, report, REPLY_MS) > 0);
    while (report[0] != 0x20);
    assert_int_equal(camera_read(camera, report, SILENCE_MS), 0);
    set_fault(WIRE_CAMERA, WIRE_FINE);
    hid_close(camera);
    camera = open_camera();
    expect_points(camera);
    hid_close(camera);
}

static void the_camera_s_link_breaks_and_returns_ten_times(void **state)
{
    (void)state;
    unsigned char report[64];
    for (int cycle = 0; cycle < 10; cycle++) {
        hid_device *camera = open_camera();
        assert_non_null(camera);
        expect_points(camera);
        set_fault(WIRE_CAMERA, WIRE_UNPLUGGED);
        int size;
        do
            size = camera_read(camera, report, REPLY_MS);
        while (size > 0);
        assert_int_equal(size, -1);
        assert_int_equal(hid_write(camera, (const unsigned char *)"\x15\x00", 2), -1);
        hid_close(camera);
        assert_null(hid_open(NINTENDO, REMOTE, NULL));
        set_fault(WIRE_CAMERA, WIRE_FINE);
    }
}

// ---- start ----------------------------------------------------------------------------

static void a_serial_that_hides_the_emulation_is_refused(void **state)
{
    (void)state;
    struct wire_options options = {.serial = {"EMU1", "EMU2", "12345", "EMU4"}};
    struct error err = {0};
    assert_null(wire_start(&options, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_non_null(strstr(err.text, "12345"));
}

static void the_calibration_file_is_there(void **state)
{
    (void)state;
    double nm = 0, k = 0;
    int lines = 0;
    FILE *file = fopen(in_folder("spectrometer.cal"), "r");
    assert_non_null(file);
    assert_int_equal(fscanf(file, "nm,uJ_per_count\n"), 0);
    while (fscanf(file, "%lf,%lf\n", &nm, &k) == 2) {
        assert_int_equal((int)nm, 340 + lines++);
        assert_true(k > 0 && k < 1);
    }
    fclose(file);
    assert_int_equal((int)nm, 1027);
}

int main(int argc, char **argv)
{
    own_path = argv[0];
    if (argc > 1)
        return strcmp(argv[1], "--victim") == 0 ? as_victim() : as_child();
    if (under_umockdev(argv[0]))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_spectrometer_tells_its_serial_and_a_spectrum),
        cmocka_unit_test(an_unknown_command_is_a_pipe_error),
        cmocka_unit_test(a_buffer_too_small_overflows),
        cmocka_unit_test(a_stalled_spectrum_comes_back_after_clear_halt),
        cmocka_unit_test(a_silent_spectrometer_times_out_and_recovers),
        cmocka_unit_test(garbage_and_short_spectra_show_as_such),
        cmocka_unit_test(pulled_in_mid_transfer_and_plugged_again_ten_times),
        cmocka_unit_test(another_process_reads_a_spectrum),
        cmocka_unit_test(a_program_killed_in_mid_transfer_does_no_harm),
        cmocka_unit_test(the_camera_shows_points_through_hidapi),
        cmocka_unit_test(the_camera_names_itself),
        cmocka_unit_test(the_camera_s_faults_show),
        cmocka_unit_test(the_camera_s_link_breaks_and_returns_ten_times),
        cmocka_unit_test(a_serial_that_hides_the_emulation_is_refused),
        cmocka_unit_test(the_calibration_file_is_there),
    };
    hid_init();
    int failed = cmocka_run_group_tests(tests, start, stop);
    hid_exit();
    return failed;
}
