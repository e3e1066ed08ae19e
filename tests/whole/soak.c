// SPDX-License-Identifier: Apache-2.0
// Two real minutes over the wire at native rates, with faults now and then:
// boothd holds at the end what it held at the start.
#include "tests/fakes/support.h"

#include "tests/whole/running.h"

#include "tests/whole/booth_here.h"

#ifdef __SANITIZE_ADDRESS__
enum { SOAK_S = 20 };
// Freed memory is kept aside for a while; leaks are seen by the sanitizer itself.
static const double GROWTH_MIB = 1024;
#else
enum { SOAK_S = 120 };
static const double GROWTH_MIB = 8; // a leak of a byte and a half each microsecond is more
#endif
enum { FAULT_EVERY_S = 3, FAULT_FOR_S = 1, SETTLE_S = 30 };
static const int64_t LOOK_NS = 100 * NS_PER_MS;
// Of the native rates, so that a busy machine passes; a spectrum takes 29 ms and more.
static const double SPECTRA_HZ = 2, TILTS_HZ = 2, HEADS_HZ = 20;

// One after the other, all of them again and again; those that ride on too.
static const struct {
    const char *instrument, *kind;
} faults[] = {
    {"spectrometer", "stall"},     {"inclinometer", "bad-crc"}, {"camera", "short"},
    {"spectrometer", "unplugged"}, {"inclinometer", "dropped"}, {"camera", "flood"},
    {"spectrometer", "bad-sync"},  {"radiometer", "silent"},    {"camera", "unplugged"},
    {"inclinometer", "unplugged"}, {"spectrometer", "moved"},   {"radiometer", "unplugged"},
};
enum { FAULTS = sizeof faults / sizeof *faults };

static struct booth_here here;
static struct control_client *daemon_client, *booth_client;

static bool all_run(void)
{
    static const char *const states[] = {"instruments.spectrometer.state",
                                         "instruments.accelerometer.state",
                                         "instruments.tracker.state"};
    bool all = true;
    json_t *status = booth_status(daemon_client);
    assert_non_null(status);
    for (int i = 0; i < 3; i++)
        all = all && !strcmp(dig_text(status, states[i]), "running");
    json_decref(status);
    return all;
}

static void pause_for(int64_t ns)
{
    clock_sleep_until_ns(clock_now_ns() + ns);
}

static void await_all(void)
{
    int64_t until_ns = clock_now_ns() + SETTLE_S * NS_PER_S;
    while (!all_run()) {
        assert_true(clock_now_ns() < until_ns);
        pause_for(LOOK_NS);
    }
}

static void measure(bool must_succeed)
{
    struct error err = {0};
    json_t *reply = control_call(
        daemon_client, json_pack("{ss,si}", "do", "measure", "timeout_s", 3), BOOTH_CALL_MS, &err);
    if (must_succeed && !reply)
        print_error("%s\n", err.text);
    assert_true(reply || !must_succeed);
    json_decref(reply);
}

static void show(double level)
{
    json_decref(control_call(daemon_client,
                             json_pack("{ss,s[fff]}", "do", "patch", "rgb", level, level, level),
                             BOOTH_CALL_MS, NULL));
}

static double samples_of(const char *instrument)
{
    char path[64];
    snprintf(path, sizeof path, "instruments.%s.samples", instrument);
    json_t *status = booth_status(daemon_client);
    double samples = dig_real(status, path);
    json_decref(status);
    return samples;
}

static struct held settled(const struct held *wanted)
{
    int64_t until_ns = clock_now_ns() + SETTLE_S * NS_PER_S;
    struct held now = held_by(here.daemon);
    while ((now.descriptors != wanted->descriptors || now.threads != wanted->threads) &&
           clock_now_ns() < until_ns) {
        pause_for(LOOK_NS);
        now = held_by(here.daemon);
    }
    return now;
}

static int open_booth(void **state)
{
    (void)state;
    if (!booth_open(&here, "", ""))
        return -1;
    daemon_client = connect_to(folder_at(&here.folder, "run/boothd.sock"), here.booth);
    booth_client = connect_to(folder_at(&here.folder, "run/boothsim.sock"), here.booth);
    return daemon_client && booth_client ? 0 : -1;
}

static int leave(void **state)
{
    (void)state;
    control_close(daemon_client);
    control_close(booth_client);
    return booth_close(&here);
}

// One fault for a moment, then all instruments are there again.
static void suffer(int number)
{
    const char *instrument = faults[number % FAULTS].instrument;
    assert_true(booth_fault(booth_client, instrument, faults[number % FAULTS].kind));
    if (!strcmp(instrument, "radiometer"))
        measure(false);
    else
        pause_for(FAULT_FOR_S * NS_PER_S);
    assert_true(booth_fault(booth_client, instrument, "fine"));
    pause_for((FAULT_EVERY_S - FAULT_FOR_S) * NS_PER_S);
    await_all();
}

static void nothing_grows_while_instruments_run_and_fail(void **state)
{
    (void)state;
    await_all();
    show(1);
    measure(true);
    suffer(0); // each kind of fault once would take as long as the soak itself
    struct held before = held_at_rest(here.daemon);
    double spectra = samples_of("spectrometer"), tilts = samples_of("accelerometer");
    double heads = samples_of("tracker");
    int64_t start_ns = clock_now_ns();
    int number = 1;
    for (; clock_now_ns() < start_ns + SOAK_S * NS_PER_S; number++) {
        show(number % 10 / 10.0);
        suffer(number);
    }
    double seconds = (double)(clock_now_ns() - start_ns) / NS_PER_S;
    measure(true);
    await_all();
    struct held after = settled(&before);
    print_message("%.0f s, %d faults, %.1f spectra, %.1f tilts, %.1f heads a second\n", seconds,
                  number - 1, (samples_of("spectrometer") - spectra) / seconds,
                  (samples_of("accelerometer") - tilts) / seconds,
                  (samples_of("tracker") - heads) / seconds);
    print_message("%d descriptors, %d threads, %.1f MiB before; %d, %d, %.1f MiB after\n",
                  before.descriptors, before.threads, before.resident_mib, after.descriptors,
                  after.threads, after.resident_mib);
    assert_int_equal(after.descriptors, before.descriptors);
    assert_int_equal(after.threads, before.threads);
    assert_true(after.resident_mib - before.resident_mib < GROWTH_MIB);
    assert_true(samples_of("spectrometer") - spectra > SPECTRA_HZ * seconds);
    assert_true(samples_of("accelerometer") - tilts > TILTS_HZ * seconds);
    assert_true(samples_of("tracker") - heads > HEADS_HZ * seconds);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_grows_while_instruments_run_and_fail),
    };
    return cmocka_run_group_tests(tests, open_booth, leave);
}
