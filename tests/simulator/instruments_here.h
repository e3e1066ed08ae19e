// SPDX-License-Identifier: Apache-2.0
// Spectrometer and camera as any program would call them, for the test programs
// of the wire. Include after cmocka.h.
#ifndef TESTS_SIMULATOR_INSTRUMENTS_HERE_H
#define TESTS_SIMULATOR_INSTRUMENTS_HERE_H

#include <hidapi/hidapi.h>
#include <libusb.h>

#include "tests/simulator/wire_here.h"

enum { OCEAN_VENDOR = 0x2457, USB2000PLUS = 0x101E, NINTENDO = 0x057E, REMOTE = 0x0306 };
enum { COMMANDS = 0x01, REPLIES = 0x81, SPECTRA = 0x82, SPECTRUM_SIZE = 4097 };

static inline libusb_device_handle *open_spectrometer(libusb_context *usb)
{
    libusb_device_handle *handle =
        libusb_open_device_with_vid_pid(usb, OCEAN_VENDOR, USB2000PLUS);
    if (handle)
        assert_int_equal(libusb_claim_interface(handle, 0), 0);
    return handle;
}

static inline int command(libusb_device_handle *handle, const char *bytes, int size)
{
    int sent;
    return libusb_bulk_transfer(handle, COMMANDS, (unsigned char *)bytes, size, &sent, REPLY_MS);
}

static inline int spectrum(libusb_device_handle *handle, unsigned char *bytes, int *size, int timeout_ms)
{
    assert_int_equal(command(handle, "\x09", 1), 0);
    return libusb_bulk_transfer(handle, SPECTRA, bytes, 4608, size, (unsigned)timeout_ms);
}

struct opened {
    libusb_context *usb;
    libusb_device_handle *handle;
    unsigned char bytes[4608];
    int size;
};

static inline struct opened open_usb(void)
{
    struct opened o = {0};
    assert_int_equal(libusb_init(&o.usb), 0);
    o.handle = open_spectrometer(o.usb);
    assert_non_null(o.handle);
    assert_int_equal(command(o.handle, "\x02\xE8\x03\x00\x00", 5), 0); // 1 ms
    return o;
}

static inline void close_usb(struct opened *o)
{
    libusb_close(o->handle);
    libusb_exit(o->usb);
}

static inline void expect_good_spectrum(struct opened *o)
{
    assert_int_equal(spectrum(o->handle, o->bytes, &o->size, REPLY_MS), 0);
    assert_int_equal(o->size, SPECTRUM_SIZE);
    assert_int_equal(o->bytes[SPECTRUM_SIZE - 1], 0x69);
}

static inline int camera_read(hid_device *camera, unsigned char *report, int timeout_ms)
{
    return hid_read_timeout(camera, report, 64, timeout_ms);
}

static inline void camera_write(hid_device *camera, const char *bytes, size_t size)
{
    unsigned char report[64];
    assert_int_equal(hid_write(camera, (const unsigned char *)bytes, size), (int)size);
    if (bytes[0] != 0x16)
        return;
    do
        assert_true(camera_read(camera, report, REPLY_MS) > 0);
    while (report[0] != 0x22);
    assert_int_equal(report[4], 0);
}

static inline hid_device *open_camera(void)
{
    hid_device *camera = hid_open(NINTENDO, REMOTE, L"EMU:WII:01");
    if (!camera)
        return NULL;
    camera_write(camera, "\x13\x04", 2);
    camera_write(camera, "\x1A\x04", 2);
    camera_write(camera, "\x16\x04\xB0\x00\x30\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 22);
    camera_write(camera,
                 "\x16\x04\xB0\x00\x00\x09\x02\x00\x00\x71\x01\x00\xAA\x00\x64\0\0\0\0\0\0\0", 22);
    camera_write(camera, "\x16\x04\xB0\x00\x1A\x02\x63\x03\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 22);
    camera_write(camera, "\x16\x04\xB0\x00\x33\x01\x03\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 22);
    camera_write(camera, "\x12\x04\x33", 3);
    return camera;
}

static inline void expect_points(hid_device *camera)
{
    unsigned char report[64] = {0};
    for (int i = 0; i < 20 && !(report[0] == 0x33 && report[6] != 0xFF); i++)
        assert_true(camera_read(camera, report, REPLY_MS) > 0);
    int x = report[6] | (report[8] >> 4 & 3) << 8;
    assert_true(abs(x - (512 - 167)) < 5); // 1334 px x 0.1 / 0.8, noise 0.5 px
    assert_memory_equal(report + 15, "\xFF\xFF\xFF", 3);
}

#endif
