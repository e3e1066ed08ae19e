// SPDX-License-Identifier: Apache-2.0
// Which endpoint a spectrum is read from, model by model. libusb itself is
// replaced here: what counts is what the driver asks of it.
#include <libusb.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/clock.h"
#include "drivers/ocean_usb.h"

#include <cmocka.h>

enum { CALLS_MOST = 16 };

static struct {
    unsigned product;
    int endpoints; // given in the descriptors, of 01, 81, 82, 86
    size_t left_82, left_86;
    int calls, ended, endpoint[CALLS_MOST], wanted[CALLS_MOST];
} bus;

static const uint8_t addresses[] = {0x01, 0x81, 0x82, 0x86};
static struct libusb_endpoint_descriptor endpoints[4];
static struct libusb_interface_descriptor face = {.endpoint = endpoints};
static struct libusb_interface interfaces = {.altsetting = &face, .num_altsetting = 1};
static struct libusb_config_descriptor config = {.bNumInterfaces = 1, .interface = &interfaces};
static char a_device, a_handle;

int libusb_init(libusb_context **context)
{
    *context = NULL;
    return 0;
}

void libusb_exit(libusb_context *context)
{
    (void)context;
}

ssize_t libusb_get_device_list(libusb_context *context, libusb_device ***list)
{
    static libusb_device *devices[2];
    (void)context;
    devices[0] = (libusb_device *)&a_device;
    *list = devices;
    return 1;
}

void libusb_free_device_list(libusb_device **list, int unref)
{
    (void)list;
    (void)unref;
}

libusb_device *libusb_ref_device(libusb_device *device)
{
    return device;
}

void libusb_unref_device(libusb_device *device)
{
    (void)device;
}

int libusb_get_device_descriptor(libusb_device *device, struct libusb_device_descriptor *out)
{
    (void)device;
    *out =
        (struct libusb_device_descriptor){.idVendor = 0x2457, .idProduct = (uint16_t)bus.product};
    return 0;
}

int libusb_get_config_descriptor(libusb_device *device, uint8_t index,
                                 struct libusb_config_descriptor **out)
{
    (void)device;
    (void)index;
    for (int i = 0; i < 4; i++)
        endpoints[i] = (struct libusb_endpoint_descriptor){
            .bEndpointAddress = addresses[i], .bmAttributes = 2, .wMaxPacketSize = 512};
    face.bNumEndpoints = (uint8_t)bus.endpoints;
    *out = &config;
    return 0;
}

void libusb_free_config_descriptor(struct libusb_config_descriptor *gone)
{
    (void)gone;
}

int libusb_open(libusb_device *device, libusb_device_handle **handle)
{
    (void)device;
    *handle = (libusb_device_handle *)&a_handle;
    return 0;
}

void libusb_close(libusb_device_handle *handle)
{
    (void)handle;
}

int libusb_set_auto_detach_kernel_driver(libusb_device_handle *handle, int enable)
{
    (void)handle;
    return enable ? 0 : LIBUSB_ERROR_OTHER;
}

int libusb_get_configuration(libusb_device_handle *handle, int *out)
{
    (void)handle;
    *out = 1;
    return 0;
}

int libusb_claim_interface(libusb_device_handle *handle, int number)
{
    (void)handle;
    return number;
}

int libusb_release_interface(libusb_device_handle *handle, int number)
{
    (void)handle;
    return number;
}

// Gives what is left on an endpoint, each byte the low one of its address.
int libusb_bulk_transfer(libusb_device_handle *handle, unsigned char endpoint, unsigned char *data,
                         int length, int *moved, unsigned timeout)
{
    (void)handle;
    size_t *left = endpoint == 0x86 ? &bus.left_86 : &bus.left_82;
    assert_true(timeout > 0);
    assert_true(bus.calls < CALLS_MOST);
    bus.endpoint[bus.calls] = endpoint;
    bus.wanted[bus.calls++] = length;
    *moved = 0;
    if (endpoint == 0x81 || *left == 0)
        return LIBUSB_ERROR_TIMEOUT;
    *moved = *left < (size_t)length ? (int)*left : length;
    memset(data, endpoint, (size_t)*moved);
    *left -= (size_t)*moved;
    return 0;
}

static struct ocean_usb *plug(unsigned product, int given, struct error *err)
{
    memset(&bus, 0, sizeof bus);
    bus.product = product;
    bus.endpoints = given;
    return ocean_usb_open(0, err);
}

static void at_high_speed_the_first_part_comes_on_86(void **state)
{
    (void)state;
    const unsigned products[] = {0x1022, 0x1012};
    for (int i = 0; i < 2; i++) {
        uint8_t bytes[OCEAN_BYTES_MOST + 1];
        size_t count;
        struct ocean_usb *usb = plug(products[i], 4, NULL);
        assert_non_null(usb);
        bus.left_86 = 2048;
        bus.left_82 = 5633;
        assert_true(ocean_usb_spectrum(usb, true, bytes, sizeof bytes, 1000, &count, NULL));
        assert_int_equal(bus.calls, 2);
        assert_int_equal(bus.endpoint[0], 0x86);
        assert_int_equal(bus.wanted[0], 2048);
        assert_int_equal(bus.endpoint[1], 0x82);
        assert_int_equal(count, ocean_bytes(ocean_usb_model(usb)));
        assert_int_equal(bytes[2047], 0x86);
        assert_int_equal(bytes[2048], 0x82);
        ocean_usb_close(usb);
    }
}

static void at_full_speed_and_from_the_others_all_comes_on_82(void **state)
{
    (void)state;
    for (const struct ocean_model *m = ocean_models; m->name; m++)
        for (int high = 0; high < 2; high++) {
            uint8_t bytes[OCEAN_BYTES_MOST + 1];
            size_t count;
            if (high && m->split_bytes)
                continue;
            struct ocean_usb *usb = plug(m->product, 4, NULL);
            assert_non_null(usb);
            assert_ptr_equal(ocean_usb_model(usb), m);
            bus.left_82 = ocean_bytes(m);
            assert_true(ocean_usb_spectrum(usb, high, bytes, sizeof bytes, 1000, &count, NULL));
            assert_int_equal(bus.calls, 1);
            assert_int_equal(bus.endpoint[0], 0x82);
            assert_true(bus.wanted[0] > (int)ocean_bytes(m)); // a longer one would be seen
            assert_int_equal(count, ocean_bytes(m));
            ocean_usb_close(usb);
        }
}

static void a_first_part_cut_short_is_not_filled_from_elsewhere(void **state)
{
    (void)state;
    uint8_t bytes[OCEAN_BYTES_MOST + 1];
    static uint16_t raw[OCEAN_PIXELS_MOST];
    size_t count;
    struct error err = {0};
    struct ocean_usb *usb = plug(0x1022, 4, NULL);
    bus.left_86 = 512;
    bus.left_82 = 5633;
    assert_true(ocean_usb_spectrum(usb, true, bytes, sizeof bytes, 1000, &count, &err));
    assert_int_equal(count, 512);
    assert_false(ocean_unpack(ocean_usb_model(usb), bytes, count, raw, &err));
    bus.left_86 = 0;
    bus.calls = 0;
    assert_false(ocean_usb_spectrum(usb, true, bytes, sizeof bytes, 1000, &count, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_int_equal(bus.calls, 1);
    ocean_usb_close(usb);
}

static void draining_empties_every_endpoint_the_model_has(void **state)
{
    (void)state;
    struct ocean_usb *usb = plug(0x1012, 4, NULL);
    bus.left_86 = 2048;
    bus.left_82 = 100;
    assert_true(ocean_usb_drain(usb, clock_now_ns() + NS_PER_S, NULL));
    assert_int_equal(bus.left_86, 0);
    assert_int_equal(bus.left_82, 0);
    ocean_usb_close(usb);
}

static void the_descriptors_are_read_not_believed(void **state)
{
    (void)state;
    struct error err = {0};
    assert_null(plug(0x1022, 3, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_non_null(strstr(err.text, "USB4000"));
    struct ocean_usb *usb = plug(0x101e, 3, &err);
    assert_non_null(usb);
    ocean_usb_close(usb);
    assert_null(plug(0x101e, 2, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_null(plug(0x4000, 4, &err));
    assert_int_equal(err.code, ERROR_GONE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(at_high_speed_the_first_part_comes_on_86),
        cmocka_unit_test(at_full_speed_and_from_the_others_all_comes_on_82),
        cmocka_unit_test(a_first_part_cut_short_is_not_filled_from_elsewhere),
        cmocka_unit_test(draining_empties_every_endpoint_the_model_has),
        cmocka_unit_test(the_descriptors_are_read_not_believed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
