// SPDX-License-Identifier: Apache-2.0
// Small parts: what is visible, jobs, teaching's average, the command line.
#include "tests/fakes/support.h"

#include <poll.h>

#include "daemon/ctl.h"
#include "daemon/desk.h"
#include "daemon/frame.h"
#include "daemon/jobs.h"
#include "daemon/options.h"

static const double EXACT = 1e-12;

// ---- what is visible -------------------------------------------------------

static struct state standing_still(void)
{
    struct state s = {0};
    s.lamp.index = 1;
    s.lamp.level = 0.8;
    s.tilt.deg = 30;
    return s;
}

static void noise_below_what_is_seen_changes_nothing(void **state)
{
    (void)state;
    struct state shown = standing_still(), now = shown;
    now.lamp.level *= 1.0004;
    now.tilt.deg += 0.019;
    now.eye.at.x = 0.0004;
    struct state s = still(&shown, &now);
    assert_near(s.lamp.level, 0.8, 0);
    assert_near(s.tilt.deg, 30, 0);
    assert_near(s.eye.at.x, 0, 0);
}

static void what_is_seen_comes_through_and_takes_the_rest_along(void **state)
{
    (void)state;
    struct state shown = standing_still(), now = shown;
    now.lamp.level *= 1.0004;
    now.tilt.deg += 0.03;
    now.eye.at.x = 0.3;
    struct state s = still(&shown, &now);
    assert_near(s.tilt.deg, 30.03, EXACT);
    assert_near(s.lamp.level, 0.8, 0);
    assert_near(s.eye.at.x, 0.3, 0);
    now = shown;
    now.eye.at.x = 0.0006; // the display's light falls with the angle
    assert_near(still(&shown, &now).eye.at.x, 0.0006, EXACT);
    now = shown;
    now.lamp.level *= 1.001;
    assert_near(still(&shown, &now).lamp.level, 0.8008, EXACT);
    now = shown;
    now.lamp.index = 0;
    now.lamp.level = 0.80001;
    assert_near(still(&shown, &now).lamp.level, 0.80001, EXACT);
}

static void a_slow_drift_is_shown_in_steps_that_cannot_be_seen(void **state)
{
    (void)state;
    struct state shown = standing_still(), now = shown;
    int steps = 0;
    for (int i = 0; i < 10000; i++) {
        now.lamp.level = 0.8 * (1 + 1e-5 * i);
        struct state s = still(&shown, &now);
        steps += s.lamp.level != shown.lamp.level;
        assert_near(s.lamp.level / now.lamp.level, 1, 5.1e-4);
        shown = s;
    }
    assert_true(steps > 150 && steps < 250); // ln(1.1) / 0.0005
}

// ---- jobs ------------------------------------------------------------------

static void jobs_come_in_order_and_their_answers_too(void **state)
{
    (void)state;
    struct jobs *jobs = jobs_create(NULL);
    struct pollfd waiting = {jobs_fd(jobs), POLLIN, 0};
    struct job job;
    assert_int_equal(poll(&waiting, 1, 0), 0);
    assert_false(jobs_take(jobs, &job));
    for (int i = 1; i <= 3; i++)
        assert_true(jobs_post(jobs, &(struct job){.ticket = i}, NULL));
    assert_int_equal(poll(&waiting, 1, 0), 1);
    for (uint64_t i = 1; i <= 3; i++) {
        assert_true(jobs_take(jobs, &job));
        assert_int_equal(job.ticket, i);
        job.reply = json_integer((json_int_t)i);
        jobs_finish(jobs, &job);
    }
    assert_int_equal(poll(&waiting, 1, 0), 0);
    for (uint64_t i = 1; i <= 2; i++) {
        assert_true(jobs_finished(jobs, &job));
        assert_int_equal(job.ticket, i);
        job_fini(&job);
    }
    jobs_destroy(jobs); // frees the third answer
    jobs_destroy(NULL);
}

static void more_jobs_than_can_wait_are_refused(void **state)
{
    (void)state;
    struct jobs *jobs = jobs_create(NULL);
    struct error err = {0};
    struct job job = {0};
    for (int i = 0; i < JOBS_MOST; i++)
        assert_true(jobs_post(jobs, &job, &err));
    assert_false(jobs_post(jobs, &job, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    assert_true(jobs_take(jobs, &job));
    assert_false(jobs_post(jobs, &job, &err)); // taken, but not answered
    jobs_finish(jobs, &job);
    assert_true(jobs_finished(jobs, &job));
    assert_true(jobs_post(jobs, &job, &err));
    jobs_destroy(jobs);
}

// ---- teaching --------------------------------------------------------------

static void the_average_of_readings_is_their_mean_and_rms_spread(void **state)
{
    (void)state;
    struct spectrum readings[2], mean;
    double spread;
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        readings[0].v[i] = 0.9 * (1 + i);
        readings[1].v[i] = 1.1 * (1 + i);
    }
    teach_average(readings, 2, &mean, &spread);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        assert_near(mean.v[i], 1 + i, 1e-9);
    assert_near(spread, 0.1, EXACT);
    teach_average(readings, 1, &mean, &spread);
    assert_near(spread, 0, 0);
    struct spectrum dark = {{0}};
    teach_average(&dark, 1, &mean, &spread);
    assert_near(spread, 0, 0);
}

static void the_uncertainty_of_a_mean_is_no_less_than_the_calibrations(void **state)
{
    (void)state;
    struct spectrum sigmas[2], sigma;
    for (int i = 0; i < SPECTRUM_COUNT; i++) {
        sigmas[0].v[i] = 3 + i;
        sigmas[1].v[i] = i % 2 ? 3 + i : 0;
    }
    teach_sigma(sigmas, 2, &sigma);
    assert_near(sigma.v[1], 4, EXACT); // two alike are as uncertain as one
    assert_near(sigma.v[0], 3 / sqrt(2), EXACT);
}

// ---- command lines ---------------------------------------------------------

static bool parse(struct boothd_options *o, struct error *err, const char *a, const char *b,
                  const char *c)
{
    char *argv[] = {"boothd", (char *)a, (char *)b, (char *)c, NULL};
    return options_parse(1 + !!a + !!b + !!c, argv, "/cfg", "/home/me", o, err);
}

static void boothd_finds_its_settings_and_takes_its_options(void **state)
{
    (void)state;
    struct boothd_options o;
    struct error err = {0};
    assert_true(parse(&o, &err, NULL, NULL, NULL));
    assert_int_equal(o.mode, MODE_RUN);
    assert_string_equal(o.config, "/cfg/boothd/boothd.conf");
    assert_true(parse(&o, &err, "--config=x", "--set=a.b=1", "--set=c.d=2"));
    assert_string_equal(o.config, "x");
    assert_int_equal(o.source.override_count, 2);
    assert_string_equal(o.source.overrides[1], "c.d=2");
    assert_true(parse(&o, &err, "--check", NULL, NULL));
    assert_int_equal(o.mode, MODE_CHECK);
    char *bare[] = {"boothd", NULL};
    assert_true(options_parse(1, bare, NULL, "/home/me", &o, &err));
    assert_string_equal(o.config, "/home/me/.config/boothd/boothd.conf");
    assert_false(options_parse(1, bare, NULL, NULL, &o, &err));
    assert_holds(err.text, "--config");
}

static void boothd_refuses_what_it_does_not_know(void **state)
{
    (void)state;
    static const char *const bad[] = {"--loud", "now", "--config", "--set"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct boothd_options o;
        struct error err = {0};
        assert_false(parse(&o, &err, bad[i], NULL, NULL));
        assert_int_equal(err.code, ERROR_CONFIG);
        assert_holds(err.text, bad[i]);
    }
}

static void a_negative_number_is_a_number_and_no_option(void **state)
{
    (void)state;
    struct ctl c;
    struct error err = {0};
    char *patch[] = {"boothctl", "patch", "--timeout", "3", "-0.1", "0", "0x1", NULL};
    assert_false(ctl_parse(7, patch, &c, &err));
    assert_holds(err.text, "R: \"-0.1\"");
    assert_holds(err.text, "0..1");
    patch[4] = "0.1";
    assert_false(ctl_parse(7, patch, &c, &err));
    assert_holds(err.text, "B: \"0x1\"");
    patch[3] = "-3";
    patch[6] = "1";
    assert_false(ctl_parse(7, patch, &c, &err));
    assert_holds(err.text, "--timeout: \"-3\"");
    char *option[] = {"boothctl", "status", "-x", NULL};
    assert_false(ctl_parse(3, option, &c, &err));
    assert_holds(err.text, "option");
}

static void boothctl_makes_whole_paths_before_it_asks(void **state)
{
    (void)state;
    struct ctl c;
    char *show[] = {"boothctl", "show", "sub/wood.ini", NULL};
    assert_true(ctl_parse(3, show, &c, NULL));
    const char *material = json_string_value(json_object_get(c.request, "material"));
    assert_int_equal(*material, '/');
    assert_holds(material, "/sub/wood.ini");
    json_decref(c.request);
    show[2] = "wood";
    assert_true(ctl_parse(3, show, &c, NULL));
    assert_string_equal(json_string_value(json_object_get(c.request, "material")), "wood");
    json_decref(c.request);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(noise_below_what_is_seen_changes_nothing),
        cmocka_unit_test(what_is_seen_comes_through_and_takes_the_rest_along),
        cmocka_unit_test(a_slow_drift_is_shown_in_steps_that_cannot_be_seen),
        cmocka_unit_test(jobs_come_in_order_and_their_answers_too),
        cmocka_unit_test(more_jobs_than_can_wait_are_refused),
        cmocka_unit_test(the_average_of_readings_is_their_mean_and_rms_spread),
        cmocka_unit_test(the_uncertainty_of_a_mean_is_no_less_than_the_calibrations),
        cmocka_unit_test(boothd_finds_its_settings_and_takes_its_options),
        cmocka_unit_test(boothd_refuses_what_it_does_not_know),
        cmocka_unit_test(a_negative_number_is_a_number_and_no_option),
        cmocka_unit_test(boothctl_makes_whole_paths_before_it_asks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
