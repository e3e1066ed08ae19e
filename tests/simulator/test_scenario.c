// SPDX-License-Identifier: Apache-2.0
#include "simulator/scenario_script.h"

#include <unistd.h>

#include "simulator/wire.h"
#include "simulator/world.h"
#include "tests/simulator/cmocka_here.h"

static char folder[] = "/tmp/test_scenario.XXXXXX";

static int a_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) ? 0 : -1;
}

static int no_folder(void **state)
{
    (void)state;
    return rmdir(folder);
}

static const char *file_with(const char *text)
{
    static char path[64];
    snprintf(path, sizeof path, "%s/it", folder);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    return path;
}

static void scenario_refused(const char *text, const char *because)
{
    struct scenario s;
    struct error err = {0};
    const char *path = file_with(text);
    assert_false(scenario_load(path, &s, &err));
    if (!strstr(err.text, because) || !strstr(err.text, path))
        fail_msg("\"%s\" does not say \"%s\"", err.text, because);
    assert_int_equal(err.code, ERROR_CONFIG);
    unlink(path);
}

static void the_instruments_of_a_booth_are_chosen_by_name(void **state)
{
    (void)state;
    struct scenario s;
    struct error err = {0};
    const char *path = file_with("[lamp1]\nname = A\n"
                                 "[spectrometer]\nmodel = hr4000\n"
                                 "[spectrometer2]\nserial = EMU4K0002\nmodel = usb4000\n"
                                 "[inclinometer]\nmodel = hwt9073\ntcp = yes\nport = 1502\n"
                                 "[head]\nmarkers = cap\nfourth = yes\n");
    if (!scenario_load(path, &s, &err))
        fail_msg("%s", err.text);
    assert_int_equal(s.spectrometer.model, OOI_HR4000);
    assert_int_equal(s.spectrometer_2.model, OOI_USB4000);
    assert_string_equal(s.spectrometer_2.serial, "EMU4K0002");
    assert_int_equal(s.inclinometer.model, WITMOTION_PRECISE);
    assert_true(s.inclinometer.tcp);
    assert_int_equal(s.inclinometer.port, 1502);
    assert_int_equal(s.head.markers, HEAD_CAP);
    assert_true(s.head.fourth);
    unlink(path);
    scenario_preset(&s);
    assert_int_equal(s.spectrometer.model, OOI_USB2000PLUS);
    assert_string_equal(s.spectrometer_2.serial, "");
    scenario_refused("[lamp1]\nname = A\n[spectrometer]\nmodel = usb9\n", "usb4000");
    scenario_refused("[lamp1]\nname = A\n[spectrometer2]\nserial = 007\n", "EMU");
    scenario_refused("[lamp1]\nname = A\n[spectrometer2]\nserial = EMU2P0001\n",
                     "the first one's");
}

static void the_shipped_booth_loads_with_its_three_lamps(void **state)
{
    (void)state;
    struct scenario s;
    struct error err = {0};
    if (!scenario_load(SHIPPED, &s, &err))
        fail_msg("%s", err.text);
    assert_int_equal(scenario_lamp_index(&s, "A"), 0);
    assert_int_equal(scenario_lamp_index(&s, "D50"), 1);
    assert_int_equal(scenario_lamp_index(&s, "D65"), 2);
    assert_int_equal(scenario_lamp_index(&s, "D75"), -1);
    assert_int_equal(scenario_lamp_index(&s, ""), -1);
    assert_string_equal(s.lamps[0].spectrum, "A");
    assert_int_equal(s.lamps[0].form, LAMP_SPOTS);
    assert_string_equal(s.lamps[2].spectrum, "FL3.15");
    assert_int_equal(s.screen.width_px, 1280);
    assert_true(s.panel.white_cdm2 == 1500);
}

static void a_bad_scenario_is_refused_by_file_and_key(void **state)
{
    (void)state;
    scenario_refused("[world]\nseed = 1\n", "no lamp");
    scenario_refused("[lamp1]\nname = A\n[world]\nlamp = B\n", "\"B\" is no lamp");
    scenario_refused("[lamp1]\nname = A\n[lamp2]\nname = A\n", "already [lamp1]");
    scenario_refused("[lamp1]\nname = none\n", "darkness");
    scenario_refused("[lamp1]\nname = ../x\n", "more than letters");
    scenario_refused("[lamp1]\nname = A\nlux = nan\n", "lux");
    scenario_refused("[lamp1]\nname = A\nlux = 0\n", "outside");
    scenario_refused("[lamp1]\nname = A\nform = candle\n", "tubes, spots");
    scenario_refused("[lamp1]\nname = A\ncolour = red\n", "colour");
    scenario_refused("[lamp1]\nname = A\n[panel]\nbits = 9\n", "neither 8 nor 10");
    scenario_refused("[lamp1]\nname = A\n[panel]\nwhite_cdm2 = 1\nblack_cdm2 = 2\n", "not below");
    scenario_refused("[lamp1]\nname = A\n[radiometer]\nserial = 12345\n", "EMU");
    scenario_refused("[lamp1]\nname = A\n[stand]\nhinge_m = 0 0\n", "hinge_m");
    scenario_refused("[ceilings]\n", "ceilings");
}

static void a_missing_scenario_is_named(void **state)
{
    (void)state;
    struct scenario s;
    struct error err = {0};
    assert_false(scenario_load("/nowhere/booth.ini", &s, &err));
    assert_non_null(strstr(err.text, "/nowhere/booth.ini"));
}

static void a_lamp_option_replaces_or_adds_a_lamp(void **state)
{
    (void)state;
    struct scenario s;
    struct error err = {0};
    small_booth(&s);
    assert_true(scenario_set_lamp(&s, "D50=lamps/tube.csv", &err));
    assert_string_equal(s.lamps[1].spectrum, "lamps/tube.csv");
    assert_true(scenario_set_lamp(&s, "TL84=FL11", &err));
    assert_int_equal(scenario_lamp_index(&s, "TL84"), 3);
    assert_false(scenario_set_lamp(&s, "TL84", &err));
    assert_false(scenario_set_lamp(&s, "=FL11", &err));
    assert_false(scenario_set_lamp(&s, "TL84=", &err));
    assert_false(scenario_set_lamp(&s, "no/name=FL11", &err));
    assert_int_equal(err.code, ERROR_CONFIG);
}

static void a_spectrum_file_lies_beside_the_scenario(void **state)
{
    (void)state;
    struct scenario s;
    struct error err = {0};
    const char *path = file_with("[lamp1]\nname = A\nspectrum = tube.csv\n");
    char expected[128];
    assert_true(scenario_load(path, &s, &err));
    snprintf(expected, sizeof expected, "%s/tube.csv", folder);
    assert_string_equal(s.lamps[0].spectrum, expected);
    unlink(path);
}

static void lamp_refused(const char *text, const char *because)
{
    struct error err = {0};
    struct spectrum s;
    char path[80];
    file_with(text);
    snprintf(path, sizeof path, "%s/it", folder);
    assert_false(lamp_spectrum_load(path, &s, &err));
    if (!strstr(err.text, because) || !strstr(err.text, path))
        fail_msg("\"%s\" does not say \"%s\"", err.text, because);
    unlink(path);
}

static void a_bad_lamp_file_is_refused(void **state)
{
    (void)state;
    lamp_refused("nm,power\n400,1\n500,-1\n600,1\n700,1\n", "negative");
    lamp_refused("400,1\n390,1\n700,1\n", "390");
    lamp_refused("400,1\n500,x\n700,1\n", "x");
    lamp_refused("400\n500\n700\n", "two columns");
    lamp_refused("0.4,1\n0.5,1\n0.7,1\n", "");
}

static void a_lamp_that_is_neither_name_nor_file_is_refused(void **state)
{
    (void)state;
    struct error err = {0};
    struct spectrum s;
    assert_false(lamp_spectrum_load("FL99", &s, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_false(lamp_spectrum_load("/nowhere/lamp.csv", &s, &err));
    assert_non_null(strstr(err.text, "/nowhere/lamp.csv"));
}

static void a_script_is_read_in_order_of_time(void **state)
{
    (void)state;
    struct scenario s;
    struct error err = {0};
    struct event *events;
    int count;
    small_booth(&s);
    const char *path = file_with("# a day\n\n"
                                 "20 tilt 45 over 2   # slowly\n"
                                 "3.5 lamp A 0.5\n"
                                 "3.5 add D65 0.25\n"
                                 "4 lamp none\n"
                                 "5 head 0.1 0.5 0.7 over 1\n"
                                 "6 aim screen 10 20 from 0 1 1\n"
                                 "7 aim ceiling 0.1 0.05\n"
                                 "8 fault spectrometer unplugged");
    if (!script_load(path, &s, &events, &count, &err))
        fail_msg("%s", err.text);
    assert_int_equal(count, 8);
    assert_int_equal(events[0].kind, EVENT_LAMP);
    assert_int_equal(events[0].lamp, 0);
    assert_true(events[0].level == 0.5);
    assert_int_equal(events[1].kind, EVENT_ADD);
    assert_int_equal(events[2].lamp, -1);
    assert_true(events[3].over_s == 1 && events[3].eye_m.z == 0.7);
    assert_true(events[4].aim.from_given && events[4].aim.from_m.y == 1);
    assert_int_equal(events[5].aim.target, AIM_CEILING);
    assert_int_equal(events[6].instrument, WIRE_SPECTROMETER);
    assert_int_equal(events[6].fault, WIRE_UNPLUGGED);
    assert_true(events[7].at_s == 20 && events[7].tilt_deg == 45);
    free(events);
    unlink(path);
}

static void a_bad_script_is_refused_by_line(void **state)
{
    (void)state;
    static const char *const bad[][2] = {
        {"soon lamp A", "soon"},         {"-1 lamp A", "time"},
        {"1 lamp B", "not one of"},      {"1 lamp A 1.3", "level"},
        {"1 lamp A nan", "nan"},         {"1 add A", "level is missing"},
        {"1 tilt", "tilt is missing"},   {"1 tilt 200", "outside"},
        {"1 tilt 20 in 3", "too many"},  {"1 head 1 2", "head is missing"},
        {"1 aim wall 1 2", "neither"},   {"1 aim screen 1280 0", "outside"},
        {"1 aim ceiling 2 0", "aim x"},  {"1 fault camera tired", "fine, unplugged"},
        {"1 fault mouse fine", "mouse"}, {"1 dance", "\"dance\" is not"},
        {"1", "what happens"},           {"1 fault camera deaf", "flood"},
    };
    struct scenario s;
    small_booth(&s);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct error err = {0};
        struct event *events;
        int count;
        char text[128], where[80];
        snprintf(text, sizeof text, "# first\n0 lamp A\n%s\n", bad[i][0]);
        const char *path = file_with(text);
        assert_false(script_load(path, &s, &events, &count, &err));
        snprintf(where, sizeof where, "%s:3", path);
        if (!strstr(err.text, bad[i][1]) || !strstr(err.text, where))
            fail_msg("\"%s\" does not say \"%s\" and \"%s\"", err.text, bad[i][1], where);
        assert_int_equal(err.code, ERROR_CONFIG);
        unlink(path);
    }
}

static void an_empty_script_has_no_events(void **state)
{
    (void)state;
    struct scenario s;
    struct error err = {0};
    struct event *events;
    int count = -1;
    small_booth(&s);
    const char *path = file_with("# nothing\n   \n");
    assert_true(script_load(path, &s, &events, &count, &err));
    assert_int_equal(count, 0);
    free(events);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_instruments_of_a_booth_are_chosen_by_name),
        cmocka_unit_test(the_shipped_booth_loads_with_its_three_lamps),
        cmocka_unit_test(a_bad_scenario_is_refused_by_file_and_key),
        cmocka_unit_test(a_missing_scenario_is_named),
        cmocka_unit_test(a_lamp_option_replaces_or_adds_a_lamp),
        cmocka_unit_test(a_spectrum_file_lies_beside_the_scenario),
        cmocka_unit_test(a_bad_lamp_file_is_refused),
        cmocka_unit_test(a_lamp_that_is_neither_name_nor_file_is_refused),
        cmocka_unit_test(a_script_is_read_in_order_of_time),
        cmocka_unit_test(a_bad_script_is_refused_by_line),
        cmocka_unit_test(an_empty_script_has_no_events),
    };
    return cmocka_run_group_tests(tests, a_folder, no_folder);
}
