// SPDX-License-Identifier: Apache-2.0
// The other spectrometers of the family, two of them at once, and the other
// faces of the inclinometer, through unmodified libusb and libmodbus. Runs
// itself again under umockdev-wrapper.
#include <errno.h>
#include <modbus.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

#include <cmocka.h> // last: its fail() is a macro

#include "tests/simulator/instruments_here.h"

enum { USB4000 = 0x1022, HR4000 = 0x1012, FIRST_PART = 0x86, WHOLE_MOST = 7681 };

#define PRECISE_DEG 0.04 // noise 0.005 degrees, eight sigma

static libusb_device_handle *open_product(libusb_context *usb, int product)
{
    libusb_device_handle *handle =
        libusb_open_device_with_vid_pid(usb, OCEAN_VENDOR, (uint16_t)product);
    if (handle)
        assert_int_equal(libusb_claim_interface(handle, 0), 0);
    return handle;
}

static void start_a_pair(enum ooi_name first, enum ooi_name second)
{
    struct wire_options options = usual();
    options.model = first;
    options.model_2 = second;
    options.serial[WIRE_SPECTROMETER_2] = "EMU2+H00418";
    start_with(&options);
}

static void start_a_kind(enum ooi_name kind)
{
    struct wire_options options = usual();
    options.model = kind;
    start_with(&options);
}

static int part(libusb_device_handle *handle, uint8_t endpoint, unsigned char *bytes, int size)
{
    int got = 0;
    assert_int_equal(libusb_bulk_transfer(handle, endpoint, bytes, size, &got, REPLY_MS), 0);
    return got;
}

static void every_sibling_sends_spectra_of_its_size(void **state)
{
    const struct {
        enum ooi_name name;
        int product, size, apart;
    } rows[] = {{OOI_USB2000PLUS, 0x101E, 4097, 0}, {OOI_USB4000, 0x1022, 7681, 2048},
                {OOI_HR2000PLUS, 0x1016, 4097, 0},  {OOI_HR4000, 0x1012, 7681, 2048},
                {OOI_MAYA2000PRO, 0x102A, 4609, 0}, {OOI_QE65000, 0x1018, 2561, 0}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        unsigned char bytes[8192];
        libusb_context *usb;
        start_a_kind(rows[i].name);
        assert_int_equal(libusb_init(&usb), 0);
        libusb_device_handle *handle = open_product(usb, rows[i].product);
        assert_non_null(handle);
        assert_int_equal(command(handle, "\x09", 1), 0);
        if (rows[i].apart)
            assert_int_equal(part(handle, FIRST_PART, bytes, rows[i].apart), rows[i].apart);
        int rest = rows[i].size - rows[i].apart;
        assert_int_equal(part(handle, SPECTRA, bytes, 6144), rest);
        assert_int_equal(bytes[rest - 1], 0x69);
        libusb_close(handle);
        libusb_exit(usb);
        stop(state);
    }
}

static void serial_of(libusb_device_handle *handle, char out[18])
{
    assert_int_equal(command(handle, "\x05\x00", 2), 0);
    memset(out, 0, 18);
    assert_int_equal(part(handle, REPLIES, (unsigned char *)out, 17), 17);
    memmove(out, out + 2, 16);
}

static libusb_device_handle *open_serial(libusb_context *usb, const char *serial)
{
    libusb_device **list;
    libusb_device_handle *found = NULL;
    ssize_t count = libusb_get_device_list(usb, &list);
    for (ssize_t i = 0; i < count && !found; i++) {
        char text[18];
        assert_int_equal(libusb_open(list[i], &found), 0);
        assert_int_equal(libusb_claim_interface(found, 0), 0);
        serial_of(found, text);
        if (strcmp(text, serial) != 0) {
            libusb_close(found);
            found = NULL;
        }
    }
    libusb_free_device_list(list, 1);
    return found;
}

static void expect_spectrum(libusb_device_handle *handle)
{
    unsigned char bytes[4608];
    int size;
    assert_int_equal(spectrum(handle, bytes, &size, REPLY_MS), 0);
    assert_int_equal(size, SPECTRUM_SIZE);
    assert_int_equal(bytes[size - 1], 0x69);
}

static void two_of_a_kind_are_told_apart_by_serial(void **state)
{
    libusb_context *usb;
    start_a_pair(OOI_USB2000PLUS, OOI_USB2000PLUS);
    assert_int_equal(libusb_init(&usb), 0);
    libusb_device_handle *first = open_serial(usb, "EMU2+H00417");
    libusb_device_handle *second = open_serial(usb, "EMU2+H00418");
    assert_non_null(first);
    assert_non_null(second);
    expect_spectrum(first);
    expect_spectrum(second);
    set_fault(WIRE_SPECTROMETER_2, WIRE_UNPLUGGED);
    expect_spectrum(first);
    assert_int_equal(command(second, "\xFE", 1), LIBUSB_ERROR_NO_DEVICE);
    libusb_close(second);
    set_fault(WIRE_SPECTROMETER_2, WIRE_FINE);
    second = open_serial(usb, "EMU2+H00418");
    assert_non_null(second);
    expect_spectrum(second);
    libusb_close(first);
    libusb_close(second);
    libusb_exit(usb);
    assert_int_equal(access(in_folder("spectrometer2.cal"), R_OK), 0);
    stop(state);
}

static void two_kinds_stand_side_by_side(void **state)
{
    libusb_context *usb;
    unsigned char bytes[512];
    int size;
    start_a_pair(OOI_HR4000, OOI_USB4000);
    assert_int_equal(libusb_init(&usb), 0);
    const int products[] = {HR4000, USB4000};
    for (int i = 0; i < 2; i++) {
        libusb_device_handle *handle = open_product(usb, products[i]);
        assert_non_null(handle);
        assert_int_equal(command(handle, "\xFE", 1), 0);
        assert_int_equal(libusb_bulk_transfer(handle, REPLIES, bytes, 64, &size, REPLY_MS), 0);
        assert_int_equal(bytes[0] | bytes[1] << 8, 3840);
        libusb_close(handle);
    }
    libusb_exit(usb);
    stop(state);
}

// ---- inclinometer ---------------------------------------------------------------------

static modbus_t *open_tcp(void)
{
    int port = 0;
    FILE *file = fopen(in_folder("inclinometer.port"), "r");
    assert_non_null(file);
    assert_int_equal(fscanf(file, "%d", &port), 1);
    fclose(file);
    modbus_t *client = modbus_new_tcp("127.0.0.1", port);
    modbus_set_slave(client, 0x50);
    modbus_set_response_timeout(client, REPLY_MS / 1000, 0);
    return client;
}

static void close_client(modbus_t *client)
{
    modbus_close(client);
    modbus_free(client);
}

static void impatient(modbus_t *client)
{
    modbus_set_response_timeout(client, 0, SILENCE_MS * 1000);
}

static double precise_roll(modbus_t *client)
{
    uint16_t w[6];
    assert_int_equal(modbus_read_registers(client, 0x3D, 6, w), 6);
    return (int32_t)((uint32_t)w[1] << 16 | w[0]) / 1000.0;
}

static void the_precise_map_over_rtu_has_angles_of_32_bits(void **state)
{
    struct wire_options options = usual();
    options.inclinometer_map = WITMOTION_PRECISE;
    start_with(&options);
    modbus_t *client = modbus_new_rtu(in_folder("inclinometer"), 9600, 'N', 8, 1);
    modbus_set_slave(client, 0x50);
    modbus_set_response_timeout(client, REPLY_MS / 1000, 0);
    assert_int_equal(modbus_connect(client), 0);
    assert_true(fabs(precise_roll(client) - 30) < PRECISE_DEG);
    close_client(client);
    stop(state);
}

static void start_tcp(void)
{
    struct wire_options options = usual();
    options.inclinometer_tcp = true;
    options.inclinometer_map = WITMOTION_PRECISE;
    start_with(&options);
}

static void it_answers_over_tcp_to_its_unit_only(void **state)
{
    uint16_t word;
    start_tcp();
    modbus_t *client = open_tcp();
    assert_int_equal(modbus_connect(client), 0);
    assert_true(fabs(precise_roll(client) - 30) < PRECISE_DEG);
    assert_int_equal(modbus_read_registers(client, 0x85, 1, &word), -1);
    assert_int_equal(errno, EMBXILADD);
    impatient(client);
    modbus_set_slave(client, 0x51);
    assert_int_equal(modbus_read_registers(client, 0x34, 1, &word), -1);
    assert_int_equal(errno, ETIMEDOUT);
    close_client(client);
    stop(state);
}

static void a_half_open_connection_stays_dead_and_a_new_one_lives(void **state)
{
    uint16_t word;
    start_tcp();
    modbus_t *old = open_tcp();
    assert_int_equal(modbus_connect(old), 0);
    precise_roll(old);
    set_fault(WIRE_INCLINOMETER, WIRE_HALF_OPEN);
    impatient(old);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(modbus_read_registers(old, 0x34, 1, &word), -1);
        assert_int_equal(errno, ETIMEDOUT);
        set_fault(WIRE_INCLINOMETER, WIRE_FINE);
    }
    modbus_t *fresh = open_tcp();
    assert_int_equal(modbus_connect(fresh), 0);
    precise_roll(fresh);
    close_client(old);
    close_client(fresh);
    stop(state);
}

static void a_lost_peer_refuses_until_it_is_back_at_the_same_port(void **state)
{
    uint16_t word;
    start_tcp();
    for (int i = 0; i < 5; i++) {
        modbus_t *client = open_tcp();
        assert_int_equal(modbus_connect(client), 0);
        precise_roll(client);
        set_fault(WIRE_INCLINOMETER, WIRE_UNPLUGGED);
        assert_int_equal(modbus_read_registers(client, 0x34, 1, &word), -1);
        modbus_close(client);
        assert_int_equal(modbus_connect(client), -1);
        set_fault(WIRE_INCLINOMETER, WIRE_FINE);
        assert_int_equal(modbus_connect(client), 0);
        precise_roll(client);
        close_client(client);
    }
    stop(state);
}

// libmodbus itself does not compare the unit of an answer over TCP.
static void bad_answers_over_tcp_show(void **state)
{
    uint16_t word;
    start_tcp();
    const struct {
        enum wire_fault fault;
        int number;
    } rows[] = {{WIRE_SILENT, ETIMEDOUT}, {WIRE_BAD_CRC, EMBBADDATA}, {WIRE_STALL, EMBXSBUSY}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        modbus_t *client = open_tcp();
        assert_int_equal(modbus_connect(client), 0);
        impatient(client);
        set_fault(WIRE_INCLINOMETER, rows[i].fault);
        assert_int_equal(modbus_read_registers(client, 0x34, 1, &word), -1);
        assert_int_equal(errno, rows[i].number);
        set_fault(WIRE_INCLINOMETER, WIRE_FINE);
        close_client(client);
    }
    stop(state);
}

int main(int argc, char **argv)
{
    (void)argc;
    if (under_umockdev(argv[0]))
        return 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_sibling_sends_spectra_of_its_size),
        cmocka_unit_test(two_of_a_kind_are_told_apart_by_serial),
        cmocka_unit_test(two_kinds_stand_side_by_side),
        cmocka_unit_test(the_precise_map_over_rtu_has_angles_of_32_bits),
        cmocka_unit_test(it_answers_over_tcp_to_its_unit_only),
        cmocka_unit_test(a_half_open_connection_stays_dead_and_a_new_one_lives),
        cmocka_unit_test(a_lost_peer_refuses_until_it_is_back_at_the_same_port),
        cmocka_unit_test(bad_answers_over_tcp_show),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
