// SPDX-License-Identifier: Apache-2.0
// The table of faults, docs/faults.md: each row is brought about on an emulated
// instrument of a running booth. The instruments fail side by side, each on a
// lane of its own; every row is then a test that says what was seen.
#include "tests/fakes/support.h"

#include <pthread.h>

#include "tests/whole/running.h"

#include "tests/whole/booth_here.h"

// Bounds of a hang, not of speed: recovery takes 2 s, an enumeration (2 s) and
// three integrations on a machine that has nothing else to do.
enum { RECOVERY_S = 30, EFFECT_S = 20 };
// umockdev 0.17 keeps a socket for a node whose opening was refused: one for each such row.
enum { REFUSED_NODES = 2 };
enum { SAMPLES_AFTER = 3, SAMPLES_RIDDEN = 5 };
enum { MEASURE_S = 4, MEASURES_MOST = 12 };
static const int64_t LOOK_NS = 30 * NS_PER_MS;
static const double MUTE_MS = 900;  // far above any instrument's cycle under this light
static const double GROWS_MS = 100; // by so much, between two looks
static const int64_t PAUSE_NS = 150 * NS_PER_MS;
static const double TILT_DEG = 0.1; // the emulated inclinometer's noise and steps
static const double EYE_M = 0.02;   // the camera's pixels, at arm's length
static const double TRUE_TILT_DEG = 30, TRUE_EYE_M[3] = {0, 0.55, 0.65};
#ifdef __SANITIZE_ADDRESS__
// Freed memory is kept aside for a while; leaks are seen by the sanitizer itself.
static const double GROWTH_MIB = 1024;
#else
static const double GROWTH_MIB = 16; // some pages of allocators and of the renderer
#endif

enum effect {
    GOES,   // the instrument is away until the cause is
    BLINKS, // it is lost once and comes back by itself
    MUTE,   // it is there, and says nothing that can be believed
    RIDES,  // samples go on
    FAILS,  // a reading asked for fails, the next ones do not
};

struct row {
    const char *instrument, *fault;
    enum effect effect;
    const char *says;  // in the instrument's last error
    const char *first; // another fault, before this one
    const char *on;    // another instrument that fails
    char finding[512]; // what was wrong; "" = nothing
    double back_ms;
};

#define SPECTROMETER "spectrometer"
#define INCLINOMETER "inclinometer"
#define CAMERA "camera"
#define RADIOMETER "radiometer"
#define TCP "tcp-inclinometer"
#define SECOND "second-spectrometer"

static struct row rows[] = {
    {SPECTROMETER, "unplugged", .effect = GOES, .says = "no spectrometer"},
    {SPECTROMETER, "pulled-in-command", .effect = GOES},
    {SPECTROMETER, "pulled-in-spectrum", .effect = GOES},
    {SPECTROMETER, "moved", .effect = BLINKS},
    {SPECTROMETER, "forbidden", .effect = GOES, .says = "udev rules", .first = "unplugged"},
    {SPECTROMETER, "stall", .effect = RIDES},
    {SPECTROMETER, "short", .effect = MUTE},
    {SPECTROMETER, "silent", .effect = MUTE},
    {SPECTROMETER, "garbage", .effect = MUTE},
    {SPECTROMETER, "no-sync", .effect = MUTE},
    {SPECTROMETER, "bad-sync", .effect = MUTE},
    {SPECTROMETER, "out-of-step", .effect = MUTE},
    {SPECTROMETER, "other-pixels", .effect = MUTE},
    {SPECTROMETER, "overflow", .effect = MUTE},
    {SPECTROMETER, "deaf", .effect = RIDES},
    {INCLINOMETER, "unplugged", .effect = GOES},
    {INCLINOMETER, "silent", .effect = MUTE},
    {INCLINOMETER, "garbage", .effect = MUTE},
    {INCLINOMETER, "short", .effect = MUTE},
    {INCLINOMETER, "stall", .effect = MUTE},
    {INCLINOMETER, "bad-crc", .effect = MUTE},
    {INCLINOMETER, "wrong-unit", .effect = MUTE},
    {INCLINOMETER, "late", .effect = MUTE},
    {INCLINOMETER, "dropped", .effect = RIDES},
    {INCLINOMETER, "illegal-function", .effect = MUTE},
    {INCLINOMETER, "illegal-address", .effect = MUTE},
    {INCLINOMETER, "illegal-value", .effect = MUTE},
    {INCLINOMETER, "device-failure", .effect = MUTE},
    {CAMERA, "unplugged", .effect = GOES},
    {CAMERA, "forbidden", .effect = GOES, .says = "udev rules", .first = "unplugged"},
    {CAMERA, "silent", .effect = MUTE},
    {CAMERA, "garbage", .effect = MUTE},
    {CAMERA, "short", .effect = MUTE},
    {CAMERA, "stall", .effect = RIDES},
    {CAMERA, "flood", .effect = RIDES},
    {CAMERA, "wrong-report", .effect = MUTE},
    {RADIOMETER, "unplugged", .effect = FAILS},
    {RADIOMETER, "silent", .effect = FAILS},
    {RADIOMETER, "garbage", .effect = FAILS},
    {RADIOMETER, "short", .effect = FAILS},
    {RADIOMETER, "stall", .effect = FAILS},
    {RADIOMETER, "weak-light", .effect = FAILS, .says = "-8"},
    {RADIOMETER, "overload", .effect = FAILS, .says = "-2"},
    {TCP, "unplugged", .effect = GOES},
    {TCP, "silent", .effect = MUTE},
    {TCP, "garbage", .effect = MUTE},
    {TCP, "short", .effect = MUTE},
    {TCP, "bad-crc", .effect = MUTE},
    {TCP, "wrong-unit", .effect = MUTE},
    {TCP, "late", .effect = MUTE},
    {TCP, "dropped", .effect = RIDES},
    {TCP, "half-open", .effect = MUTE},
    {SECOND, "unplugged", .effect = RIDES, .on = SPECTROMETER},
    {SECOND, "unplugged", .effect = GOES, .says = "EMU2P0002"},
};
enum { ROWS = sizeof rows / sizeof *rows };

// An instrument's rows in turn, on a thread of its own.
struct lane {
    const char *label;      // in the table
    const char *instrument; // boothsim's word
    const char *name;       // boothd's word
    const char *runs;       // how the log says that it is there
    int booth_number;
    struct control_client *daemon, *booth;
    pthread_t thread;
};

enum { BOOTHS = 2 };
static struct booth_here booths[BOOTHS];
static struct held at_start[BOOTHS], at_end[BOOTHS];

static struct lane lanes[] = {
    {SPECTROMETER, "spectrometer", "spectrometer", "running", 0, NULL, NULL, 0},
    {INCLINOMETER, "inclinometer", "accelerometer", "running", 0, NULL, NULL, 0},
    {CAMERA, "camera", "tracker", "running", 0, NULL, NULL, 0},
    {RADIOMETER, "radiometer", "radiometer", "open", 0, NULL, NULL, 0},
    {TCP, "inclinometer", "accelerometer", "running", 1, NULL, NULL, 0},
    {SECOND, "spectrometer2", "spectrometer", "running", 1, NULL, NULL, 0},
};
enum { LANES = sizeof lanes / sizeof *lanes, RADIOMETERS_LANE = 3 };

// What is looked at in a status.
struct look {
    char state[16], error[200];
    double samples, age_ms;   // of the instrument
    double value[3], held_ms; // of what it tells the booth
};

__attribute__((format(printf, 2, 3))) static bool found(struct row *row, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    if (!*row->finding)
        vsnprintf(row->finding, sizeof row->finding, format, args);
    va_end(args);
    return false;
}

static void take_value(const json_t *status, const char *name, struct look *look)
{
    const json_t *eye = dig(status, "eye.eye_m");
    if (!strcmp(name, "accelerometer")) {
        look->value[0] = dig_real(status, "tilt.tilt_deg");
        look->held_ms = dig_real(status, "tilt.age_ms");
    } else if (!strcmp(name, "tracker")) {
        for (size_t i = 0; i < 3; i++)
            look->value[i] = json_number_value(json_array_get(eye, i));
        look->held_ms = dig_real(status, "eye.age_ms");
    } else {
        look->value[0] = dig_real(status, "lamp.lux");
        look->held_ms = dig_real(status, "instruments.spectrometer.age_ms");
    }
}

// False when boothd does not answer.
static bool look_at(struct lane *lane, struct row *row, struct look *look)
{
    char path[64];
    json_t *status = booth_status(lane->daemon);
    *look = (struct look){0};
    if (!status)
        return found(row, "boothd does not answer");
    snprintf(path, sizeof path, "instruments.%s", lane->name);
    const json_t *instrument = dig(status, path);
    snprintf(look->state, sizeof look->state, "%s", dig_text(instrument, "state"));
    snprintf(look->error, sizeof look->error, "%s", dig_text(instrument, "last_error"));
    look->samples = dig_real(instrument, "samples");
    look->age_ms = dig_real(instrument, "age_ms");
    take_value(status, lane->name, look);
    json_decref(status);
    return true;
}

static void pause_for(int64_t ns)
{
    clock_sleep_until_ns(clock_now_ns() + ns);
}

typedef bool condition(const struct look *look, const struct look *since, const struct row *row);

static bool is_away(const struct look *look, const struct look *since, const struct row *row)
{
    (void)since;
    return !strcmp(look->state, "waiting") && (!row->says || strstr(look->error, row->says));
}

static bool is_mute(const struct look *look, const struct look *since, const struct row *row)
{
    (void)since, (void)row;
    return look->held_ms > MUTE_MS;
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

static bool is_true_value(const struct lane *lane, const struct look *look)
{
    const double *v = look->value;
    if (!strcmp(lane->name, "accelerometer"))
        return fabs(v[0] - TRUE_TILT_DEG) < TILT_DEG;
    if (!strcmp(lane->name, "tracker"))
        return hypot(hypot(v[0] - TRUE_EYE_M[0], v[1] - TRUE_EYE_M[1]), v[2] - TRUE_EYE_M[2]) <
               EYE_M;
    return v[0] > 0;
}

// Looks until the condition holds; the last look is left in `look`.
static bool await(struct lane *lane, struct row *row, condition *holds, const char *what,
                  const struct look *since, int within_s, struct look *look)
{
    int64_t until_ns = clock_now_ns() + within_s * NS_PER_S;
    do {
        if (!look_at(lane, row, look))
            return false;
        if (holds(look, since, row) && (holds != is_back || is_true_value(lane, look)))
            return true;
        pause_for(LOOK_NS);
    } while (clock_now_ns() < until_ns);
    return found(row, "%s never: %s, %.0f samples, %.0f ms old, held for %.0f ms, %g %g %g, \"%s\"",
                 what, look->state, look->samples, look->age_ms, look->held_ms, look->value[0],
                 look->value[1], look->value[2], look->error);
}

// While nothing comes the last good value stays and its age grows.
static bool holds_on(struct lane *lane, struct row *row)
{
    struct look a, b;
    if (!look_at(lane, row, &a))
        return false;
    pause_for(PAUSE_NS);
    if (!look_at(lane, row, &b))
        return false;
    if (memcmp(a.value, b.value, sizeof a.value) || !is_true_value(lane, &b))
        return found(row, "the value was not held: %g, then %g", a.value[0], b.value[0]);
    if (b.held_ms < a.held_ms + GROWS_MS)
        return found(row, "its age does not grow: %g, then %g ms", a.held_ms, b.held_ms);
    return true;
}

// State in a line of the log, "waiting: ..."; NULL when the line is another's.
static const char *state_in(const char *line, const char *name, size_t *size)
{
    char start[64];
    int length = snprintf(start, sizeof start, "boothd: %s: ", name);
    if (strncmp(line, start, (size_t)length))
        return NULL;
    *size = strcspn(line + length, ":\n");
    return line + length;
}

// One line per change of state: no state follows itself, the last is the present one.
static int changes_logged(struct lane *lane, struct row *row, long from)
{
    char last[32], *text = booth_log(&booths[lane->booth_number], from);
    int count = 0;
    snprintf(last, sizeof last, "%s", lane->runs);
    for (char *line = text; *line; line = strchr(line, '\n') ? strchr(line, '\n') + 1 : "") {
        size_t size;
        const char *state = state_in(line, lane->name, &size);
        if (!state)
            continue;
        if (size == strlen(last) && !strncmp(state, last, size))
            found(row, "\"%s\" was logged twice in a row", last);
        snprintf(last, sizeof last, "%.*s", (int)size, state);
        count++;
    }
    free(text);
    if (strcmp(last, lane->runs))
        found(row, "the last line of the log is still \"%s\"", last);
    return count;
}

static bool was_logged(struct lane *lane, long from)
{
    char *text = booth_log(&booths[lane->booth_number], from), wanted[64];
    snprintf(wanted, sizeof wanted, "boothd: %s: waiting", lane->name);
    bool was = strstr(text, wanted);
    free(text);
    return was;
}

static bool blinked(struct lane *lane, struct row *row, long from)
{
    int64_t until_ns = clock_now_ns() + EFFECT_S * NS_PER_S;
    while (!was_logged(lane, from) && clock_now_ns() < until_ns)
        pause_for(LOOK_NS);
    return was_logged(lane, from) || found(row, "it was never lost");
}

static bool suffer(struct lane *lane, struct row *row, const struct look *before, long from)
{
    struct look look;
    switch (row->effect) {
    case GOES:
        return await(lane, row, is_away, "away", before, EFFECT_S, &look) &&
               await(lane, row, is_mute, "mute", before, EFFECT_S, &look) && holds_on(lane, row);
    case BLINKS:
        return blinked(lane, row, from);
    case MUTE:
        return await(lane, row, is_mute, "mute", before, EFFECT_S, &look) && holds_on(lane, row);
    case RIDES:
        return await(lane, row, rides_on, "going on", before, EFFECT_S, &look);
    case FAILS:
        break;
    }
    return true;
}

static bool cause(struct lane *lane, struct row *row, const char *fault)
{
    return booth_fault(lane->booth, row->on ? row->on : lane->instrument, fault) ||
           found(row, "boothsim does not know \"%s\"", fault);
}

static void run_polled(struct lane *lane, struct row *row)
{
    struct look before, ill, after;
    if (!look_at(lane, row, &before))
        return;
    long from = booth_log_size(&booths[lane->booth_number]);
    if (row->first && (!cause(lane, row, row->first) ||
                       !await(lane, row, is_mute, "mute", &before, EFFECT_S, &ill)))
        return;
    if (!cause(lane, row, row->fault))
        return;
    suffer(lane, row, &before, from);
    look_at(lane, row, &ill);
    int64_t fine_ns = clock_now_ns();
    if (!cause(lane, row, "fine") || !await(lane, row, is_back, "back", &ill, RECOVERY_S, &after))
        return;
    row->back_ms = (double)(clock_now_ns() - fine_ns) / NS_PER_MS;
    int lines = changes_logged(lane, row, from);
    if (lines > 0 && row->effect == RIDES)
        found(row, "%d lines were logged of something that changed nothing", lines);
    if (lines < 2 && (row->effect == GOES || row->effect == BLINKS))
        found(row, "its going and coming was not logged");
}

static bool measures(struct lane *lane, struct error *err)
{
    json_t *reply =
        control_call(lane->daemon, json_pack("{ss,si}", "do", "measure", "timeout_s", MEASURE_S),
                     BOOTH_CALL_MS, err);
    json_decref(reply);
    return reply;
}

static void run_asked(struct lane *lane, struct row *row)
{
    struct error err = {0};
    long from = booth_log_size(&booths[lane->booth_number]);
    if (!cause(lane, row, row->fault))
        return;
    if (measures(lane, &err))
        found(row, "a reading succeeded");
    else if (row->says && !strstr(err.text, row->says))
        found(row, "\"%s\" does not say \"%s\"", err.text, row->says);
    int64_t fine_ns = clock_now_ns();
    if (!cause(lane, row, "fine"))
        return;
    bool any = false;
    for (int i = 0; !any && i < MEASURES_MOST; i++)
        any = measures(lane, &err);
    if (!any)
        found(row, "no reading any more: %s", err.text);
    row->back_ms = (double)(clock_now_ns() - fine_ns) / NS_PER_MS;
    changes_logged(lane, row, from);
}

static void *run_lane(void *argument)
{
    struct lane *lane = argument;
    for (int i = 0; i < ROWS; i++)
        if (!strcmp(rows[i].instrument, lane->label)) {
            if (rows[i].effect == FAILS)
                run_asked(lane, &rows[i]);
            else
                run_polled(lane, &rows[i]);
        }
    return NULL;
}

static bool runs(struct control_client *daemon, const char *name)
{
    char path[64];
    snprintf(path, sizeof path, "instruments.%s.state", name);
    json_t *status = booth_status(daemon);
    bool yes = !strcmp(dig_text(status, path), "running");
    json_decref(status);
    return yes;
}

static bool comes_up(struct lane *lane)
{
    struct error err = {0};
    int64_t until_ns = clock_now_ns() + RUNNING_PATIENCE_S * NS_PER_S;
    if (lane == &lanes[RADIOMETERS_LANE]) {
        bool any = false;
        json_decref(control_call(lane->daemon,
                                 json_pack("{ss,s[fff]}", "do", "patch", "rgb", 1.0, 1.0, 1.0),
                                 BOOTH_CALL_MS, NULL));
        for (int i = 0; !any && i < MEASURES_MOST; i++)
            any = measures(lane, &err);
        return any;
    }
    while (!runs(lane->daemon, lane->name) && clock_now_ns() < until_ns)
        pause_for(LOOK_NS);
    return runs(lane->daemon, lane->name);
}

// Descriptors and threads may lag behind their instrument by a moment.
static struct held settled(pid_t pid, const struct held *wanted)
{
    int64_t until_ns = clock_now_ns() + EFFECT_S * NS_PER_S;
    struct held now = held_by(pid);
    while (
        (now.descriptors > wanted->descriptors + REFUSED_NODES || now.threads != wanted->threads) &&
        clock_now_ns() < until_ns) {
        pause_for(LOOK_NS);
        now = held_by(pid);
    }
    return now;
}

static bool open_booths(void)
{
    return booth_open(&booths[0], "", "") &&
           booth_open(&booths[1],
                      "[inclinometer]\ntcp = yes\n[spectrometer2]\nserial = EMU2P0002\n",
                      "--set accelerometer.port=127.0.0.1:$(cat $run/inclinometer.port)"
                      " --set spectrometer.serial=EMU2P0002"
                      " --set spectrometer.calibration=$run/spectrometer2.cal"
                      " --set tracker.driver=none --set radiometer.driver=none"
                      " --set display.output=offscreen");
}

static int live_through_all(void **state)
{
    (void)state;
    if (!open_booths())
        return -1;
    for (int i = 0; i < LANES; i++) {
        struct booth_here *b = &booths[lanes[i].booth_number];
        lanes[i].daemon = connect_to(folder_at(&b->folder, "run/boothd.sock"), b->booth);
        lanes[i].booth = connect_to(folder_at(&b->folder, "run/boothsim.sock"), b->booth);
    }
    for (int i = 0; i < LANES; i++)
        if (!comes_up(&lanes[i]))
            return -1;
    for (int i = 0; i < BOOTHS; i++)
        at_start[i] = held_by(booths[i].daemon);
    for (int i = 0; i < LANES; i++)
        assert_int_equal(pthread_create(&lanes[i].thread, NULL, run_lane, &lanes[i]), 0);
    for (int i = 0; i < LANES; i++)
        pthread_join(lanes[i].thread, NULL);
    for (int i = 0; i < BOOTHS; i++)
        at_end[i] = settled(booths[i].daemon, &at_start[i]);
    return 0;
}

static int leave(void **state)
{
    (void)state;
    int status = 0;
    for (int i = 0; i < LANES; i++) {
        control_close(lanes[i].daemon);
        control_close(lanes[i].booth);
    }
    for (int i = 0; i < BOOTHS; i++)
        status = booth_close(&booths[i]) || status ? -1 : 0;
    return status;
}

static void row_is_as_the_table_says(void **state)
{
    const struct row *row = *state;
    print_message("%s %s: back after %.0f ms\n", row->instrument, row->fault, row->back_ms);
    if (*row->finding)
        print_error("%s\n", row->finding);
    assert_false(*row->finding);
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
    static struct CMUnitTest tests[ROWS + 1];
    static char names[ROWS][64];
    for (int i = 0; i < ROWS; i++) {
        const char *on = rows[i].on;
        snprintf(names[i], sizeof names[i], "%s_%s%s%s", rows[i].instrument, on ? on : "",
                 on ? "-" : "", rows[i].fault);
        tests[i] = (struct CMUnitTest){
            .name = names[i], .test_func = row_is_as_the_table_says, .initial_state = &rows[i]};
    }
    tests[ROWS] = (struct CMUnitTest)cmocka_unit_test(boothd_lives_and_holds_no_more_than_before);
    return cmocka_run_group_tests(tests, live_through_all, leave);
}
