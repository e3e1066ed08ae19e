// SPDX-License-Identifier: Apache-2.0
// The instruments' threads, with drivers whose behaviour a test turns.
#include "tests/fakes/support.h"

#include <pthread.h>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/acquire.h"

static const int64_t PATIENCE_NS = 20 * NS_PER_S; // of the tests, never of the product
static const int64_t STEP_NS = NS_PER_MS;
static const double EXACT = 1e-9;

// What the fake spectrometer does; all under the lock.
enum behaviour { FINE, AWAY, LOST, TIRED, HUNG };

enum { STALE = 2 }; // its counts that were exposed before they were asked for

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static enum behaviour behaviour;
static int opens, closes, reads, open_now, counted;
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

// Counts 100 more than the reading's number; the first two were exposed before any request.
static bool fake_counts(struct spectrometer *device, int integration_us, int64_t deadline_ns,
                        struct spectrum_counts *out, struct error *err)
{
    (void)device, (void)deadline_ns;
    clock_sleep_until_ns(clock_now_ns() + STEP_NS);
    pthread_mutex_lock(&lock);
    int n = ++counted;
    enum behaviour b = behaviour;
    pthread_mutex_unlock(&lock);
    if (b != FINE)
        return fail(err, b == TIRED ? ERROR_RETRY : ERROR_GONE, "no counts");
    int64_t now_ns = clock_now_ns();
    *out = (struct spectrum_counts){
        .taken = {n <= STALE ? 0 : now_ns, now_ns},
        .integration_us = integration_us,
        .detector = {.pixels = 4, .active = {2, 3}, .black = {{0, 0}, {1, 1}}, .saturation = 1000}};
    for (int i = 0; i < 4; i++)
        out->raw[i] = (uint16_t)(100 * i + n - STALE);
    return true;
}

static const struct spectrometer_driver fake = {"fake",        fake_open,  fake_read,
                                                fake_identify, fake_close, fake_counts};
static const struct spectrometer_driver countless = {"countless",   fake_open,  fake_read,
                                                     fake_identify, fake_close, NULL};

static struct acquire *begin_with(const struct spectrometer_driver *driver, enum behaviour b)
{
    struct acquire_from from = {.spectrometer = driver, .spectrometer_options = {.serial = "EMU7"}};
    struct error err = {0};
    opens = closes = reads = open_now = counted = 0;
    let_go = false;
    behave(b);
    struct acquire *a = acquire_start(&from, &err);
    assert_non_null(a);
    return a;
}

static struct acquire *begin(enum behaviour b)
{
    return begin_with(&fake, b);
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

static void a_driver_that_outlasts_its_deadline_is_seen_while_it_does(void **state)
{
    (void)state;
    struct acquire *a = begin(FINE);
    await_state(a, INSTRUMENT_IS_RUNNING);
    behave(HUNG);
    int64_t until_ns = clock_now_ns() + PATIENCE_NS, overdue_ns = report_of(a).overdue_ns;
    while (report_of(a).overdue_ns <= overdue_ns + STEP_NS) { // a reading has a second
        assert_true(clock_now_ns() < until_ns);
        clock_sleep_until_ns(clock_now_ns() + STEP_NS);
    }
    overdue_ns = report_of(a).overdue_ns;
    behave(FINE);
    end(a);
    assert_true(overdue_ns > 0);
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

// ---- series of raw readings ----------------------------------------------------

static struct series found;

static struct error series_of(struct acquire *a, int readings, int64_t within_ns)
{
    struct error err = {0};
    int64_t now_ns = clock_now_ns();
    uint64_t number =
        acquire_ask_series(a, &(struct series_wanted){5000, readings, now_ns, now_ns + within_ns});
    while (!acquire_series(a, number, &found, &err)) {
        assert_true(clock_now_ns() < now_ns + PATIENCE_NS);
        clock_sleep_until_ns(clock_now_ns() + STEP_NS);
    }
    return err;
}

static void a_series_holds_what_was_exposed_after_it_was_asked_for(void **state)
{
    (void)state;
    struct acquire *a = begin(FINE);
    await_state(a, INSTRUMENT_IS_RUNNING);
    assert_int_equal(series_of(a, 5, PATIENCE_NS).code, ERROR_NONE);
    assert_int_equal(found.readings, 5);
    assert_int_equal(found.integration_us, 5000);
    assert_int_equal(found.saturated, 0);
    for (int i = 0; i < 4; i++) {
        assert_near(found.mean[i], 100 * i + 3, EXACT);
        assert_near(found.deviation[i], sqrt(2.5), EXACT); // of 1..5
    }
    for (int n = 0; n < 5; n++) {
        assert_near(found.black[n], 50 + n + 1, EXACT);
        assert_near(found.active[n], 250 + n + 1, EXACT);
    }
    uint64_t before = report_of(a).samples;
    while (report_of(a).samples == before) // it goes on reading
        clock_sleep_until_ns(clock_now_ns() + STEP_NS);
    assert_int_equal(series_of(a, 1, PATIENCE_NS).code, ERROR_NONE);
    assert_near(found.deviation[2], 0, 0);
    end(a);
}

static void a_series_of_a_lost_instrument_is_refused_and_it_is_opened_anew(void **state)
{
    (void)state;
    struct acquire *a = begin(FINE);
    await_state(a, INSTRUMENT_IS_RUNNING);
    behave(LOST);
    int before = count(&opens);
    assert_int_equal(series_of(a, 5, PATIENCE_NS).code, ERROR_GONE);
    behave(FINE);
    await_state(a, INSTRUMENT_IS_RUNNING);
    assert_true(count(&opens) > before);
    end(a);
}

static void a_series_ends_at_its_deadline_and_with_a_reason(void **state)
{
    (void)state;
    struct acquire *a = begin(TIRED);
    struct error err = series_of(a, 3, PATIENCE_NS);
    assert_int_equal(err.code, ERROR_RETRY);
    assert_holds(err.text, "reading 1 of 3");
    behave(FINE);
    err = series_of(a, SERIES_MOST, 20 * NS_PER_MS);
    assert_int_equal(err.code, ERROR_RETRY);
    assert_holds(err.text, "time is up");
    end(a);
    a = begin_with(&countless, FINE);
    err = series_of(a, 1, PATIENCE_NS);
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_holds(err.text, "countless");
    end(a);
}

static void a_series_takes_no_mixture(void **state)
{
    (void)state;
    static struct series s;
    static struct spectrum_counts c = {.integration_us = 1000, .detector = {.pixels = 3}};
    struct error err = {0};
    c.detector.active = (struct pixel_range){0, 2};
    c.detector.black[0] = c.detector.black[1] = (struct pixel_range){0, -1};
    c.detector.saturation = 500;
    c.raw[1] = 500;
    assert_true(series_add(&s, &c, &err));
    assert_int_equal(s.saturated, 1);
    assert_near(s.black[0], 0, 0);
    c.integration_us = 1010;
    assert_false(series_add(&s, &c, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    c.integration_us = 1000;
    for (int i = 1; i < SERIES_MOST; i++)
        assert_true(series_add(&s, &c, &err));
    assert_false(series_add(&s, &c, &err));
    assert_int_equal(s.readings, SERIES_MOST);
    assert_near(s.mean[1], 500, EXACT);
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
        cmocka_unit_test(a_driver_that_outlasts_its_deadline_is_seen_while_it_does),
        cmocka_unit_test(a_driver_that_hangs_is_not_waited_for_beyond_the_deadline),
        cmocka_unit_test(no_instruments_need_no_threads),
        cmocka_unit_test(a_series_holds_what_was_exposed_after_it_was_asked_for),
        cmocka_unit_test(a_series_of_a_lost_instrument_is_refused_and_it_is_opened_anew),
        cmocka_unit_test(a_series_ends_at_its_deadline_and_with_a_reason),
        cmocka_unit_test(a_series_takes_no_mixture),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
