// SPDX-License-Identifier: Apache-2.0
// The table of faults, docs/faults.md: each row is brought about on an emulated
// instrument of a running booth. The instruments fail side by side, round by
// round; after each round the booths hold what they held before. Every row is
// then a test that says what was seen.
#include "tests/fakes/support.h"

#include "tests/whole/running.h"

#include "tests/whole/faults.h"
#include "tests/whole/faults_pace.h"

static const int64_t LOOK_NS = 30 * NS_PER_MS;
enum { SETTLE_S = 60 }; // bounds a hang only
enum { PERIODS = 10 };  // samples that the time from one to the next is taken from
// umockdev 0.17 keeps a socket for a node whose opening was refused: one for each such row.
enum { REFUSED_NODES = 2 };
#ifdef __SANITIZE_ADDRESS__
// Freed memory is kept aside for a while; leaks are seen by the sanitizer itself.
static const double GROWTH_MIB = 1024;
#else
static const double GROWTH_MIB = 16; // some pages of allocators and of the renderer
#endif

enum { BOOTHS = 3 };
static struct booth_here booths[BOOTHS];
static struct held at_start[BOOTHS], at_end[BOOTHS];

static struct lane lanes[] = {
    {.kind = &spectrometer_kind, .here = &booths[0]},
    {.kind = &inclinometer_kind, .here = &booths[0]},
    {.kind = &camera_kind, .here = &booths[0]},
    {.kind = &radiometer_kind, .here = &booths[0]},
    {.kind = &tcp_kind, .here = &booths[1]},
    {.kind = &second_spectrometer_kind, .here = &booths[1]},
    {.kind = &opentrack_kind, .here = &booths[1]},
    {.kind = &spectrometer_kind, .here = &booths[2]},
    {.kind = &inclinometer_kind, .here = &booths[2]},
    {.kind = &camera_kind, .here = &booths[2]},
    {.kind = &averaging_radiometer_kind, .here = &booths[2]},
};
enum { LANES = sizeof lanes / sizeof *lanes };

// In the order of the table.
static const struct kind *const kinds[] = {
    &spectrometer_kind, &second_spectrometer_kind, &inclinometer_kind, &tcp_kind,
    &camera_kind,       &opentrack_kind,           &radiometer_kind,   &averaging_radiometer_kind,
};
enum { KINDS = sizeof kinds / sizeof *kinds, ROWS_MOST = 128 };

// ---- booths ----------------------------------------------------------------------------

static bool open_second_booth(void)
{
    char scenario[256], arguments[1024];
    int port = opentrack_free_port();
    snprintf(scenario, sizeof scenario,
             "[inclinometer]\ntcp = yes\n[spectrometer2]\nserial = EMU2P0002\n"
             "[opentrack]\nport = %d\n",
             port);
    snprintf(arguments, sizeof arguments,
             "--set accelerometer.port=127.0.0.1:$(cat $run/inclinometer.port)"
             " --set spectrometer.serial=EMU2P0002"
             " --set spectrometer.calibration=$run/spectrometer2.cal"
             " --set tracker.driver=opentrack --set tracker.port=%d"
             " --set tracker.signs='1 1 1 1 1 -1'"
             " --set radiometer.driver=none --set display.output=offscreen",
             port);
    return booth_open(&booths[1], scenario, arguments);
}

static bool open_booths(void)
{
    return booth_open(&booths[0], "", "") && open_second_booth() &&
           booth_open(&booths[2], "", "--set radiometer.average=3 --set display.output=offscreen");
}

static bool samples_reach(struct lane *lane, double count, struct look *look)
{
    struct row none = {0};
    int64_t until_ns = clock_now_ns() + SETTLE_S * NS_PER_S;
    do {
        if (!look_again(lane, &none, look))
            return false;
    } while (look->samples < count && clock_now_ns() < until_ns);
    return look->samples >= count && !strcmp(look->state, "running");
}

static bool comes_up(struct lane *lane)
{
    struct look first, then;
    if (lane->kind->come_up && !lane->kind->come_up(lane))
        return false;
    if (lane->kind->run)
        return true;
    if (!samples_reach(lane, PERIODS, &first) ||
        !samples_reach(lane, first.samples + PERIODS, &then))
        return false;
    memcpy(lane->truth, then.value, sizeof lane->truth);
    lane->period_ms = ((double)(then.answered_ns - first.answered_ns) / NS_PER_MS) /
                      (then.samples - first.samples);
    return true;
}

// Descriptors and threads may lag behind their instrument by a moment.
static struct held settled(const struct booth_here *here, const struct held *wanted)
{
    int64_t until_ns = clock_now_ns() + SETTLE_S * NS_PER_S;
    struct held now = held_by(here->daemon);
    while (
        (now.descriptors > wanted->descriptors + REFUSED_NODES || now.threads != wanted->threads) &&
        clock_now_ns() < until_ns) {
        clock_sleep_until_ns(clock_now_ns() + LOOK_NS);
        now = held_by(here->daemon);
    }
    return now;
}

// ---- rounds ----------------------------------------------------------------------------

static struct row *next_row(const struct kind *kind, bool alone)
{
    for (int i = 0; i < kind->count; i++)
        if (!kind->rows[i].run && kind->rows[i].alone == alone)
            return &kind->rows[i];
    return NULL;
}

static void *run_row(void *argument)
{
    struct lane *lane = argument;
    if (lane->kind->run)
        lane->kind->run(lane, lane->row);
    else
        run_polled(lane, lane->row);
    return NULL;
}

static void compare_held(int booth)
{
    struct held now = settled(&booths[booth], &at_start[booth]);
    for (int i = 0; i < LANES; i++) {
        struct row *row = lanes[i].here == &booths[booth] ? lanes[i].row : NULL;
        if (row && now.descriptors > at_start[booth].descriptors + REFUSED_NODES)
            found(row, "%d descriptors after its round, %d at the start", now.descriptors,
                  at_start[booth].descriptors);
        if (row && now.threads != at_start[booth].threads)
            found(row, "%d threads after its round, %d at the start", now.threads,
                  at_start[booth].threads);
    }
    at_end[booth] = now;
}

// One row on each lane that has one left; only one when alone. False when none was left.
static bool run_round(bool alone)
{
    int count = 0;
    for (int i = 0; i < LANES; i++) {
        lanes[i].row = alone && count ? NULL : next_row(lanes[i].kind, alone);
        if (!lanes[i].row)
            continue;
        lanes[i].row->run = true;
        count++;
        assert_int_equal(pthread_create(&lanes[i].thread, NULL, run_row, &lanes[i]), 0);
    }
    for (int i = 0; i < LANES; i++)
        if (lanes[i].row)
            pthread_join(lanes[i].thread, NULL);
    for (int i = 0; i < BOOTHS; i++)
        compare_held(i);
    return count > 0;
}

static int live_through_all(void **state)
{
    (void)state;
    if (!open_booths())
        return -1;
    for (int i = 0; i < LANES; i++) {
        struct booth_here *here = lanes[i].here;
        lanes[i].light = 1;
        lanes[i].daemon = connect_to(folder_at(&here->folder, "run/boothd.sock"), here->booth);
        lanes[i].booth = connect_to(folder_at(&here->folder, "run/boothsim.sock"), here->booth);
    }
    for (int i = 0; i < LANES; i++)
        if (!comes_up(&lanes[i]))
            return -1;
    struct booth_here *first = &booths[0];
    if (!pace_start(connect_to(folder_at(&first->folder, "run/boothd.sock"), first->booth)))
        return -1;
    for (int i = 0; i < BOOTHS; i++)
        at_start[i] = held_at_rest(booths[i].daemon);
    while (run_round(false))
        continue;
    while (run_round(true))
        continue;
    return 0;
}

static int leave(void **state)
{
    (void)state;
    int status = 0;
    pace_stop();
    for (int i = 0; i < LANES; i++) {
        control_close(lanes[i].daemon);
        control_close(lanes[i].booth);
    }
    for (int i = 0; i < BOOTHS; i++)
        status = booth_close(&booths[i]) || status ? -1 : 0;
    return status;
}

// ---- what was seen ---------------------------------------------------------------------

static void row_is_as_the_table_says(void **state)
{
    const struct row *row = *state;
    print_message("back after %.0f of %.0f ms; said \"%s\"\n", row->back_ms, row->allowed_ms,
                  row->said);
    if (*row->finding)
        print_error("%s\n", row->finding);
    assert_true(row->run);
    assert_false(*row->finding);
}

// "| INSTRUMENT | FAULT | WHAT IS INJECTED | BOOTHD | "SAYS" | `TEST` |", the third as it is.
static bool stands_there(const char *line, const struct kind *kind, const struct row *row)
{
    char start[128], end[256];
    int length = snprintf(start, sizeof start, "| %s | %s | ", kind->label, row_name(row));
    const char *quote = row->says ? "\"" : "", *gap = row->says ? " " : "";
    snprintf(end, sizeof end, " | %s | %s%s%s%s| `%s_%s` |", effect_text(row->effect), quote,
             row->says ? row->says : "", quote, gap, kind->label, row_name(row));
    size_t size = strlen(line), tail = strlen(end);
    return !strncmp(line, start, (size_t)length) && size > (size_t)length + tail &&
           !strcmp(line + size - tail, end);
}

static void the_document_has_just_these_rows(void **state)
{
    (void)state;
    char line[1024] = "";
    FILE *file = fopen("docs/faults.md", "r");
    assert_non_null(file);
    while (strncmp(line, "|---", 4))
        assert_non_null(fgets(line, sizeof line, file));
    for (int k = 0; k < KINDS; k++)
        for (int i = 0; i < kinds[k]->count; i++) {
            assert_non_null(fgets(line, sizeof line, file));
            line[strcspn(line, "\n")] = 0;
            if (!stands_there(line, kinds[k], &kinds[k]->rows[i]))
                print_error("%s_%s is not \"%s\"\n", kinds[k]->label, row_name(&kinds[k]->rows[i]),
                            line);
            assert_true(stands_there(line, kinds[k], &kinds[k]->rows[i]));
        }
    assert_null(fgets(line, sizeof line, file));
    fclose(file);
}

static void boothd_lives_and_holds_no_more_than_before(void **state)
{
    (void)state;
    for (int i = 0; i < BOOTHS; i++) {
        const struct held *b = &at_start[i], *a = &at_end[i];
        print_message("%d descriptors, %d threads, %.1f MiB before; %d, %d, %.1f MiB after\n",
                      b->descriptors, b->threads, b->resident_mib, a->descriptors, a->threads,
                      a->resident_mib);
        assert_int_equal(kill(booths[i].daemon, 0), 0);
        assert_in_range(a->descriptors, b->descriptors, b->descriptors + REFUSED_NODES);
        assert_int_equal(a->threads, b->threads);
        assert_true(a->resident_mib - b->resident_mib < GROWTH_MIB);
    }
}

int main(void)
{
    static struct CMUnitTest tests[ROWS_MOST];
    static char names[ROWS_MOST][64];
    int count = 0;
    for (int k = 0; k < KINDS; k++)
        for (int i = 0; i < kinds[k]->count; i++, count++) {
            struct row *row = &kinds[k]->rows[i];
            snprintf(names[count], sizeof *names, "%s_%s", kinds[k]->label, row_name(row));
            tests[count] = (struct CMUnitTest){
                .name = names[count], .test_func = row_is_as_the_table_says, .initial_state = row};
        }
    tests[count++] = (struct CMUnitTest)cmocka_unit_test(the_document_has_just_these_rows);
    tests[count++] =
        (struct CMUnitTest)cmocka_unit_test(boothd_lives_and_holds_no_more_than_before);
    return cmocka_run_group_tests(tests, live_through_all, leave); // passes over the empty ones
}
