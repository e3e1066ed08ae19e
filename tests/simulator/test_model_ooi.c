// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "colorimetry/colour.h"
#include "colorimetry/illuminant.h"
#include "simulator/model_detector.h"
#include "simulator/model_ooi.h"

#include <cmocka.h> // last: its fail() is a macro

enum { OUT = 0x01, REPLY = 0x81, SPECTRUM = 0x82, PIXELS = 2048, WHOLE = 4097 };

#define MS NS_PER_MS
#define READOUT_MS 1 // 0.9 ms read-out and 8.5 us delay, rounded up
#define AREA_MM2 11.95

// Single readings carry shot and read noise: 160,000 electrons at full scale
// and 50 counts rms make 0.3 % at half scale; 200 pixels averaged 0.03 %.
#define MEAN_OF_PIXELS 0.004
// Readings of single active pixels lie within six sigma of the read noise (20
// raw) and what the hot pixels add in 10 ms (7 raw).
#define DARK_RAW 130

// Light that is one constant until switched, another after.
struct lamp {
    double before, after;
    int64_t switched_ns;
    int64_t from_ns, to_ns; // of the last exposure
    struct spectrum shape;
};

static void shine(void *context, int64_t from_ns, int64_t to_ns, struct spectrum *out)
{
    struct lamp *lamp = context;
    double early = (double)(lamp->switched_ns - from_ns) / (double)(to_ns - from_ns);
    early = fmin(fmax(early, 0), 1);
    lamp->from_ns = from_ns;
    lamp->to_ns = to_ns;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = lamp->shape.v[i] * (early * lamp->before + (1 - early) * lamp->after);
}

static struct lamp lamp;
static struct ooi *device;
static struct usb_model model;

static struct ooi_options flat_light(double level)
{
    lamp = (struct lamp){.before = level, .after = level};
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        lamp.shape.v[i] = 1;
    return (struct ooi_options){.around = {.context = &lamp, .irradiance = shine},
                                        .serial = "EMU2+H00417",
                                        .seed = 7,
                                        .collector_mm2 = AREA_MM2};
}

static void make(const struct ooi_options *options)
{
    ooi_destroy(device);
    device = ooi_create(options);
    assert_non_null(device);
    model = ooi_model(device);
}

static int fresh(void **state)
{
    (void)state;
    struct ooi_options options = flat_light(0.01);
    make(&options);
    return 0;
}

static int gone(void **state)
{
    (void)state;
    ooi_destroy(device);
    device = NULL;
    return 0;
}

static int send(int64_t now_ns, const char *bytes, size_t size)
{
    return model.out(model.context, OUT, now_ns, (const uint8_t *)bytes, size);
}

static int take(uint8_t endpoint, int64_t now_ns, uint8_t packet[USB_PACKET_MOST],
                int64_t *again_ns)
{
    return model.in(model.context, endpoint, now_ns, packet, again_ns);
}

static void expect_reply(int64_t now_ns, const char *bytes, int size)
{
    uint8_t packet[USB_PACKET_MOST];
    int64_t again_ns;
    assert_int_equal(take(REPLY, now_ns, packet, &again_ns), size);
    assert_memory_equal(packet, bytes, (size_t)size);
}

static void expect_nothing(uint8_t endpoint, int64_t now_ns)
{
    uint8_t packet[USB_PACKET_MOST];
    int64_t again_ns;
    assert_int_equal(take(endpoint, now_ns, packet, &again_ns), -EAGAIN);
}

static void read_raw(int64_t now_ns, uint16_t raw[PIXELS])
{
    uint8_t whole[WHOLE + USB_PACKET_MOST];
    int64_t again_ns;
    int total = 0, size;
    while ((size = take(SPECTRUM, now_ns, whole + total, &again_ns)) > 0) {
        total += size;
        if (total == WHOLE)
            break;
    }
    assert_int_equal(total, WHOLE);
    assert_int_equal(whole[WHOLE - 1], 0x69);
    for (int p = 0; p < PIXELS; p++)
        raw[p] = (uint16_t)(whole[2 * p] | whole[2 * p + 1] << 8);
}

static double mean(const uint16_t raw[PIXELS], int from, int to)
{
    double sum = 0;
    for (int p = from; p < to; p++)
        sum += raw[p];
    return sum / (to - from);
}

// Asks at now, reads when ready (in no time at all); returns when that was.
static int64_t ask_and_read(int64_t now_ns, uint16_t raw[PIXELS])
{
    uint8_t packet[USB_PACKET_MOST];
    int64_t again_ns;
    send(now_ns, "\x09", 1);
    assert_int_equal(take(SPECTRUM, now_ns, packet, &again_ns), -EAGAIN);
    assert_true(again_ns < INT64_MAX);
    assert_int_equal(take(SPECTRUM, again_ns - 1, packet, &(int64_t){0}), -EAGAIN);
    read_raw(again_ns, raw);
    return again_ns;
}

// ---- commands -------------------------------------------------------------------

static void integration_time_is_set_and_read_back(void **state)
{
    (void)state;
    send(0, "\x02\xA0\x86\x01\x00", 5); // 100 ms
    send(0, "\xFE", 1);
    expect_reply(0, "\x00\x08\xA0\x86\x01\x00\x00\x00\x00\x09\x01\x00\x00\x00\x80\x00", 16);
    send(0, "\x02\x18\xFC\xE7\x03", 5); // 65.535 s, the longest
    send(0, "\xFE", 1);
    expect_reply(0, "\x00\x08\x18\xFC\xE7\x03\x00\x00\x00\x09\x01\x00\x00\x00\x80\x00", 16);
}

static void integration_time_out_of_range_is_silently_ignored(void **state)
{
    (void)state;
    send(0, "\x02\xA0\x86\x01\x00", 5);
    assert_int_equal(send(0, "\x02\xE7\x03\x00\x00", 5), 0); // 999 us
    assert_int_equal(send(0, "\x02\x19\xFC\xE7\x03", 5), 0); // 65,535,001 us
    assert_int_equal(send(0, "\x02\x00", 2), 0);             // cut
    send(0, "\xFE", 1);
    expect_reply(0, "\x00\x08\xA0\x86\x01\x00\x00\x00\x00\x09\x01\x00\x00\x00\x80\x00", 16);
}

static void integration_time_has_a_resolution(void **state)
{
    (void)state;
    uint8_t packet[USB_PACKET_MOST];
    send(0, "\x02\xD7\x30\x00\x00", 5); // 12,503 us
    send(0, "\xFE", 1);
    take(REPLY, 0, packet, &(int64_t){0});
    assert_memory_equal(packet + 2, "\xD4\x30\x00\x00", 4); // 12,500
    send(0, "\x02\x08\x0C\x0A\x00", 5); // 658,440 us
    send(0, "\xFE", 1);
    take(REPLY, 0, packet, &(int64_t){0});
    assert_memory_equal(packet + 2, "\x50\x0A\x0A\x00", 4); // 658,000
}

static void an_invalid_trigger_mode_is_silently_ignored(void **state)
{
    (void)state;
    uint8_t packet[USB_PACKET_MOST];
    assert_int_equal(send(0, "\x0A\x02\x00", 3), 0);
    assert_int_equal(send(0, "\x0A\x09\x00", 3), 0);
    send(0, "\xFE", 1);
    take(REPLY, 0, packet, &(int64_t){0});
    assert_int_equal(packet[7], 2);
    send(0, "\x01", 1); // initialise: back to normal mode
    send(0, "\xFE", 1);
    take(REPLY, 0, packet, &(int64_t){0});
    assert_int_equal(packet[7], 0);
}

static void an_unknown_command_stalls_until_the_halt_is_cleared(void **state)
{
    (void)state;
    assert_int_equal(send(0, "\x55", 1), -EPIPE);
    assert_int_equal(send(0, "\xFE", 1), -EPIPE);
    model.clear_halt(model.context, OUT);
    assert_int_equal(send(0, "\xFE", 1), 0);
}

static void registers_say_programmed_and_saturation(void **state)
{
    (void)state;
    send(0, "\x6B\x64", 2);
    expect_reply(0, "\x64\x01\x55", 3);
    send(0, "\x6B\x68", 2);
    expect_reply(0, "\x68\x90\x65", 3); // 26000
    send(0, "\x6A\x5C\x34\x12", 4);
    send(0, "\x6B\x5C", 2);
    expect_reply(0, "\x5C\x34\x12", 3);
}

static void a_flame_echoes_fe_and_calls_itself_version_3(void **state)
{
    (void)state;
    struct ooi_options options = flat_light(0);
    options.flame = true;
    make(&options);
    uint8_t packet[USB_PACKET_MOST];
    send(0, "\x6B\x04", 2);
    assert_int_equal(take(REPLY, 0, packet, &(int64_t){0}), 3);
    assert_int_equal(packet[0], 0xFE);
    assert_int_equal(packet[2] >> 4, 3);
}

static void temperature_is_a_room_s(void **state)
{
    (void)state;
    uint8_t packet[USB_PACKET_MOST];
    send(0, "\x6C", 1);
    assert_int_equal(take(REPLY, 0, packet, &(int64_t){0}), 3);
    assert_int_equal(packet[0], 0x08);
    double degrees = (int16_t)(packet[1] | packet[2] << 8) * 0.003906;
    assert_true(degrees > 20 && degrees < 35);
}

// ---- slots ----------------------------------------------------------------------------

static double slot_number(int slot)
{
    uint8_t packet[USB_PACKET_MOST];
    char text[16] = {0};
    send(0, (const char[]){0x05, (char)slot}, 2);
    assert_int_equal(take(REPLY, 0, packet, &(int64_t){0}), 17);
    assert_int_equal(packet[0], 0x05);
    assert_int_equal(packet[1], slot);
    memcpy(text, packet + 2, 15);
    return strtod(text, NULL);
}

static void slot_0_is_the_serial_with_garbage_behind_its_end(void **state)
{
    (void)state;
    uint8_t packet[USB_PACKET_MOST];
    send(0, "\x05\x00", 2);
    take(REPLY, 0, packet, &(int64_t){0});
    assert_string_equal((char *)packet + 2, "EMU2+H00417");
    assert_true(packet[14] || packet[15] || packet[16]);
}

static void one_slot_fills_all_fifteen_bytes(void **state)
{
    (void)state;
    uint8_t packet[USB_PACKET_MOST];
    send(0, "\x05\x01", 2);
    take(REPLY, 0, packet, &(int64_t){0});
    assert_null(memchr(packet + 2, 0, 15));
}

static void wavelengths_span_340_to_1027_nm(void **state)
{
    (void)state;
    double c[4];
    for (int i = 0; i < 4; i++)
        c[i] = slot_number(1 + i);
    double last = c[0] + 2047 * (c[1] + 2047 * (c[2] + 2047 * c[3]));
    assert_true(fabs(c[0] - 339.9) < 1e-9);
    assert_true(fabs(last - 1027.0) < 0.01); // the slot's digits
}

static void slot_17_is_the_saturation_in_binary(void **state)
{
    (void)state;
    uint8_t packet[USB_PACKET_MOST];
    send(0, "\x05\x11", 2);
    take(REPLY, 0, packet, &(int64_t){0});
    assert_int_equal(packet[6] | packet[7] << 8, 26000);
}

static void slots_beyond_the_last_are_not_answered(void **state)
{
    (void)state;
    send(0, "\x05\x14", 2);
    expect_nothing(REPLY, 10 * NS_PER_S);
}

static void slots_never_programmed_read_ff(void **state)
{
    (void)state;
    struct ooi_options options = flat_light(0);
    options.blank_nonlinearity = true;
    make(&options);
    send(0, "\x05\x06", 2);
    expect_reply(0, "\x05\x06\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF", 17);
}

// ---- acquisition ----------------------------------------------------------------------

static void the_first_spectrum_integrates_after_its_request(void **state)
{
    (void)state;
    uint16_t raw[PIXELS];
    send(0, "\x02\x10\x27\x00\x00", 5); // 10 ms
    int64_t ready_ns = ask_and_read(5 * MS, raw);
    assert_true(lamp.from_ns > 5 * MS);
    assert_int_equal(lamp.to_ns - lamp.from_ns, 10 * MS);
    assert_true(ready_ns >= lamp.to_ns && ready_ns < lamp.to_ns + READOUT_MS * MS);
}

static void a_request_soon_after_is_served_with_light_from_before_it(void **state)
{
    (void)state;
    uint16_t raw[PIXELS];
    send(0, "\x02\x10\x27\x00\x00", 5);
    lamp.before = 0.01;
    lamp.after = 0;
    int64_t read_ns = ask_and_read(0, raw);
    lamp.switched_ns = read_ns + 9 * MS; // the lamp goes out 9 ms later
    ask_and_read(lamp.switched_ns, raw); // and only then the next is asked for
    assert_true(lamp.from_ns < lamp.switched_ns - 8 * MS);
    assert_true(mean(raw, 500, 700) > mean(raw, 0, 18) + 1000);
}

static void a_running_cycle_keeps_the_old_integration_time(void **state)
{
    (void)state;
    uint16_t raw[PIXELS];
    send(0, "\x02\x10\x27\x00\x00", 5);
    int64_t read_ns = ask_and_read(0, raw);
    send(read_ns + MS, "\x02\x20\x4E\x00\x00", 5); // 20 ms
    int64_t second_ns = ask_and_read(read_ns + 2 * MS, raw);
    assert_int_equal(lamp.to_ns - lamp.from_ns, 10 * MS);
    ask_and_read(second_ns + MS, raw);
    assert_int_equal(lamp.to_ns - lamp.from_ns, 20 * MS);
}

static void after_two_cycles_in_vain_it_rests(void **state)
{
    (void)state;
    uint16_t raw[PIXELS];
    send(0, "\x02\x10\x27\x00\x00", 5);
    int64_t read_ns = ask_and_read(0, raw);
    int64_t later_ns = read_ns + 2 * (10 + READOUT_MS) * MS;
    ask_and_read(later_ns, raw);
    assert_true(lamp.from_ns >= later_ns);
}

static void nothing_is_acquired_while_a_spectrum_waits(void **state)
{
    (void)state;
    uint8_t packet[USB_PACKET_MOST];
    uint16_t raw[PIXELS];
    send(0, "\x02\x10\x27\x00\x00", 5);
    send(0, "\x09", 1);
    expect_nothing(SPECTRUM, 0);
    send(500 * MS, "\xFE", 1);
    take(REPLY, 500 * MS, packet, &(int64_t){0});
    assert_int_equal(packet[8], 0x04); // data ready
    assert_int_equal(packet[11], 9);   // packets loaded
    read_raw(500 * MS, raw);
    assert_true(lamp.to_ns < 11 * MS);
    ask_and_read(501 * MS, raw); // served by the cycle begun at read-out
    assert_true(lamp.from_ns < 501 * MS && lamp.from_ns >= 500 * MS);
}

static void without_a_trigger_nothing_comes(void **state)
{
    (void)state;
    uint16_t raw[PIXELS];
    send(0, "\x0A\x03\x00", 3);
    send(0, "\x09", 1);
    expect_nothing(SPECTRUM, 100 * NS_PER_S);
    send(100 * NS_PER_S, "\x0A\x00\x00", 3);
    expect_nothing(SPECTRUM, 100 * NS_PER_S);
    read_raw(101 * NS_PER_S, raw);
}

static void at_full_speed_packets_have_64_bytes(void **state)
{
    (void)state;
    struct ooi_options options = flat_light(0.01);
    options.full_speed = true;
    make(&options);
    uint8_t packet[USB_PACKET_MOST];
    send(0, "\x09", 1);
    assert_int_equal(take(SPECTRUM, NS_PER_S, packet, &(int64_t){0}), 64);
    for (int i = 1; i < 64; i++)
        assert_int_equal(take(SPECTRUM, NS_PER_S, packet, &(int64_t){0}), 64);
    assert_int_equal(take(SPECTRUM, NS_PER_S, packet, &(int64_t){0}), 1);
    assert_int_equal(packet[0], 0x69);
    send(NS_PER_S, "\xFE", 1);
    take(REPLY, NS_PER_S, packet, &(int64_t){0});
    assert_int_equal(packet[14], 0x00);
    assert_int_equal(packet[9], 65);
}

static void two_devices_of_one_seed_say_the_same(void **state)
{
    (void)state;
    uint16_t one[PIXELS], two[PIXELS];
    ask_and_read(0, one);
    struct ooi_options options = flat_light(0.01);
    make(&options);
    ask_and_read(0, two);
    assert_memory_equal(one, two, sizeof(one));
}

// ---- light -----------------------------------------------------------------------------

static void black_pixels_see_nothing_and_light_clips_at_saturation(void **state)
{
    (void)state;
    uint16_t raw[PIXELS];
    struct ooi_options options = flat_light(10);
    make(&options);
    ask_and_read(0, raw);
    for (int p = 0; p < 18; p++)
        assert_in_range(raw[p], 600 - DARK_RAW, 606 + DARK_RAW);
    for (int p = 100; p < 1350; p++)
        assert_int_equal(raw[p], 26000);
}

static void in_the_dark_all_pixels_stay_near_the_baseline(void **state)
{
    (void)state;
    uint16_t raw[PIXELS];
    struct ooi_options options = flat_light(0);
    make(&options);
    send(0, "\x02\x10\x27\x00\x00", 5);
    ask_and_read(0, raw);
    for (int p = 0; p < PIXELS; p++)
        assert_in_range(raw[p], 600 - DARK_RAW, 606 + DARK_RAW);
}

static double polynomial(const double *c, int count, double x)
{
    double y = 0;
    for (int i = count - 1; i >= 0; i--)
        y = y * x + c[i];
    return y;
}

// As protocols describe the way back, from what the slots say.
static double irradiance_of(const uint16_t raw[PIXELS], int from, int to, double exposure_s)
{
    double wavelength[4], nonlinearity[8], sum = 0;
    for (int i = 0; i < 4; i++)
        wavelength[i] = slot_number(1 + i);
    for (int i = 0; i < 8; i++)
        nonlinearity[i] = slot_number(6 + i);
    double dark = mean(raw, 6, 18);
    for (int p = from; p < to; p++) {
        double counts = (raw[p] - dark) * 65535 / 26000;
        counts /= polynomial(nonlinearity, 8, counts);
        double nm = polynomial(wavelength, 4, p);
        double width = polynomial(wavelength, 4, p + 0.5) - polynomial(wavelength, 4, p - 0.5);
        sum += counts * detector_calibration(nm) / (AREA_MM2 * exposure_s * width);
    }
    return sum / (to - from);
}

static void counts_lead_back_to_the_irradiance(void **state)
{
    (void)state;
    const int pixel[] = {300, 500, 700, 900}; // 450..630 nm
    uint16_t raw[PIXELS];
    send(0, "\x02\xA0\x86\x01\x00", 5); // 100 ms
    for (int round = 0; round < 4; round++) {
        double level = 0.0025 * (round + 1);
        lamp.before = lamp.after = level;
        ask_and_read((round + 1) * NS_PER_S, raw);
        for (int i = 0; i < 4; i++) {
            double got = irradiance_of(raw, pixel[i] - 100, pixel[i] + 100, 0.1);
            assert_true(fabs(got / level - 1) < MEAN_OF_PIXELS);
        }
    }
}

static void a_booth_s_light_fills_the_scale_in_20_to_100_ms(void **state)
{
    (void)state;
    const char *const names[] = {"A", "FL8", "FL3.15"};
    for (int n = 0; n < 3; n++) {
        struct spectrum light;
        struct error err;
        assert_true(illuminant(names[n], &light, &err));
        spectrum_scale(&light, 1500 / xyz_absolute(&light, OBSERVER_1931_2).Y);
        double top = 0;
        uint16_t raw[PIXELS];
        struct ooi_options options = flat_light(1);
        lamp.shape = light;
        make(&options);
        send(0, "\x02\x20\x4E\x00\x00", 5); // 20 ms
        ask_and_read(0, raw);
        for (int p = 20; p < PIXELS; p++)
            top = fmax(top, raw[p]);
        double ms = 20 * 0.85 * 26000 / top; // to reach 85 %
        print_message("%s: %.0f ms\n", names[n], ms);
        assert_true(ms > 20 && ms < 100);
    }
}

#define WITH(test) cmocka_unit_test_setup_teardown(test, fresh, gone)

int main(void)
{
    const struct CMUnitTest tests[] = {
        WITH(integration_time_is_set_and_read_back),
        WITH(integration_time_out_of_range_is_silently_ignored),
        WITH(integration_time_has_a_resolution),
        WITH(an_invalid_trigger_mode_is_silently_ignored),
        WITH(an_unknown_command_stalls_until_the_halt_is_cleared),
        WITH(registers_say_programmed_and_saturation),
        WITH(a_flame_echoes_fe_and_calls_itself_version_3),
        WITH(temperature_is_a_room_s),
        WITH(slot_0_is_the_serial_with_garbage_behind_its_end),
        WITH(one_slot_fills_all_fifteen_bytes),
        WITH(wavelengths_span_340_to_1027_nm),
        WITH(slot_17_is_the_saturation_in_binary),
        WITH(slots_beyond_the_last_are_not_answered),
        WITH(slots_never_programmed_read_ff),
        WITH(the_first_spectrum_integrates_after_its_request),
        WITH(a_request_soon_after_is_served_with_light_from_before_it),
        WITH(a_running_cycle_keeps_the_old_integration_time),
        WITH(after_two_cycles_in_vain_it_rests),
        WITH(nothing_is_acquired_while_a_spectrum_waits),
        WITH(without_a_trigger_nothing_comes),
        WITH(at_full_speed_packets_have_64_bytes),
        WITH(two_devices_of_one_seed_say_the_same),
        WITH(black_pixels_see_nothing_and_light_clips_at_saturation),
        WITH(in_the_dark_all_pixels_stay_near_the_baseline),
        WITH(counts_lead_back_to_the_irradiance),
        WITH(a_booth_s_light_fills_the_scale_in_20_to_100_ms),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
