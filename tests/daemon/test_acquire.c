// SPDX-License-Identifier: Apache-2.0
// The instruments' threads, with drivers whose behaviour a test turns.
#include "tests/fakes/support.h"

#include <pthread.h>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/acquire.h"

static const int64_t PATIENCE_NS = 20 * NS_PER_S; // of the tests, never of the product
static const int64_t STEP_NS = NS_PER_MS;

// What the fake spectrometer does; all under the lock.
enum behaviour { FINE, AWAY, LOST, TIRED, HUNG };

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static enum behaviour behaviour;
static int opens, closes, reads, open_now;
static bool let_go;

static enum behaviour now_behaves(void)
{
    pthread_mutex_lock(&lock);
    enum behaviour b = behaviour;
    pthread_mutex_unlock(&lock);
    return b;
}

static void behave(enum behaviour b)
{
    pthread_mutex_lock(&lock);
    behaviour = b;
    pthread_mutex_unlock(&lock);
}

static int count(const int *of)
{
    pthread_mutex_lock(&lock);
    int n = *of;
    pthread_mutex_unlock(&lock);
    return n;
}

struct spectrometer {
    char serial[64];
};

static struct spectrometer *fake_open(const struct spectrometer_options *options,
                                      int64_t deadline_ns, struct error *err)
{
    (void)deadline_ns;
    if (now_behaves() == AWAY) {
        fail(err, ERROR_GONE, "not plugged in");
        return NULL;
    }
    struct spectrometer *device = calloc(1, sizeof *device);
    memcpy(device->serial, options->serial, sizeof device->serial);
    pthread_mutex_lock(&lock);
    opens++;
    open_now++;
    pthread_mutex_unlock(&lock);
    return device;
}

static bool fake_read(struct spectrometer *device, int64_t deadline_ns, struct spectrum_sample *out,
                      struct error *err)
{
    (void)device, (void)deadline_ns;
    clock_sleep_until_ns(clock_now_ns() + STEP_NS);
    pthread_mutex_lock(&lock);
    int n = ++reads;
    enum behaviour b = behaviour;
    while (behaviour == HUNG && !let_go) {
        pthread_mutex_unlock(&lock);
        clock_sleep_until_ns(clock_now_ns() + STEP_NS);
        pthread_mutex_lock(&lock);
    }
    pthread_mutex_unlock(&lock);
    if (b == LOST || b == AWAY)
        return fail(err, ERROR_GONE, "pulled out");
    if (b != FINE)
        return fail(err, ERROR_RETRY, "nothing yet");
    int64_t now_ns = clock_now_ns();
    *out = (struct spectrum_sample){.taken = {now_ns - STEP_NS, now_ns}, .averaged = n};
    return true;
}

static void fake_identify(const struct spectrometer *device, struct instrument_identity *out)
{
    *out = (struct instrument_identity){.model = "fake", .emulated = true};
    memcpy(out->serial, device->serial, sizeof out->serial);
}

static void fake_close(struct spectrometer *device)
{
    pthread_mutex_lock(&lock);
    closes++;
    open_now--;
    pthread_mutex_unlock(&lock);
    free(device);
}

static const struct spectrometer_driver fake = {"fake", fake_open, fake_read, fake_identify,
                                                fake_close};

static struct acquire *begin(enum behaviour b)
{
    struct acquire_from from = {.spectrometer = &fake, .spectrometer_options = {.serial = "EMU7"}};
    struct error err = {0};
    opens = closes = reads = open_now = 0;
    let_go = false;
    behave(b);
    struct acquire *a = acquire_start(&from, &err);
    assert_non_null(a);
    return a;
}

static void end(struct acquire *a)
{
    assert_true(acquire_stop(a, clock_now_ns() + PATIENCE_NS));
    assert_int_equal(open_now, 0);
    assert_int_equal(opens, closes);
}

static struct instrument_report report_of(struct acquire *a)
{
    struct instrument_report report;
    acquire_report(a, INSTRUMENT_SPECTROMETER, &report);
    return report;
}

static void await_state(struct acquire *a, enum instrument_state wanted)
{
    int64_t until_ns = clock_now_ns() + PATIENCE_NS;
    while (report_of(a).state != wanted) {
        assert_true(clock_now_ns() < until_ns);
        clock_sleep_until_ns(clock_now_ns() + STEP_NS);
    }
}

static void samples_arrive_with_running_numbers_and_an_identity(void **state)
{
    (void)state;
    struct acquire *a = begin(FINE);
    struct samples seen = {0};
    while (seen.spectrum_number < 5)
        acquire_latest(a, &seen);
    assert_true(seen.spectrum.averaged >= 5);
    assert_int_equal(seen.tilt_number, 0);
    struct instrument_report report = report_of(a);
    assert_int_equal(report.state, INSTRUMENT_IS_RUNNING);
    assert_string_equal(report.driver, "fake");
    assert_string_equal(report.identity.serial, "EMU7");
    assert_true(report.identity.emulated);
    assert_string_equal(report.note, "good");
    assert_int_equal(report.error.code, ERROR_NONE);
    end(a);
}

static void an_instrument_that_is_not_there_is_tried_again_until_it_is(void **state)
{
    (void)state;
    struct acquire *a = begin(AWAY);
    await_state(a, INSTRUMENT_IS_WAITING);
    assert_string_equal(report_of(a).error.text, "not plugged in");
    behave(FINE);
    await_state(a, INSTRUMENT_IS_RUNNING);
    end(a);
}

static void a_lost_instrument_is_closed_and_opened_anew(void **state)
{
    (void)state;
    struct acquire *a = begin(FINE);
    await_state(a, INSTRUMENT_IS_RUNNING);
    uint64_t before = report_of(a).samples;
    behave(AWAY);
    await_state(a, INSTRUMENT_IS_WAITING);
    assert_int_equal(count(&open_now), 0);
    struct samples seen;
    acquire_latest(a, &seen);
    assert_true(seen.spectrum_number >= before); // the last good sample stays
    behave(FINE);
    await_state(a, INSTRUMENT_IS_RUNNING);
    assert_int_equal(count(&opens), 2);
    end(a);
}

static void an_instrument_that_is_lost_right_after_opening_is_not_hammered(void **state)
{
    (void)state;
    struct acquire *a = begin(LOST);
    int64_t begun_ns = clock_now_ns();
    while (count(&opens) < 3)
        clock_sleep_until_ns(clock_now_ns() + STEP_NS);
    // Two rests lie between three tries: 0.2 s and 0.4 s.
    assert_true(clock_now_ns() - begun_ns >= 600 * NS_PER_MS);
    end(a);
}

static void a_time_out_is_no_reason_to_open_anew(void **state)
{
    (void)state;
    struct acquire *a = begin(FINE);
    await_state(a, INSTRUMENT_IS_RUNNING);
    behave(TIRED);
    int before = count(&reads);
    while (count(&reads) < before + 20)
        clock_sleep_until_ns(clock_now_ns() + STEP_NS);
    assert_int_equal(count(&opens), 1);
    assert_int_equal(count(&closes), 0);
    behave(FINE);
    end(a);
}

static void stopping_wakes_a_thread_that_rests(void **state)
{
    (void)state;
    struct acquire *a = begin(AWAY);
    await_state(a, INSTRUMENT_IS_WAITING);
    assert_true(acquire_stop(a, clock_now_ns() + PATIENCE_NS));
}

static void a_driver_that_hangs_is_not_waited_for_beyond_the_deadline(void **state)
{
    (void)state;
    struct acquire *a = begin(HUNG);
    while (!count(&reads))
        clock_sleep_until_ns(clock_now_ns() + STEP_NS);
    assert_false(acquire_stop(a, clock_now_ns() + 10 * NS_PER_MS));
    pthread_mutex_lock(&lock);
    let_go = true;
    pthread_mutex_unlock(&lock);
    end(a);
}

static void no_instruments_need_no_threads(void **state)
{
    (void)state;
    struct acquire_from none = {0};
    struct acquire *a = acquire_start(&none, NULL);
    struct samples seen = {.tilt_number = 9};
    acquire_latest(a, &seen);
    assert_int_equal(seen.spectrum_number + seen.tilt_number + seen.head_number, 0);
    assert_int_equal(report_of(a).state, INSTRUMENT_IS_NONE);
    assert_true(acquire_stop(a, clock_now_ns()));
    assert_true(acquire_stop(NULL, 0));
}

int main(void)
{
    log_init("test", LOG_LEVEL_ERROR);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_arrive_with_running_numbers_and_an_identity),
        cmocka_unit_test(an_instrument_that_is_not_there_is_tried_again_until_it_is),
        cmocka_unit_test(a_lost_instrument_is_closed_and_opened_anew),
        cmocka_unit_test(an_instrument_that_is_lost_right_after_opening_is_not_hammered),
        cmocka_unit_test(a_time_out_is_no_reason_to_open_anew),
        cmocka_unit_test(stopping_wakes_a_thread_that_rests),
        cmocka_unit_test(a_driver_that_hangs_is_not_waited_for_beyond_the_deadline),
        cmocka_unit_test(no_instruments_need_no_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
