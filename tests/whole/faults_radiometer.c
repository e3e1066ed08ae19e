// SPDX-License-Identifier: Apache-2.0
// Faults of the radiometer, which reads when it is asked to.
#include "tests/fakes/support.h"

#include "calibration/measuring.h"
#include "calibration/patches.h"
#include "tests/whole/running.h"

#include "tests/whole/faults.h"
#include "tests/whole/faults_pace.h"

enum { MEASURE_S = 4, MEASURES_MOST = 12, WHITES = 5 };
static const double REPEATS = 0.02; // its noise, and the lamp that warms up

static struct row rows[] = {
    {"unplugged", .effect = FAILS, .says = "is gone"},
    {"forbidden", .effect = FAILS, .says = "70-boothd.rules", .first = "unplugged"},
    {"silent", .effect = FAILS, .says = "no answer in time"},
    {"garbage", .effect = FAILS, .says = "answered"},
    {"short", .effect = FAILS, .says = "no answer in time"},
    {"stall", .effect = FAILS, .says = "-1"},
    {"weak-light", .effect = FAILS, .says = "-8"},
    {"overload", .effect = FAILS, .says = "-2"},
    {"drift", .effect = RIDES},
};

static struct row averaging_rows[] = {
    {"misread", .effect = FAILS, .says = "do not agree"},
};

static bool any_reading(struct lane *lane, double *luminance, struct error *err)
{
    bool any = false;
    for (int i = 0; !any && i < MEASURES_MOST; i++)
        any = measures(lane, MEASURE_S, luminance, err);
    return any;
}

static bool show_white(struct lane *lane)
{
    double luminance;
    struct error err = {0};
    json_decref(control_call(lane->daemon,
                             json_pack("{ss,s[fff]}", "do", "patch", "rgb", 1.0, 1.0, 1.0),
                             BOOTH_CALL_MS, NULL));
    if (!any_reading(lane, &luminance, &err))
        return false;
    int64_t begun_ns = clock_now_ns();
    if (!any_reading(lane, &luminance, &err))
        return false;
    lane->truth[0] = luminance;
    lane->period_ms = (double)(clock_now_ns() - begun_ns) / NS_PER_MS;
    return true;
}

// A reading that is asked for; its answer must come when its time is up.
static bool timely(struct lane *lane, struct row *row, double *luminance, struct error *err)
{
    int64_t asked_ns = clock_now_ns();
    bool good = measures(lane, MEASURE_S, luminance, err);
    int64_t answered_ns = clock_now_ns();
    double late_ms = (double)(answered_ns - asked_ns) / NS_PER_MS - MEASURE_S * 1000;
    if (late_ms > lateness_allowed_ms(asked_ns, answered_ns))
        found(row, "the answer came %.0f ms late", late_ms);
    return good;
}

static void end(struct lane *lane, struct row *row, long from)
{
    double luminance;
    struct error err = {0};
    if (!cause(lane, row, "fine"))
        return;
    int64_t fine_ns = clock_now_ns();
    if (!any_reading(lane, &luminance, &err))
        found(row, "no reading any more: %s", err.text);
    else if (fabs(luminance / lane->truth[0] - 1) > REPEATS)
        found(row, "%g cd/m2 instead of %g", luminance, lane->truth[0]);
    judge_recovery(lane, row, fine_ns, clock_now_ns());
    int lines = changes_logged(lane, row, from);
    if (lines != 0 && lines != 2)
        found(row, "%d lines were logged of its changes", lines);
}

static void run_asked(struct lane *lane, struct row *row)
{
    double luminance;
    struct error err = {0};
    long from = booth_log_size(lane->here);
    if (row->first && (!cause(lane, row, row->first) || timely(lane, row, &luminance, &err)))
        found(row, "a reading succeeded without it");
    if (!cause(lane, row, row->fault))
        return;
    if (timely(lane, row, &luminance, &err))
        found(row, "a reading succeeded");
    else if (row->says && !strstr(err.text, row->says))
        found(row, "\"%s\" does not say \"%s\"", err.text, row->says);
    snprintf(row->said, sizeof row->said, "%s", err.text);
    end(lane, row, from);
}

// Readings go on; only who repeats white can tell, and boothcal does.
static void run_drift(struct lane *lane, struct row *row)
{
    struct display_patch whites[WHITES] = {0};
    struct patch_set set = {WHITES, whites};
    struct error err = {0};
    long from = booth_log_size(lane->here);
    if (!cause(lane, row, row->fault))
        return;
    for (int i = 0; i < WHITES; i++) {
        whites[i] = (struct display_patch){.counts = {1, 1, 1}, .elapsed_s = i};
        if (!timely(lane, row, &whites[i].xyz.Y, &err))
            found(row, "no reading: %s", err.text);
    }
    double drift = patch_set_drift(&set).white;
    if (!(drift > MEASURING_DRIFT_WARN))
        found(row, "boothcal would not warn of white that drifted by %g", drift);
    end(lane, row, from);
}

static void run_row(struct lane *lane, struct row *row)
{
    if (row->effect == RIDES)
        run_drift(lane, row);
    else
        run_asked(lane, row);
}

const struct kind radiometer_kind = {.label = "radiometer",
                                     .instrument = "radiometer",
                                     .name = "radiometer",
                                     .runs = "open",
                                     .rows = rows,
                                     .count = sizeof rows / sizeof *rows,
                                     .run = run_row,
                                     .come_up = show_white};

const struct kind averaging_radiometer_kind = {.label = "averaging-radiometer",
                                               .instrument = "radiometer",
                                               .name = "radiometer",
                                               .runs = "open",
                                               .rows = averaging_rows,
                                               .count =
                                                   sizeof averaging_rows / sizeof *averaging_rows,
                                               .run = run_row,
                                               .come_up = show_white};
