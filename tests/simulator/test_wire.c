// SPDX-License-Identifier: Apache-2.0
// The four instruments through unmodified libusb, hidapi and libmodbus, called
// as any other program would. Runs itself again under umockdev-wrapper.
#include <fcntl.h>
#include <hidapi/hidapi.h>
#include <libusb.h>
#include <math.h>
#include <modbus.h>
#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include "simulator/wire.h"

#include <cmocka.h> // last: its fail() is a macro

enum { OCEAN_VENDOR = 0x2457, USB2000PLUS = 0x101E, NINTENDO = 0x057E, REMOTE = 0x0306 };
enum { COMMANDS = 0x01, REPLIES = 0x81, SPECTRA = 0x82, SPECTRUM_SIZE = 4097 };

// Generous: these bound hangs, nothing is measured with them.
#define REPLY_MS 2000
#define SILENCE_MS 150

// ---- the world: plain numbers -----------------------------------------------

struct world {
    double irradiance, radiance; // flat over the wavelengths
};

static void irradiance(void *context, int64_t from_ns, int64_t to_ns, struct spectrum *out)
{
    (void)from_ns, (void)to_ns;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = ((struct world *)context)->irradiance;
}

static struct vec3 gravity(void *context, int64_t at_ns)
{
    (void)context, (void)at_ns;
    return (struct vec3){0, 9.81 * sin(M_PI / 6), 9.81 * cos(M_PI / 6)}; // 30 degrees
}

static void markers(void *context, int64_t at_ns, struct vec3 out[3])
{
    (void)context, (void)at_ns;
    out[0] = (struct vec3){0.1, 0.04, 0.8};
    out[1] = (struct vec3){0.1, 0.0, 0.8};
    out[2] = (struct vec3){0.1, -0.07, 0.8};
}

static void radiance(void *context, int64_t at_ns, struct spectrum *out)
{
    (void)at_ns;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = ((struct world *)context)->radiance;
}

static struct world world = {.irradiance = 0.01, .radiance = 0.001};
static struct wire *wire;
static char folder[] = "/tmp/test_wire.XXXXXX";

static int start(void **state)
{
    (void)state;
    struct wire_options options = {
        .around = {&world, irradiance, gravity, markers, radiance},
        .run_dir = folder,
        .serial = {"EMU2+H00417", "EMUWT901", "EMU:WII:01", "EMU65500123"},
        .seed = 1,
        .radiometer_hurry = 100,
        .collector_mm2 = 11.95,
    };
    struct error err;
    assert_non_null(mkdtemp(folder));
    wire = wire_start(&options, &err);
    if (!wire)
        fail_msg("%s", err.text);
    return 0;
}

static int stop(void **state)
{
    (void)state;
    wire_stop(wire);
    char path[64];
    snprintf(path, sizeof(path), "%s/spectrometer.cal", folder);
    unlink(path);
    return rmdir(folder);
}

// ---- spectrometer ---------------------------------------------------------------

static libusb_device_handle *open_spectrometer(libusb_context *usb)
{
    libusb_device_handle *handle =
        libusb_open_device_with_vid_pid(usb, OCEAN_VENDOR, USB2000PLUS);
    if (handle)
        assert_int_equal(libusb_claim_interface(handle, 0), 0);
    return handle;
}

static int command(libusb_device_handle *handle, const char *bytes, int size)
{
    int sent;
    return libusb_bulk_transfer(handle, COMMANDS, (unsigned char *)bytes, size, &sent, REPLY_MS);
}

static int spectrum(libusb_device_handle *handle, unsigned char *bytes, int *size, int timeout_ms)
{
    assert_int_equal(command(handle, "\x09", 1), 0);
    return libusb_bulk_transfer(handle, SPECTRA, bytes, 4608, size, (unsigned)timeout_ms);
}

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

static void the_camera_answers_through_hidapi(void **state)
{
    (void)state;
    unsigned char bytes[64];
    assert_int_equal(hid_init(), 0);
    hid_device *camera = hid_open(NINTENDO, REMOTE, NULL);
    assert_non_null(camera);
    wchar_t text[64];
    assert_int_equal(hid_get_serial_number_string(camera, text, 64), 0);
    assert_int_equal(wcscmp(text, L"EMU:WII:01"), 0);
    assert_int_equal(hid_write(camera, (const unsigned char *)"\x13\x06", 2), 2);
    assert_int_equal(hid_read_timeout(camera, bytes, sizeof(bytes), REPLY_MS), 5);
    assert_int_equal(bytes[0], 0x22);
    hid_close(camera);
}

static void the_inclinometer_answers_through_libmodbus(void **state)
{
    (void)state;
    char path[64];
    uint16_t words[3];
    snprintf(path, sizeof(path), "%s/inclinometer", folder);
    modbus_t *client = modbus_new_rtu(path, 9600, 'N', 8, 1);
    modbus_set_slave(client, 0x50);
    assert_int_equal(modbus_connect(client), 0);
    assert_int_equal(modbus_read_registers(client, 0x3D, 3, words), 3);
    assert_true(fabs((int16_t)words[0] / 32768.0 * 180 - 30) < 0.2);
    modbus_close(client);
    modbus_free(client);
}

int main(int argc, char **argv)
{
    (void)argc;
    const char *preload = getenv("LD_PRELOAD");
    if (!preload || !strstr(preload, "umockdev")) {
        execlp("umockdev-wrapper", "umockdev-wrapper", argv[0], (char *)NULL);
        perror("umockdev-wrapper");
        return 1;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_spectrometer_tells_its_serial_and_a_spectrum),
        cmocka_unit_test(the_camera_answers_through_hidapi),
        cmocka_unit_test(the_inclinometer_answers_through_libmodbus),
    };
    return cmocka_run_group_tests(tests, start, stop);
}
