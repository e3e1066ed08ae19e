// SPDX-License-Identifier: Apache-2.0
// Faults of the radiometer, which reads when it is asked to.
#include "tests/fakes/support.h"

#include "tests/whole/running.h"

#include "tests/whole/faults.h"
#include "tests/whole/faults_pace.h"

enum { MEASURE_S = 4, MEASURES_MOST = 12 };

static struct row rows[] = {
    {"unplugged", .effect = FAILS},
    {"forbidden", .effect = FAILS, .says = "udev rules", .first = "unplugged"},
    {"silent", .effect = FAILS},
    {"garbage", .effect = FAILS},
    {"short", .effect = FAILS},
    {"stall", .effect = FAILS},
    {"weak-light", .effect = FAILS, .says = "-8"},
    {"overload", .effect = FAILS, .says = "-2"},
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

static void run_asked(struct lane *lane, struct row *row)
{
    double luminance;
    struct error err = {0};
    long from = booth_log_size(lane->here);
    if (row->first &&
        (!cause(lane, row, row->first) || measures(lane, MEASURE_S, &luminance, &err)))
        return;
    if (!cause(lane, row, row->fault))
        return;
    if (measures(lane, MEASURE_S, &luminance, &err))
        found(row, "a reading succeeded");
    else if (row->says && !strstr(err.text, row->says))
        found(row, "\"%s\" does not say \"%s\"", err.text, row->says);
    if (!cause(lane, row, "fine"))
        return;
    int64_t fine_ns = clock_now_ns();
    if (!any_reading(lane, &luminance, &err))
        found(row, "no reading any more: %s", err.text);
    judge_recovery(lane, row, fine_ns, clock_now_ns());
    changes_logged(lane, row, from);
}

const struct kind radiometer_kind = {.label = "radiometer",
                                     .instrument = "radiometer",
                                     .name = "radiometer",
                                     .runs = "open",
                                     .opens_ms = 500,
                                     .rows = rows,
                                     .count = sizeof rows / sizeof *rows,
                                     .run = run_asked,
                                     .come_up = show_white};
