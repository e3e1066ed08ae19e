// SPDX-License-Identifier: Apache-2.0
// One instrument's turns on an injected clock, with a driver whose behaviour a
// test turns: the clock and the log of base are answered here.
#include "tests/fakes/support.h"

#include "base/clock.h"
#include "base/log.h"
#include "daemon/polled.h"

static int64_t now_ns;
static int lines;
static char last_line[256];

int64_t clock_now_ns(void)
{
    return now_ns;
}

void clock_sleep_until_ns(int64_t deadline_ns)
{
    now_ns = deadline_ns;
}

void clock_utc(char text[21])
{
    strcpy(text, "2026-01-31T12:34:56Z");
}

void log_init(const char *program, enum log_level least)
{
    (void)program, (void)least;
}

void log_line(enum log_level level, const char *format, ...)
{
    va_list args;
    (void)level;
    va_start(args, format);
    vsnprintf(last_line, sizeof last_line, format, args);
    va_end(args);
    lines++;
}

enum behaviour { FINE, AWAY, LOST, TIRED, SHAKEN, LATE };

struct accelerometer {
    int unused;
};

static enum behaviour behaviour;
static int open_now;
static struct polled *asked; // what another thread sees while the driver is at work
static int64_t overdue_inside_ns;
static const int64_t READING_NS = 400 * NS_PER_MS;
static const int64_t LATE_NS = 70 * NS_PER_MS;

static struct instrument_report report_of(struct polled *p)
{
    struct instrument_report report;
    polled_report(p, now_ns, &report);
    return report;
}

static struct accelerometer *fake_open(const struct accelerometer_options *options,
                                       int64_t deadline_ns, struct error *err)
{
    (void)options, (void)deadline_ns;
    if (behaviour == AWAY) {
        fail(err, ERROR_GONE, "not plugged in");
        return NULL;
    }
    open_now++;
    return calloc(1, sizeof(struct accelerometer));
}

static bool fake_read(struct accelerometer *device, int64_t deadline_ns, struct tilt_sample *out,
                      struct error *err)
{
    (void)device;
    assert_true(deadline_ns > now_ns);
    now_ns = behaviour == LATE ? deadline_ns + LATE_NS : now_ns + READING_NS;
    overdue_inside_ns = report_of(asked).overdue_ns;
    if (behaviour == LOST || behaviour == AWAY)
        return fail(err, ERROR_GONE, "pulled out");
    if (behaviour == TIRED)
        return fail(err, ERROR_RETRY, "nothing yet");
    *out = (struct tilt_sample){.taken = {now_ns - READING_NS, now_ns},
                                .tilt_deg = 30,
                                .plausible = behaviour != SHAKEN,
                                .doubt = behaviour == SHAKEN ? TILT_GRAVITY : TILT_NONE};
    return true;
}

static void fake_identify(const struct accelerometer *device, struct instrument_identity *out)
{
    (void)device;
    *out = (struct instrument_identity){.model = "fake"};
}

static void fake_close(struct accelerometer *device)
{
    open_now--;
    free(device);
}

static const struct accelerometer_driver fake = {"fake",        fake_open,  fake_read,
                                                 fake_identify, fake_close, true};

static struct polled *begin(enum behaviour b)
{
    struct acquire_from from = {.accelerometer = &fake};
    struct polled *p = polled_create(&from, INSTRUMENT_ACCELEROMETER, NULL);
    assert_non_null(p);
    asked = p;
    behaviour = b;
    now_ns = 1000 * NS_PER_S;
    lines = 0;
    return p;
}

static void end(struct polled *p)
{
    polled_destroy(p);
    assert_int_equal(open_now, 0);
}

static enum instrument_state state_of(struct polled *p)
{
    return report_of(p).state;
}

// Rest after the next turn, ms, and lets it pass.
static int turn(struct polled *p)
{
    int64_t rest_ns = polled_turn(p);
    now_ns += rest_ns;
    return (int)(rest_ns / NS_PER_MS);
}

static void who_is_away_is_tried_less_and_less_often_but_every_second(void **state)
{
    (void)state;
    static const int rests_ms[] = {200, 400, 800, 1000, 1000, 1000};
    struct polled *p = begin(AWAY);
    for (int i = 0; i < 6; i++)
        assert_int_equal(turn(p), rests_ms[i]);
    assert_int_equal(state_of(p), INSTRUMENT_IS_WAITING);
    assert_string_equal(last_line, "accelerometer: waiting: not plugged in");
    assert_int_equal(lines, 1);
    end(p);
}

static void only_a_sample_makes_the_rests_short_again(void **state)
{
    (void)state;
    struct polled *p = begin(AWAY);
    for (int i = 0; i < 3; i++)
        turn(p);
    behaviour = LOST; // it opens, and is gone before it says anything
    assert_int_equal(turn(p), 0);
    assert_int_equal(turn(p), 1000);
    behaviour = FINE;
    assert_int_equal(turn(p), 0);
    assert_int_equal(turn(p), 0);
    assert_int_equal(state_of(p), INSTRUMENT_IS_RUNNING);
    behaviour = LOST;
    assert_int_equal(turn(p), 200);
    assert_int_equal(open_now, 0);
    assert_int_equal(lines, 3);
    end(p);
}

static void who_says_nothing_is_silent_and_then_opened_anew(void **state)
{
    (void)state;
    struct polled *p = begin(FINE);
    turn(p);
    turn(p);
    behaviour = TIRED;
    const int64_t last_ns = now_ns;
    while (state_of(p) == INSTRUMENT_IS_RUNNING)
        turn(p);
    assert_true(now_ns - last_ns > 5 * NS_PER_S && now_ns - last_ns < 6 * NS_PER_S);
    assert_int_equal(state_of(p), INSTRUMENT_IS_SILENT);
    assert_int_equal(open_now, 1);
    while (open_now)
        turn(p);
    assert_true(now_ns - last_ns > 15 * NS_PER_S && now_ns - last_ns < 17 * NS_PER_S);
    assert_int_equal(lines, 3);
    end(p);
}

static void an_outage_is_told_once_however_often_it_is_opened_meanwhile(void **state)
{
    (void)state;
    struct polled *p = begin(FINE);
    turn(p);
    turn(p);
    behaviour = TIRED;
    const int64_t last_ns = now_ns;
    bool anew = false;
    while (now_ns < last_ns + 120 * NS_PER_S) {
        turn(p);
        anew = anew || !open_now;
        assert_false(anew && state_of(p) != INSTRUMENT_IS_WAITING);
    }
    assert_true(anew);
    assert_int_equal(lines, 3); // running, silent, waiting
    behaviour = FINE;
    while (state_of(p) != INSTRUMENT_IS_RUNNING)
        turn(p);
    assert_int_equal(lines, 4);
    end(p);
}

static void turn_for(struct polled *p, int64_t ns)
{
    for (int64_t until_ns = now_ns + ns; now_ns < until_ns;)
        turn(p);
}

static void a_doubt_is_told_once_when_it_lasts_and_once_when_it_is_over(void **state)
{
    (void)state;
    struct polled *p = begin(FINE);
    turn_for(p, NS_PER_S);
    for (int i = 0; i < 3; i++) { // a stand that is turned
        behaviour = SHAKEN;
        turn_for(p, 4 * NS_PER_S);
        behaviour = FINE;
        turn_for(p, NS_PER_S);
    }
    assert_int_equal(lines, 1);
    behaviour = SHAKEN;
    turn_for(p, 60 * NS_PER_S);
    assert_int_equal(lines, 2);
    assert_non_null(strstr(last_line, "accelerometer: its samples are passed over: "));
    assert_non_null(strstr(last_line, tilt_doubt_text(TILT_GRAVITY)));
    behaviour = FINE;
    turn_for(p, 10 * NS_PER_S);
    assert_int_equal(lines, 3);
    assert_string_equal(last_line, "accelerometer: its samples are good again");
    end(p);
}

static void a_driver_that_outlasts_its_deadline_is_seen_within_and_afterwards(void **state)
{
    (void)state;
    struct polled *p = begin(FINE);
    turn(p);
    turn(p);
    assert_true(report_of(p).overdue_ns == 0);
    behaviour = LATE;
    turn(p);
    assert_true(overdue_inside_ns == LATE_NS);
    behaviour = FINE;
    turn_for(p, NS_PER_S);
    assert_true(report_of(p).overdue_ns == LATE_NS);
    end(p);
}

static void the_newest_sample_stays_when_the_instrument_goes(void **state)
{
    (void)state;
    struct polled *p = begin(FINE);
    struct tilt_sample sample = {0};
    assert_int_equal(polled_latest(p, &sample), 0);
    turn(p);
    for (int i = 1; i <= 3; i++) {
        turn(p);
        assert_int_equal(polled_latest(p, &sample), i);
    }
    const int64_t latest_ns = now_ns;
    behaviour = LOST;
    turn(p);
    assert_int_equal(polled_latest(p, &sample), 3);
    assert_true(sample.taken.latest_ns == latest_ns);
    assert_true(sample.tilt_deg == 30);
    end(p);
}

static void closing_it_is_not_losing_it(void **state)
{
    (void)state;
    struct polled *p = begin(FINE);
    turn(p);
    turn(p);
    polled_close(p);
    assert_int_equal(open_now, 0);
    assert_int_equal(state_of(p), INSTRUMENT_IS_RUNNING);
    assert_int_equal(turn(p), 0);
    assert_int_equal(open_now, 1);
    assert_int_equal(lines, 1);
    end(p);
    polled_destroy(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(who_is_away_is_tried_less_and_less_often_but_every_second),
        cmocka_unit_test(only_a_sample_makes_the_rests_short_again),
        cmocka_unit_test(who_says_nothing_is_silent_and_then_opened_anew),
        cmocka_unit_test(an_outage_is_told_once_however_often_it_is_opened_meanwhile),
        cmocka_unit_test(a_doubt_is_told_once_when_it_lasts_and_once_when_it_is_over),
        cmocka_unit_test(a_driver_that_outlasts_its_deadline_is_seen_within_and_afterwards),
        cmocka_unit_test(the_newest_sample_stays_when_the_instrument_goes),
        cmocka_unit_test(closing_it_is_not_losing_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
