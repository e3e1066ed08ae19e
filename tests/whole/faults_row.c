// SPDX-License-Identifier: Apache-2.0
// One row of the table on a polled instrument: the cause comes, boothd suffers
// it as the table says, the cause goes, the instrument is back in time.
#include "tests/fakes/support.h"

#include "tests/whole/running.h"

#include "tests/whole/faults.h"
#include "tests/whole/faults_pace.h"

enum { HANG_S = 60 }; // bounds a hang only
enum { SAMPLES_AFTER = 3, SAMPLES_RIDDEN = 5 };
static const double MUTE_MS = 900;  // far above any instrument's cycle under this light
static const double GROWS_MS = 100; // by so much, between two looks

// Recovery: to notice it, to open it and to find its exposure; three samples; and, when it was
// away, its own enumeration.
static const double NOTICED_MS = 2000;
// Opening a spectrometer and finding its exposure are some 60 transfers, each of
// some five steps between programs and threads that wake each other; on a busy
// machine each step takes what an exchange with boothd takes.
enum { EXCHANGES = 300 };
// A driver's waits end by its deadline; this is for what it does then.
static const double OVERDUE_MS = 50;

typedef bool condition(const struct look *look, const struct look *since, const struct row *row);

static bool says_so(const struct look *look, const struct row *row)
{
    return !row->says || strstr(look->error, row->says);
}

static bool is_away(const struct look *look, const struct look *since, const struct row *row)
{
    (void)since;
    return !strcmp(look->state, "waiting") && says_so(look, row);
}

static bool is_mute(const struct look *look, const struct look *since, const struct row *row)
{
    (void)since, (void)row;
    return look->held_ms > MUTE_MS;
}

static bool is_given_up(const struct look *look, const struct look *since, const struct row *row)
{
    (void)since;
    return strcmp(look->state, "running") && says_so(look, row);
}

static bool is_back(const struct look *look, const struct look *since, const struct row *row)
{
    (void)row;
    return !strcmp(look->state, "running") && look->samples >= since->samples + SAMPLES_AFTER &&
           look->held_ms < MUTE_MS;
}

static bool rides_on(const struct look *look, const struct look *since, const struct row *row)
{
    (void)row;
    return look->samples >= since->samples + SAMPLES_RIDDEN;
}

static bool ever(const struct look *look, const struct look *since, const struct row *row)
{
    (void)look, (void)since, (void)row;
    return true;
}

// Looks until the condition holds and, unless it is to be mute, the value is
// true; the last look is left in `look`.
static bool await(struct lane *lane, struct row *row, condition *holds, const char *what,
                  const struct look *since, struct look *look)
{
    int64_t until_ns = clock_now_ns() + HANG_S * NS_PER_S;
    do {
        if (!look_again(lane, row, look))
            return false;
        bool any_value = holds != is_back && holds != rides_on && holds != ever;
        if (holds(look, since, row) && (any_value || is_true_value(lane, look)))
            return true;
    } while (clock_now_ns() < until_ns);
    return found(row, "%s never: %s, %.0f samples, %.0f ms old, held for %.0f ms, %g %g %g, \"%s\"",
                 what, look->state, look->samples, look->age_ms, look->held_ms, look->value[0],
                 look->value[1], look->value[2], look->error);
}

// It stays given up; however often it is opened, the log does not tell.
static bool lasts(struct lane *lane, struct row *row)
{
    struct look look;
    int64_t until_ns = clock_now_ns() + row->lasts_s * NS_PER_S;
    while (clock_now_ns() < until_ns)
        if (!look_again(lane, row, &look))
            return false;
        else if (!strcmp(look.state, "running"))
            return found(row, "it was called running meanwhile");
    return true;
}

// While nothing comes the last good value stays and its age grows.
static bool holds_on(struct lane *lane, struct row *row)
{
    struct look a, b;
    int64_t until_ns = clock_now_ns() + HANG_S * NS_PER_S;
    if (!look_at(lane, row, &a))
        return false;
    do {
        if (!look_again(lane, row, &b))
            return false;
        if (memcmp(a.value, b.value, sizeof a.value) || !is_true_value(lane, &b))
            return found(row, "the value was not held: %g %g %g, then %g %g %g", a.value[0],
                         a.value[1], a.value[2], b.value[0], b.value[1], b.value[2]);
    } while (b.held_ms < a.held_ms + GROWS_MS && clock_now_ns() < until_ns);
    return b.held_ms >= a.held_ms + GROWS_MS ||
           found(row, "its age does not grow: %g, then %g ms", a.held_ms, b.held_ms);
}

static bool was_logged(struct lane *lane, long from)
{
    char *text = booth_log(lane->here, from), wanted[64];
    snprintf(wanted, sizeof wanted, "boothd: %s: waiting", lane->kind->name);
    bool was = strstr(text, wanted);
    free(text);
    return was;
}

static bool blinked(struct lane *lane, struct row *row, long from)
{
    struct look look;
    int64_t until_ns = clock_now_ns() + HANG_S * NS_PER_S;
    while (!was_logged(lane, from) && clock_now_ns() < until_ns)
        if (!look_again(lane, row, &look))
            return false;
    return was_logged(lane, from) || found(row, "it was never lost");
}

// Samples go on, and each is true.
static bool rides(struct lane *lane, struct row *row, const struct look *before)
{
    struct look look = *before;
    int64_t until_ns = clock_now_ns() + HANG_S * NS_PER_S;
    while (!rides_on(&look, before, row) && clock_now_ns() < until_ns)
        if (!look_again(lane, row, &look))
            return false;
        else if (!is_true_value(lane, &look))
            return found(row, "its value became %g %g %g", look.value[0], look.value[1],
                         look.value[2]);
    return rides_on(&look, before, row) || found(row, "no samples any more");
}

static bool suffer(struct lane *lane, struct row *row, const struct look *before, long from)
{
    struct look look;
    switch (row->effect) {
    case GOES:
        return await(lane, row, is_away, "away", before, &look) &&
               await(lane, row, is_mute, "mute", before, &look) && holds_on(lane, row);
    case BLINKS:
        return blinked(lane, row, from);
    case MUTE:
        return await(lane, row, is_given_up, "given up", before, &look) && lasts(lane, row) &&
               holds_on(lane, row);
    case RIDES:
        return row->light > 0 ? await(lane, row, rides_on, "true", before, &look)
                              : rides(lane, row, before);
    case FAILS:
        break;
    }
    return true;
}

// Its going and its coming; what is mute may be silent before it is given up.
static bool lines_are_due(enum effect effect, int lines)
{
    switch (effect) {
    case GOES:
    case BLINKS:
        return lines == 2;
    case MUTE:
        return lines == 2 || lines == 3;
    case RIDES:
    case FAILS:
        break;
    }
    return lines == 0;
}

void judge_recovery(struct lane *lane, struct row *row, int64_t fine_ns, int64_t back_ns)
{
    bool was_away = (row->effect == GOES || row->effect == BLINKS) && !row->first;
    double busy_ms = EXCHANGES * pace_exchange_ms(fine_ns, back_ns);
    row->back_ms = (double)(back_ns - fine_ns) / NS_PER_MS;
    row->allowed_ms = NOTICED_MS + (was_away ? lane->kind->enumerates_ms : 0) +
                      SAMPLES_AFTER * lane->period_ms + busy_ms;
    if (row->back_ms > row->allowed_ms)
        found(row, "back after %.0f ms instead of %.0f, of which %.0f because the machine is busy",
              row->back_ms, row->allowed_ms, busy_ms);
}

double lateness_allowed_ms(int64_t from_ns, int64_t to_ns)
{
    return OVERDUE_MS + EXCHANGES * pace_exchange_ms(from_ns, to_ns);
}

static void judge_deadlines(struct row *row, const struct look *before, const struct look *after)
{
    double allowed_ms = lateness_allowed_ms(before->answered_ns, after->answered_ns);
    if (after->overdue_ms > before->overdue_ms && after->overdue_ms > allowed_ms + row->stops_ms)
        found(row, "its driver outlasted a deadline by %.0f ms", after->overdue_ms);
}

static bool begin(struct lane *lane, struct row *row, struct look *before)
{
    struct look none = {0};
    lane->light = row->light_before > 0 ? row->light_before : 1;
    return (row->light_before <= 0 || dim(lane, row, row->light_before)) &&
           await(lane, row, ever, "true", &none, before);
}

static bool bring_about(struct lane *lane, struct row *row, const struct look *before)
{
    struct look ill;
    if (row->first &&
        (!cause(lane, row, row->first) || !await(lane, row, is_mute, "mute", before, &ill)))
        return false;
    if (!cause(lane, row, row->fault) || (row->light > 0 && !dim(lane, row, row->light)))
        return false;
    if (row->effect == RIDES && row->light > 0)
        lane->light = row->light;
    return true;
}

static bool end(struct lane *lane, struct row *row)
{
    lane->light = 1;
    return (row->light_before <= 0 || dim(lane, row, 1)) && cause(lane, row, "fine");
}

void run_polled(struct lane *lane, struct row *row)
{
    struct look before, ill, after;
    if (!begin(lane, row, &before))
        return;
    long from = booth_log_size(lane->here);
    if (!bring_about(lane, row, &before))
        return;
    suffer(lane, row, &before, from);
    look_at(lane, row, &ill);
    snprintf(row->said, sizeof row->said, "%s", ill.error);
    if (!end(lane, row))
        return;
    int64_t fine_ns = clock_now_ns();
    if (!await(lane, row, is_back, "back", &ill, &after))
        return;
    judge_recovery(lane, row, fine_ns, after.answered_ns - (int64_t)(after.age_ms * NS_PER_MS));
    judge_deadlines(row, &before, &after);
    int lines = changes_logged(lane, row, from);
    if (!lines_are_due(row->effect, lines))
        found(row, "%d lines were logged of its changes", lines);
}
