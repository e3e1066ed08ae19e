// SPDX-License-Identifier: Apache-2.0
// What tells the siblings apart, driven by hand below the bus.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "simulator/model_ooi.h"

#include <cmocka.h> // last: its fail() is a macro

enum { OUT = 0x01, REPLY = 0x81, REST = 0x82, APART = 0x86, MOST = 3840 };

#define AREA_MM2 11.95
// 200 pixels averaged: shot and read noise 0.03 %, stray light and dark current
// the rest.
#define MEAN_OF_PIXELS 0.006

static double level;
static int64_t light_from_ns, light_to_ns;

static void shine(void *context, int64_t from_ns, int64_t to_ns, struct spectrum *out)
{
    (void)context;
    light_from_ns = from_ns;
    light_to_ns = to_ns;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = level;
}

static struct ooi *device;
static struct usb_model model;

static void make(enum ooi_name kind, bool full_speed)
{
    struct ooi_options options = {.around = {.irradiance = shine},
                                  .kind = kind,
                                  .serial = "EMU2+H00417",
                                  .seed = 7,
                                  .collector_mm2 = AREA_MM2,
                                  .full_speed = full_speed};
    ooi_destroy(device);
    device = ooi_create(&options);
    assert_non_null(device);
    model = ooi_model(device);
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

static int take(uint8_t endpoint, int64_t now_ns, uint8_t *bytes, int64_t *again_ns)
{
    return model.in(model.context, endpoint, now_ns, bytes, again_ns);
}

static int take_all(uint8_t endpoint, int64_t now_ns, uint8_t *bytes)
{
    int total = 0, size;
    int64_t again_ns;
    while ((size = take(endpoint, now_ns, bytes + total, &again_ns)) > 0) {
        total += size;
        if (size != 512 && size != 64)
            break;
    }
    return total;
}

static void set_us(enum ooi_name kind, uint32_t us)
{
    uint32_t units = us / ooi_kind(kind)->unit_us;
    char bytes[5] = {0x02};
    memcpy(bytes + 1, &units, 4);
    send(0, bytes, 5);
}

static uint32_t told_us(enum ooi_name kind)
{
    uint8_t status[USB_PACKET_MOST];
    uint32_t units;
    send(0, "\xFE", 1);
    assert_int_equal(take(REPLY, 0, status, &(int64_t){0}), 16);
    memcpy(&units, status + 2, 4);
    return units * ooi_kind(kind)->unit_us;
}

static void slot(int number, char out[16])
{
    uint8_t packet[USB_PACKET_MOST];
    send(0, (const char[]){0x05, (char)number}, 2);
    assert_int_equal(take(REPLY, 0, packet, &(int64_t){0}), 17);
    memcpy(out, packet + 2, 15);
    out[15] = '\0';
}

static double slot_number(int number)
{
    char text[16];
    slot(number, text);
    return strtod(text, NULL);
}

// Asks at now and reads when ready; returns when that was.
static int64_t read_raw(enum ooi_name kind, int64_t now_ns, uint16_t raw[MOST])
{
    const struct ooi_kind *k = ooi_kind(kind);
    uint8_t bytes[2 * MOST + 1 + USB_PACKET_MOST];
    int64_t again_ns;
    send(now_ns, "\x09", 1);
    assert_int_equal(take(REST, now_ns, bytes, &again_ns), -EAGAIN);
    int apart = take_all(APART, again_ns, bytes);
    assert_int_equal(apart, k->apart);
    int size = apart + take_all(REST, again_ns, bytes + apart);
    assert_int_equal(size, 2 * k->pixels + 1);
    assert_int_equal(bytes[size - 1], 0x69);
    for (int p = 0; p < k->pixels; p++)
        raw[p] = (uint16_t)(bytes[2 * p] | bytes[2 * p + 1] << 8) ^ k->inverted;
    return again_ns;
}

static void limits_are_each_model_s_own(void **state)
{
    (void)state;
    for (int kind = 0; kind < OOI_COUNT; kind++) {
        const struct ooi_kind *k = ooi_kind((enum ooi_name)kind);
        make((enum ooi_name)kind, false);
        set_us((enum ooi_name)kind, k->least_us);
        assert_int_equal(told_us((enum ooi_name)kind), k->least_us);
        set_us((enum ooi_name)kind, k->most_us);
        assert_int_equal(told_us((enum ooi_name)kind), k->most_us);
        set_us((enum ooi_name)kind, k->least_us - k->unit_us);
        set_us((enum ooi_name)kind, k->most_us + 1000);
        assert_int_equal(told_us((enum ooi_name)kind), k->most_us);
    }
}

static void saturation_stands_where_each_model_keeps_it(void **state)
{
    (void)state;
    const struct {
        enum ooi_name kind;
        int at, value;
    } rows[] = {{OOI_USB2000PLUS, 4, 26000}, {OOI_USB4000, 4, 53000},  {OOI_HR2000PLUS, 4, 16383},
                {OOI_HR4000, 4, 16383},      {OOI_MAYA2000PRO, 0, 64000}, {OOI_QE65000, 4, 65535}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        char bytes[16];
        uint16_t raw[MOST];
        int most = 0;
        make(rows[i].kind, false);
        slot(17, bytes);
        assert_int_equal((uint8_t)bytes[rows[i].at] | (uint8_t)bytes[rows[i].at + 1] << 8,
                         rows[i].value);
        level = 100;
        read_raw(rows[i].kind, 0, raw);
        for (int p = 0; p < ooi_kind(rows[i].kind)->pixels; p++)
            most = raw[p] > most ? raw[p] : most;
        assert_int_equal(most, rows[i].value);
    }
}

static double mean(const uint16_t *raw, int from, int to)
{
    double sum = 0;
    for (int p = from; p < to; p++)
        sum += raw[p];
    return sum / (to - from);
}

static double polynomial(int first_slot, int count, double x)
{
    double y = 0;
    for (int i = count - 1; i >= 0; i--)
        y = y * x + slot_number(first_slot + i);
    return y;
}

// The way back, from the slots and each model's documented dark pixels.
static void counts_lead_back_to_the_irradiance_on_every_model(void **state)
{
    (void)state;
    const struct {
        enum ooi_name kind;
        int dark_from, dark_to, from;
    } rows[] = {{OOI_USB2000PLUS, 6, 18, 500}, {OOI_USB4000, 5, 16, 900},
                {OOI_HR2000PLUS, 6, 18, 500},  {OOI_HR4000, 2, 13, 900},
                {OOI_MAYA2000PRO, 2064, 2068, 500}, {OOI_QE65000, 0, 4, 250}};
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        const struct ooi_kind *k = ooi_kind(rows[i].kind);
        uint16_t raw[MOST];
        make(rows[i].kind, false);
        set_us(rows[i].kind, 100000);
        level = 0.004;
        double nonlinearity[8], dark = 0, sum = 0;
        for (int c = 0; c < 8; c++)
            nonlinearity[c] = slot_number(6 + c);
        for (int round = 0; round < 8; round++) {
            read_raw(rows[i].kind, (round + 1) * 2 * NS_PER_S, raw);
            dark = mean(raw, rows[i].dark_from, rows[i].dark_to);
            for (int p = rows[i].from; p < rows[i].from + 200; p++) {
                double counts = (raw[p] - dark) * k->full / k->saturation, bend = 0;
                for (int c = 7; c >= 0; c--)
                    bend = bend * counts + nonlinearity[c];
                double nm = polynomial(1, 4, p);
                double width = polynomial(1, 4, p + 0.5) - polynomial(1, 4, p - 0.5);
                sum += counts / bend * ooi_calibration(device, nm) / (AREA_MM2 * 0.1 * width);
            }
        }
        double got = sum / (8 * 200);
        if (fabs(got / level - 1) > 2 * MEAN_OF_PIXELS)
            fail_msg("%s: %g instead of %g", k->product_text, got, level);
    }
}

static void covered_pixels_stay_dark_and_filler_is_nothing(void **state)
{
    (void)state;
    uint16_t raw[MOST];
    level = 0.01;
    make(OOI_MAYA2000PRO, false);
    read_raw(OOI_MAYA2000PRO, 0, raw);
    assert_true(mean(raw, 0, 4) < 1000);
    assert_true(mean(raw, 2064, 2068) < 1000);
    assert_true(mean(raw, 500, 700) > 2000);
    for (int p = 2068; p < 2304; p++)
        assert_int_equal(raw[p], 0);
    make(OOI_USB4000, false);
    read_raw(OOI_USB4000, 0, raw);
    assert_true(mean(raw, 5, 18) < 1000);
    assert_true(mean(raw, 900, 1100) > 2000);
}

static void at_full_speed_all_comes_on_one_endpoint(void **state)
{
    (void)state;
    uint8_t bytes[2 * MOST + 1 + USB_PACKET_MOST];
    int64_t again_ns;
    make(OOI_USB4000, true);
    send(0, "\x09", 1);
    assert_int_equal(take(REST, 0, bytes, &again_ns), -EAGAIN);
    assert_int_equal(take(APART, again_ns, bytes, &(int64_t){0}), -EAGAIN);
    assert_int_equal(take_all(REST, again_ns, bytes), 7681);
}

static void a_usb4000_runs_idle_cycles_and_a_request_takes_the_running_one(void **state)
{
    (void)state;
    uint16_t raw[MOST];
    make(OOI_USB4000, false);
    int64_t ready_ns = read_raw(OOI_USB4000, 10 * NS_PER_S + 50 * NS_PER_MS, raw);
    assert_true(light_from_ns < 10 * NS_PER_S + 50 * NS_PER_MS);
    assert_true(light_from_ns > 9 * NS_PER_S + 900 * NS_PER_MS);
    assert_true(ready_ns - light_to_ns < 2 * NS_PER_MS);
    assert_int_equal(light_to_ns - light_from_ns, 100 * NS_PER_MS);
}

static void below_3800_us_a_usb4000_has_a_shutter_and_a_least_period(void **state)
{
    (void)state;
    uint16_t raw[MOST];
    make(OOI_USB4000, false);
    set_us(OOI_USB4000, 100);
    read_raw(OOI_USB4000, NS_PER_S, raw); // begun with the time before, or after
    int64_t first_ns = read_raw(OOI_USB4000, 2 * NS_PER_S, raw);
    assert_int_equal(light_to_ns - light_from_ns, 100 * 1000);
    int64_t second_ns = read_raw(OOI_USB4000, first_ns, raw);
    assert_int_equal(second_ns - first_ns, 3 * 3800 * 1000);
}

static void a_qe65000_tells_its_cooler_s_temperature_others_stall(void **state)
{
    (void)state;
    uint8_t packet[USB_PACKET_MOST];
    make(OOI_QE65000, false);
    send(0, "\x73\x6A\xFF", 3); // -15.0 degrees
    send(0, "\x71\x01\x00", 3);
    send(0, "\x72", 1);
    assert_int_equal(take(REPLY, 0, packet, &(int64_t){0}), 2);
    assert_memory_equal(packet, "\x6A\xFF", 2);
    make(OOI_HR4000, false);
    assert_int_equal(send(0, "\x72", 1), -EPIPE);
}

#define KIND_TEST(test) cmocka_unit_test_teardown(test, gone)

int main(void)
{
    const struct CMUnitTest tests[] = {
        KIND_TEST(limits_are_each_model_s_own),
        KIND_TEST(saturation_stands_where_each_model_keeps_it),
        KIND_TEST(counts_lead_back_to_the_irradiance_on_every_model),
        KIND_TEST(covered_pixels_stay_dark_and_filler_is_nothing),
        KIND_TEST(at_full_speed_all_comes_on_one_endpoint),
        KIND_TEST(a_usb4000_runs_idle_cycles_and_a_request_takes_the_running_one),
        KIND_TEST(below_3800_us_a_usb4000_has_a_shutter_and_a_least_period),
        KIND_TEST(a_qe65000_tells_its_cooler_s_temperature_others_stall),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
