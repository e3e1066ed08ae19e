// SPDX-License-Identifier: Apache-2.0
// Every fault of the USB and HID wires as unmodified libusb and hidapi show
// it. Runs itself again under umockdev-wrapper.
#include <errno.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "base/clock.h"
#include "base/error.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/simulator/instruments_here.h"

#define UNTIL_GONE 200 // times 10 ms: bounds a hang

static void fine(void)
{
    set_fault(WIRE_SPECTROMETER, WIRE_FINE);
}

static void without_its_sync_byte_a_spectrum_never_ends(void **state)
{
    (void)state;
    struct opened o = open_usb();
    set_fault(WIRE_SPECTROMETER, WIRE_NO_SYNC);
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, SILENCE_MS), LIBUSB_ERROR_TIMEOUT);
    assert_int_equal(o.size, SPECTRUM_SIZE - 1);
    fine();
    spectrum(o.handle, o.bytes, &o.size, REPLY_MS); // may have been made before
    expect_good_spectrum(&o);
    close_usb(&o);
}

static void a_wrong_sync_byte_is_not_69(void **state)
{
    (void)state;
    struct opened o = open_usb();
    set_fault(WIRE_SPECTROMETER, WIRE_BAD_SYNC);
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, REPLY_MS), 0);
    assert_int_equal(o.size, SPECTRUM_SIZE);
    assert_int_not_equal(o.bytes[SPECTRUM_SIZE - 1], 0x69);
    fine();
    expect_good_spectrum(&o);
    close_usb(&o);
}

static void out_of_step_a_stale_byte_comes_first(void **state)
{
    (void)state;
    struct opened o = open_usb();
    set_fault(WIRE_SPECTROMETER, WIRE_OUT_OF_STEP);
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, REPLY_MS), 0);
    assert_int_equal(o.size, 1);
    assert_int_equal(o.bytes[0], 0x69);
    int size;
    assert_int_equal(libusb_bulk_transfer(o.handle, SPECTRA, o.bytes, sizeof(o.bytes), &size,
                                          REPLY_MS),
                     0);
    assert_int_equal(size, SPECTRUM_SIZE);
    fine();
    expect_good_spectrum(&o);
    close_usb(&o);
}

static void other_pixels_make_a_spectrum_of_half_the_size(void **state)
{
    (void)state;
    struct opened o = open_usb();
    set_fault(WIRE_SPECTROMETER, WIRE_OTHER_PIXELS);
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, REPLY_MS), 0);
    assert_int_equal(o.size, 2 * 1024 + 1);
    assert_int_equal(o.bytes[o.size - 1], 0x69);
    fine();
    expect_good_spectrum(&o);
    close_usb(&o);
}

static void babble_is_an_overflow(void **state)
{
    (void)state;
    struct opened o = open_usb();
    set_fault(WIRE_SPECTROMETER, WIRE_OVERFLOW);
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, REPLY_MS), LIBUSB_ERROR_OVERFLOW);
    fine();
    expect_good_spectrum(&o);
    close_usb(&o);
}

static uint32_t integration_us(struct opened *o)
{
    assert_int_equal(command(o->handle, "\xFE", 1), 0);
    assert_int_equal(libusb_bulk_transfer(o->handle, REPLIES, o->bytes, 64, &o->size, REPLY_MS),
                     0);
    assert_int_equal(o->size, 16);
    return (uint32_t)o->bytes[2] | (uint32_t)o->bytes[3] << 8 | (uint32_t)o->bytes[4] << 16;
}

static void a_deaf_spectrometer_keeps_its_integration_time(void **state)
{
    (void)state;
    struct opened o = open_usb();
    set_fault(WIRE_SPECTROMETER, WIRE_DEAF);
    assert_int_equal(command(o.handle, "\x02\x10\x27\x00\x00", 5), 0); // 10 ms
    assert_int_equal(integration_us(&o), 1000);
    fine();
    assert_int_equal(command(o.handle, "\x02\x10\x27\x00\x00", 5), 0);
    assert_int_equal(integration_us(&o), 10000);
    close_usb(&o);
}

static void wait_until_gone(libusb_context *usb)
{
    libusb_device_handle *handle = NULL;
    for (int i = 0; i < UNTIL_GONE; i++) {
        handle = libusb_open_device_with_vid_pid(usb, OCEAN_VENDOR, USB2000PLUS);
        if (!handle)
            return;
        libusb_close(handle);
        libusb_handle_events_timeout_completed(usb, &(struct timeval){0, 10000}, NULL);
    }
    fail_msg("still there");
}

static int number_of(const struct opened *o)
{
    return libusb_get_device_address(libusb_get_device(o->handle));
}

static void expect_back(struct opened *o, int number_before)
{
    close_usb(o);
    fine();
    *o = open_usb();
    assert_int_not_equal(number_of(o), number_before);
    expect_good_spectrum(o);
    close_usb(o);
}

static void it_is_pulled_in_mid_command(void **state)
{
    (void)state;
    struct opened o = open_usb();
    int number = number_of(&o);
    set_fault(WIRE_SPECTROMETER, WIRE_PULLED_IN_COMMAND);
    assert_int_equal(command(o.handle, "\xFE", 1), LIBUSB_ERROR_NO_DEVICE);
    wait_until_gone(o.usb);
    expect_back(&o, number);
}

static void it_is_pulled_in_mid_spectrum(void **state)
{
    (void)state;
    struct opened o = open_usb();
    int number = number_of(&o);
    set_fault(WIRE_SPECTROMETER, WIRE_PULLED_IN_SPECTRUM);
    assert_int_equal(integration_us(&o), 1000); // replies get through
    assert_int_equal(spectrum(o.handle, o.bytes, &o.size, REPLY_MS), LIBUSB_ERROR_NO_DEVICE);
    assert_int_equal(o.size, 512);
    wait_until_gone(o.usb);
    expect_back(&o, number);
}

// More often than a bus has numbers.
static void pulled_and_replugged_the_numbers_go_round(void **state)
{
    (void)state;
    for (int i = 0; i < 70; i++) {
        set_fault(WIRE_SPECTROMETER, WIRE_UNPLUGGED);
        fine();
    }
    struct opened o = open_usb();
    assert_in_range(number_of(&o), 2, 127);
    expect_good_spectrum(&o);
    close_usb(&o);
}

static void moved_it_is_at_another_bus(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        struct opened o = open_usb();
        int bus = libusb_get_bus_number(libusb_get_device(o.handle));
        set_fault(WIRE_SPECTROMETER, WIRE_MOVED);
        assert_int_equal(command(o.handle, "\xFE", 1), LIBUSB_ERROR_NO_DEVICE);
        close_usb(&o);
        o = open_usb();
        assert_int_equal(libusb_get_bus_number(libusb_get_device(o.handle)), 3 - bus);
        expect_good_spectrum(&o);
        fine();
        expect_good_spectrum(&o); // it stays there
        close_usb(&o);
    }
}

static void blank_it_is_a_bare_bridge_chip_until_fine(void **state)
{
    (void)state;
    libusb_context *usb;
    assert_int_equal(libusb_init(&usb), 0);
    for (int i = 0; i < 2; i++) {
        set_fault(WIRE_SPECTROMETER, WIRE_BLANK);
        assert_null(open_spectrometer(usb));
        libusb_device_handle *bare = libusb_open_device_with_vid_pid(usb, 0x04B4, 0x8613);
        assert_non_null(bare);
        assert_int_equal(libusb_claim_interface(bare, 0), 0);
        assert_int_equal(command(bare, "\xFE", 1), LIBUSB_ERROR_PIPE);
        libusb_close(bare);
        set_fault(WIRE_SPECTROMETER, WIRE_UNPLUGGED);
        assert_null(libusb_open_device_with_vid_pid(usb, 0x04B4, 0x8613));
        fine();
        struct opened o = open_usb();
        expect_good_spectrum(&o);
        close_usb(&o);
    }
    libusb_exit(usb);
}

static void without_permission_it_is_seen_and_cannot_be_opened(void **state)
{
    (void)state;
    libusb_context *usb;
    libusb_device **list;
    libusb_device_handle *handle;
    assert_int_equal(libusb_init(&usb), 0);
    set_fault(WIRE_SPECTROMETER, WIRE_FORBIDDEN);
    ssize_t count = libusb_get_device_list(usb, &list);
    assert_int_equal(count, 1);
    assert_int_equal(libusb_open(list[0], &handle), LIBUSB_ERROR_ACCESS);
    fine();
    assert_int_equal(libusb_open(list[0], &handle), 0);
    libusb_close(handle);
    libusb_free_device_list(list, 1);
    libusb_exit(usb);
}

// ---- camera ---------------------------------------------------------------------------

static void the_camera_cannot_be_opened_without_permission(void **state)
{
    (void)state;
    set_fault(WIRE_CAMERA, WIRE_FORBIDDEN);
    assert_null(hid_open(NINTENDO, REMOTE, NULL));
    struct hid_device_info *info = hid_enumerate(NINTENDO, REMOTE);
    assert_non_null(info);
    hid_free_enumeration(info);
    set_fault(WIRE_CAMERA, WIRE_FINE);
    hid_device *camera = open_camera();
    assert_non_null(camera);
    expect_points(camera);
    hid_close(camera);
}

static int reports_at_once(hid_device *camera)
{
    unsigned char report[64];
    int count = 0;
    assert_true(camera_read(camera, report, REPLY_MS) > 0);
    while (count < 1000 && camera_read(camera, report, 1) > 0)
        count++;
    return count;
}

static void a_flood_comes_faster_than_one_reads(void **state)
{
    (void)state;
    hid_device *camera = open_camera();
    set_fault(WIRE_CAMERA, WIRE_FLOOD);
    int most = 0;
    for (int i = 0; i < 20 && most < 49; i++) { // the first may be from before
        int count = reports_at_once(camera);
        most = count > most ? count : most;
    }
    assert_true(most >= 49);
    set_fault(WIRE_CAMERA, WIRE_FINE);
    unsigned char report[64];
    while (camera_read(camera, report, 0) > 0)
        continue;
    expect_points(camera);
    hid_close(camera);
}

static void a_wrong_report_has_another_id(void **state)
{
    (void)state;
    unsigned char report[64];
    hid_device *camera = open_camera();
    set_fault(WIRE_CAMERA, WIRE_WRONG_REPORT);
    while (camera_read(camera, report, 0) > 0)
        continue;
    assert_true(camera_read(camera, report, REPLY_MS) > 0);
    assert_int_equal(report[0], 0x3D);
    set_fault(WIRE_CAMERA, WIRE_FINE);
    expect_points(camera);
    hid_close(camera);
}

static void a_fault_of_another_wire_changes_nothing(void **state)
{
    (void)state;
    assert_true(wire_fault_suits(WIRE_SPECTROMETER, WIRE_DEAF));
    assert_true(wire_fault_suits(WIRE_SPECTROMETER_2, WIRE_DEAF));
    assert_false(wire_fault_suits(WIRE_CAMERA, WIRE_DEAF));
    assert_false(wire_fault_suits(WIRE_SPECTROMETER, WIRE_BAD_CRC));
    set_fault(WIRE_SPECTROMETER, WIRE_BAD_CRC);
    set_fault(WIRE_SPECTROMETER_2, WIRE_UNPLUGGED); // there is none
    struct opened o = open_usb();
    expect_good_spectrum(&o);
    close_usb(&o);
}

// ---- enumeration -----------------------------------------------------------------------

#define NEVER_S 1000.0 // the test does not wait for it

static int start_slow(void **state)
{
    (void)state;
    struct wire_options options = usual();
    options.enumeration_s = options.line_enumeration_s = NEVER_S;
    return start_with(&options);
}

static void let_pass(double seconds)
{
    wire_enumerate(wire, clock_now_ns() + (int64_t)(seconds * NS_PER_S));
}

static bool camera_is_there(void)
{
    struct hid_device_info *info = hid_enumerate(NINTENDO, REMOTE);
    hid_free_enumeration(info);
    return info;
}

static bool spectrometer_is_there(void)
{
    libusb_context *usb;
    assert_int_equal(libusb_init(&usb), 0);
    libusb_device_handle *handle = open_spectrometer(usb);
    libusb_close(handle);
    libusb_exit(usb);
    return handle;
}

static bool radiometer_is_there(void)
{
    return access(in_folder("radiometer"), F_OK) == 0;
}

static void plugged_again_they_show_once_enumerated(void **state)
{
    (void)state;
    const struct {
        enum wire_instrument instrument;
        bool (*is_there)(void);
    } rows[] = {{WIRE_SPECTROMETER, spectrometer_is_there},
                {WIRE_CAMERA, camera_is_there},
                {WIRE_RADIOMETER, radiometer_is_there}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        assert_true(rows[i].is_there());
        set_fault(rows[i].instrument, WIRE_UNPLUGGED);
        assert_false(rows[i].is_there());
        set_fault(rows[i].instrument, WIRE_FINE);
        let_pass(NEVER_S / 2);
        assert_false(rows[i].is_there());
        let_pass(NEVER_S + 1);
        assert_true(rows[i].is_there());
    }
}

static void pulled_again_before_it_is_enumerated_it_does_not_show(void **state)
{
    (void)state;
    set_fault(WIRE_CAMERA, WIRE_UNPLUGGED);
    set_fault(WIRE_CAMERA, WIRE_FINE);
    set_fault(WIRE_CAMERA, WIRE_UNPLUGGED);
    let_pass(NEVER_S + 1);
    assert_false(camera_is_there());
    set_fault(WIRE_CAMERA, WIRE_FINE);
    let_pass(NEVER_S + 1);
    assert_true(camera_is_there());
}

static void a_fault_set_meanwhile_is_there_when_it_shows(void **state)
{
    (void)state;
    set_fault(WIRE_CAMERA, WIRE_UNPLUGGED);
    set_fault(WIRE_CAMERA, WIRE_FORBIDDEN);
    let_pass(NEVER_S + 1);
    assert_true(camera_is_there());
    assert_null(hid_open(NINTENDO, REMOTE, NULL));
    set_fault(WIRE_CAMERA, WIRE_FINE);
    hid_device *camera = hid_open(NINTENDO, REMOTE, NULL);
    assert_non_null(camera);
    hid_close(camera);
}

static void spotread_s_instrument_tells_what_it_suffers(void **state)
{
    (void)state;
    int before, pulled;
    assert_int_equal(wire_fault_of(wire, WIRE_SPOTREAD, &before), WIRE_FINE);
    set_fault(WIRE_SPOTREAD, WIRE_OVERLOAD);
    assert_int_equal(wire_fault_of(wire, WIRE_SPOTREAD, &pulled), WIRE_OVERLOAD);
    assert_int_equal(pulled, before);
    set_fault(WIRE_SPOTREAD, WIRE_UNPLUGGED);
    set_fault(WIRE_SPOTREAD, WIRE_FINE); // not enumerated yet
    assert_int_equal(wire_fault_of(wire, WIRE_SPOTREAD, &pulled), WIRE_UNPLUGGED);
    let_pass(NEVER_S + 1);
    assert_int_equal(wire_fault_of(wire, WIRE_SPOTREAD, &pulled), WIRE_FINE);
    assert_int_equal(pulled, before + 1);
}

static void moving_takes_an_enumeration_too(void **state)
{
    (void)state;
    set_fault(WIRE_SPECTROMETER, WIRE_MOVED);
    set_fault(WIRE_SPECTROMETER, WIRE_FINE);
    assert_false(spectrometer_is_there());
    let_pass(NEVER_S + 1);
    assert_true(spectrometer_is_there());
}

int main(int argc, char **argv)
{
    (void)argc;
    if (under_umockdev(argv[0]))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_its_sync_byte_a_spectrum_never_ends),
        cmocka_unit_test(a_wrong_sync_byte_is_not_69),
        cmocka_unit_test(out_of_step_a_stale_byte_comes_first),
        cmocka_unit_test(other_pixels_make_a_spectrum_of_half_the_size),
        cmocka_unit_test(babble_is_an_overflow),
        cmocka_unit_test(a_deaf_spectrometer_keeps_its_integration_time),
        cmocka_unit_test(it_is_pulled_in_mid_command),
        cmocka_unit_test(it_is_pulled_in_mid_spectrum),
        cmocka_unit_test(moved_it_is_at_another_bus),
        cmocka_unit_test(blank_it_is_a_bare_bridge_chip_until_fine),
        cmocka_unit_test(without_permission_it_is_seen_and_cannot_be_opened),
        cmocka_unit_test(pulled_and_replugged_the_numbers_go_round),
        cmocka_unit_test(the_camera_cannot_be_opened_without_permission),
        cmocka_unit_test(a_flood_comes_faster_than_one_reads),
        cmocka_unit_test(a_wrong_report_has_another_id),
        cmocka_unit_test(a_fault_of_another_wire_changes_nothing),
    };
    const struct CMUnitTest slow[] = {
        cmocka_unit_test(plugged_again_they_show_once_enumerated),
        cmocka_unit_test(pulled_again_before_it_is_enumerated_it_does_not_show),
        cmocka_unit_test(a_fault_set_meanwhile_is_there_when_it_shows),
        cmocka_unit_test(spotread_s_instrument_tells_what_it_suffers),
        cmocka_unit_test(moving_takes_an_enumeration_too),
    };
    return cmocka_run_group_tests(tests, start, stop) +
           cmocka_run_group_tests(slow, start_slow, stop);
}
