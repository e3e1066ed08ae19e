// SPDX-License-Identifier: Apache-2.0
#include "daemon/polled.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"
#include "base/mailbox.h"

static const int64_t OPEN_WITHIN_NS = 3 * NS_PER_S;
static const int64_t CLOSE_WITHIN_NS = NS_PER_S;
static const int64_t FIRST_REST_NS = 200 * NS_PER_MS;
static const int64_t LONGEST_REST_NS = NS_PER_S;      // who comes back is to run within 2 s
static const int64_t SILENT_AFTER_NS = 5 * NS_PER_S;  // without a sample it is reported
static const int64_t REFUSED_REST_NS = 5 * NS_PER_MS; // a driver may refuse at once
static const int64_t REOPEN_AFTER_NS = 15 * NS_PER_S; // without a sample it is opened anew

// A driver of any kind, its types put aside.
struct face {
    const char *driver;
    void *(*open)(const struct acquire_from *from, int64_t deadline_ns, struct error *err);
    bool (*read)(const struct acquire_from *from, void *device, int64_t deadline_ns, void *sample,
                 struct error *err);
    void (*identify)(const struct acquire_from *from, void *device,
                     struct instrument_identity *out);
    void (*close)(const struct acquire_from *from, void *device);
    int64_t (*patience_ns)(const void *sample); // for one reading, after this one
    const struct interval *(*taken)(const void *sample);
    const char *(*note)(const void *sample);
    bool (*doubts)(const void *sample); // that its note is worth a line of the log when it lasts
    size_t size;
};

union any_sample {
    struct spectrum_sample spectrum;
    struct tilt_sample tilt;
    struct head_sample head;
};

// Samples that are good for nothing, once that lasts.
struct doubt {
    bool lasts, told;
    int64_t since_ns;
};

// A request for a series and its answer, between two threads.
struct series_desk {
    pthread_mutex_t lock;
    uint64_t asked, begun, answered; // numbers of requests
    struct series_wanted wanted;
    struct series done;
    struct error err;
};

struct polled {
    struct acquire_from from;
    enum instrument instrument;
    struct face face;
    void *device;    // NULL = not open
    bool any;        // it gave a sample since it was opened
    int64_t last_ns; // when it gave the last one, or was opened
    int64_t rest_ns; // when it is lost next
    struct mailbox box;
    pthread_mutex_t lock; // of report and due_ns
    struct instrument_report report;
    int64_t due_ns; // deadline of the call that the driver is in, 0 = in none
    struct doubt doubt;
    union any_sample sample;
    struct series_desk desk;
    struct series *series; // that is worked on, NULL = none,
    struct series_wanted wanted;
    uint64_t number; // and its request
};

const char *instrument_name(enum instrument instrument)
{
    static const char *const names[] = {
#define X(name, text) text,
        INSTRUMENTS(X)
#undef X
    };
    return (unsigned)instrument < INSTRUMENT_COUNT ? names[instrument] : "";
}

const char *instrument_state_name(enum instrument_state state)
{
    switch (state) {
#define X(name, text)                                                                              \
    case INSTRUMENT_IS_##name:                                                                     \
        return text;
        INSTRUMENT_STATES(X)
#undef X
    }
    return "";
}

#define FACE(kind, type)                                                                           \
    static void *kind##_open(const struct acquire_from *from, int64_t deadline_ns,                 \
                             struct error *err)                                                    \
    {                                                                                              \
        return from->kind->open(&from->kind##_options, deadline_ns, err);                          \
    }                                                                                              \
    static bool kind##_read(const struct acquire_from *from, void *device, int64_t deadline_ns,    \
                            void *sample, struct error *err)                                       \
    {                                                                                              \
        return from->kind->read(device, deadline_ns, sample, err);                                 \
    }                                                                                              \
    static void kind##_identify(const struct acquire_from *from, void *device,                     \
                                struct instrument_identity *out)                                   \
    {                                                                                              \
        from->kind->identify(device, out);                                                         \
    }                                                                                              \
    static void kind##_close(const struct acquire_from *from, void *device)                        \
    {                                                                                              \
        from->kind->close(device);                                                                 \
    }                                                                                              \
    static const struct interval *kind##_taken(const void *sample)                                 \
    {                                                                                              \
        return &((const type *)sample)->taken;                                                     \
    }                                                                                              \
    static struct face kind##_face(const struct acquire_from *from)                                \
    {                                                                                              \
        return (struct face){from->kind ? from->kind->name : NULL,                                 \
                             kind##_open,                                                          \
                             kind##_read,                                                          \
                             kind##_identify,                                                      \
                             kind##_close,                                                         \
                             kind##_patience,                                                      \
                             kind##_taken,                                                         \
                             kind##_note,                                                          \
                             kind##_doubts,                                                        \
                             sizeof(type)};                                                        \
    }

static int64_t spectrometer_patience(const void *sample)
{
    const struct spectrum_sample *s = sample;
    return NS_PER_S + 3 * NS_PER_US * s->integration_us * (s->averaged > 0 ? s->averaged : 1);
}

static int64_t accelerometer_patience(const void *sample)
{
    (void)sample;
    return NS_PER_S / 2;
}

static int64_t tracker_patience(const void *sample)
{
    (void)sample;
    return NS_PER_S / 2;
}

static const char *spectrometer_note(const void *sample)
{
    const struct spectrum_sample *s = sample;
    if (s->status == SPECTROMETER_GOOD && s->dark_missing)
        return "good, but no stored dark fits its exposure";
    return spectrometer_status_name(s->status);
}

static const char *accelerometer_note(const void *sample)
{
    return tilt_doubt_text(((const struct tilt_sample *)sample)->doubt);
}

static const char *tracker_note(const void *sample)
{
    return tracker_status_name(((const struct head_sample *)sample)->status);
}

static bool spectrometer_doubts(const void *sample)
{
    (void)sample; // lamps come and go
    return false;
}

// A stand that is turned shakes, but not for long.
static bool accelerometer_doubts(const void *sample)
{
    return ((const struct tilt_sample *)sample)->doubt != TILT_NONE;
}

static bool tracker_doubts(const void *sample)
{
    (void)sample; // so do observers
    return false;
}

FACE(spectrometer, struct spectrum_sample)
FACE(accelerometer, struct tilt_sample)
FACE(tracker, struct head_sample)

struct acquire_from acquire_from(const struct booth_settings *b)
{
    return (struct acquire_from){
        booth_spectrometer(b),    b->spectrometer.options, booth_accelerometer(b),
        b->accelerometer.options, booth_tracker(b),        b->tracker.options,
    };
}

// ---- what is known of it -------------------------------------------------------

static void change(struct polled *p, enum instrument_state state, const struct error *error)
{
    pthread_mutex_lock(&p->lock);
    bool changed = p->report.state != state;
    p->report.state = state;
    p->report.error = error ? *error : (struct error){0};
    struct instrument_report now = p->report;
    pthread_mutex_unlock(&p->lock);
    const char *name = instrument_name(p->instrument);
    if (!changed)
        return;
    if (state == INSTRUMENT_IS_RUNNING)
        log_line(LOG_LEVEL_NOTICE, "%s: running: %s %s%s", name, now.identity.model,
                 now.identity.serial, now.identity.emulated ? " (emulated)" : "");
    else
        log_line(LOG_LEVEL_WARNING, "%s: %s: %s", name, instrument_state_name(state),
                 error ? error->text : "no sample");
}

static void identified(struct polled *p)
{
    struct instrument_identity identity = {0};
    p->face.identify(&p->from, p->device, &identity);
    pthread_mutex_lock(&p->lock);
    p->report.identity = identity;
    pthread_mutex_unlock(&p->lock);
}

// One that was lost stays so until it gives a sample: else the log would tell of
// each try in which it can be opened and says nothing.
static void keep_silent(struct polled *p, const struct error *err)
{
    pthread_mutex_lock(&p->lock);
    enum instrument_state now = p->report.state;
    pthread_mutex_unlock(&p->lock);
    change(p, now == INSTRUMENT_IS_WAITING ? now : INSTRUMENT_IS_SILENT, err);
}

static void log_doubt(struct polled *p, int64_t now_ns)
{
    const char *name = instrument_name(p->instrument);
    struct doubt *d = &p->doubt;
    if (!p->face.doubts(&p->sample)) {
        if (d->told)
            log_line(LOG_LEVEL_NOTICE, "%s: its samples are good again", name);
        *d = (struct doubt){0};
        return;
    }
    if (!d->lasts)
        *d = (struct doubt){.lasts = true, .since_ns = now_ns};
    if (d->told || now_ns - d->since_ns <= SILENT_AFTER_NS)
        return;
    d->told = true;
    log_line(LOG_LEVEL_WARNING, "%s: its samples are passed over: %s", name,
             p->face.note(&p->sample));
}

static void deliver(struct polled *p, int64_t now_ns)
{
    mailbox_post(&p->box, &p->sample);
    pthread_mutex_lock(&p->lock);
    p->report.samples++;
    p->report.latest_ns = p->face.taken(&p->sample)->latest_ns;
    snprintf(p->report.note, sizeof p->report.note, "%s", p->face.note(&p->sample));
    pthread_mutex_unlock(&p->lock);
    change(p, INSTRUMENT_IS_RUNNING, NULL);
    log_doubt(p, now_ns);
}

static void note_overdue(struct polled *p, int64_t now_ns)
{
    int64_t late_ns = p->due_ns ? now_ns - p->due_ns : 0;
    if (late_ns > p->report.overdue_ns)
        p->report.overdue_ns = late_ns;
}

// From now_ns on the driver has until due_ns; 0 when it is back.
static void set_due(struct polled *p, int64_t due_ns, int64_t now_ns)
{
    pthread_mutex_lock(&p->lock);
    note_overdue(p, now_ns);
    p->due_ns = due_ns;
    pthread_mutex_unlock(&p->lock);
}

void polled_report(struct polled *p, int64_t now_ns, struct instrument_report *out)
{
    pthread_mutex_lock(&p->lock);
    note_overdue(p, now_ns);
    *out = p->report;
    pthread_mutex_unlock(&p->lock);
}

// ---- open, read, close ---------------------------------------------------------

void polled_close(struct polled *p)
{
    int64_t now_ns = clock_now_ns();
    if (!p->device)
        return;
    set_due(p, now_ns + CLOSE_WITHIN_NS, now_ns);
    p->face.close(&p->from, p->device);
    set_due(p, 0, clock_now_ns());
    p->device = NULL;
}

// Longer and longer while it is not there.
static int64_t lost(struct polled *p, const struct error *err)
{
    int64_t rest_ns = p->any ? FIRST_REST_NS : p->rest_ns;
    p->any = false;
    p->rest_ns = 2 * rest_ns < LONGEST_REST_NS ? 2 * rest_ns : LONGEST_REST_NS;
    polled_close(p);
    change(p, INSTRUMENT_IS_WAITING, err);
    return rest_ns;
}

static int64_t open_once(struct polled *p)
{
    struct error err = {0};
    int64_t now_ns = clock_now_ns(), deadline_ns = now_ns + OPEN_WITHIN_NS;
    set_due(p, deadline_ns, now_ns);
    p->device = p->face.open(&p->from, deadline_ns, &err);
    p->last_ns = clock_now_ns();
    set_due(p, 0, p->last_ns);
    if (!p->device)
        return lost(p, &err);
    identified(p);
    return 0;
}

static int64_t read_once(struct polled *p)
{
    struct error err = {0};
    int64_t now_ns = clock_now_ns(), deadline_ns = now_ns + p->face.patience_ns(&p->sample);
    set_due(p, deadline_ns, now_ns);
    bool good = p->face.read(&p->from, p->device, deadline_ns, &p->sample, &err);
    now_ns = clock_now_ns();
    set_due(p, 0, now_ns);
    if (good) {
        deliver(p, now_ns);
        p->any = true;
        p->last_ns = now_ns;
        return 0;
    }
    int64_t silent_ns = now_ns - p->last_ns;
    if (err.code != ERROR_RETRY || silent_ns > REOPEN_AFTER_NS)
        return lost(p, &err);
    if (silent_ns > SILENT_AFTER_NS)
        keep_silent(p, &err);
    return REFUSED_REST_NS;
}

// ---- series of raw readings ----------------------------------------------------

static void answer_series(struct polled *p, const struct error *err)
{
    struct series_desk *d = &p->desk;
    pthread_mutex_lock(&d->lock);
    d->answered = p->number;
    d->err = *err;
    if (p->series)
        d->done = *p->series;
    pthread_mutex_unlock(&d->lock);
    free(p->series);
    p->series = NULL;
}

// Whether a series is to be worked on.
static bool begin_series(struct polled *p)
{
    struct series_desk *d = &p->desk;
    struct error err = {0};
    if (p->series)
        return true;
    pthread_mutex_lock(&d->lock);
    bool asked = d->asked != d->begun;
    d->begun = p->number = d->asked;
    p->wanted = d->wanted;
    pthread_mutex_unlock(&d->lock);
    p->series = asked ? calloc(1, sizeof *p->series) : NULL;
    if (asked && !p->series) {
        fail(&err, ERROR_SYSTEM, "no memory for a series");
        answer_series(p, &err);
    }
    return p->series;
}

// Readings that were exposed before the request do not count.
static bool take_counts(struct polled *p, int64_t now_ns, struct error *err)
{
    const struct spectrometer_driver *driver = p->from.spectrometer;
    const struct series_wanted *wanted = &p->wanted;
    struct spectrum_counts counts;
    if (!driver->counts)
        return fail(err, ERROR_CONFIG, "the driver %s has no raw counts", driver->name);
    if (now_ns >= wanted->deadline_ns)
        return fail(err, ERROR_RETRY, "time is up");
    set_due(p, wanted->deadline_ns, now_ns);
    bool good =
        driver->counts(p->device, wanted->integration_us, wanted->deadline_ns, &counts, err);
    set_due(p, 0, clock_now_ns());
    if (!good)
        return false;
    return counts.taken.earliest_ns < wanted->asked_ns || series_add(p->series, &counts, err);
}

static int64_t count_once(struct polled *p)
{
    struct error err = {0};
    int64_t before_ns = clock_now_ns();
    bool fine = take_counts(p, before_ns, &err) ||
                while_doing(&err, "reading %d of %d", p->series->readings + 1, p->wanted.readings);
    p->last_ns += clock_now_ns() - before_ns; // no sample was due meanwhile
    if (!fine || p->series->readings >= p->wanted.readings)
        answer_series(p, &err);
    return err.code == ERROR_GONE ? lost(p, &err) : 0;
}

uint64_t polled_ask_series(struct polled *p, const struct series_wanted *wanted)
{
    struct series_desk *d = &p->desk;
    pthread_mutex_lock(&d->lock);
    d->wanted = *wanted;
    uint64_t number = ++d->asked;
    pthread_mutex_unlock(&d->lock);
    return number;
}

bool polled_series(struct polled *p, uint64_t number, struct series *out, struct error *err)
{
    struct series_desk *d = &p->desk;
    pthread_mutex_lock(&d->lock);
    bool answered = d->answered == number;
    if (answered) {
        *err = d->err;
        *out = d->done;
    }
    pthread_mutex_unlock(&d->lock);
    return answered;
}

// ---- turns ---------------------------------------------------------------------

int64_t polled_turn(struct polled *p)
{
    return !p->device ? open_once(p) : begin_series(p) ? count_once(p) : read_once(p);
}

static struct face face_of(const struct acquire_from *from, enum instrument instrument)
{
    return instrument == INSTRUMENT_SPECTROMETER    ? spectrometer_face(from)
           : instrument == INSTRUMENT_ACCELEROMETER ? accelerometer_face(from)
                                                    : tracker_face(from);
}

struct polled *polled_create(const struct acquire_from *from, enum instrument instrument,
                             struct error *err)
{
    struct face face = face_of(from, instrument);
    struct polled *p = calloc(1, sizeof *p);
    if (!p || !mailbox_init(&p->box, face.size)) {
        free(p);
        fail(err, ERROR_SYSTEM, "no memory for the %s", instrument_name(instrument));
        return NULL;
    }
    p->from = *from;
    p->instrument = instrument;
    p->face = face;
    p->rest_ns = FIRST_REST_NS;
    pthread_mutex_init(&p->lock, NULL);
    pthread_mutex_init(&p->desk.lock, NULL);
    if (p->face.driver) {
        snprintf(p->report.driver, sizeof p->report.driver, "%s", p->face.driver);
        p->report.state = INSTRUMENT_IS_SILENT;
        fail(&p->report.error, ERROR_RETRY, "being opened");
    }
    return p;
}

void polled_destroy(struct polled *p)
{
    if (!p)
        return;
    polled_close(p);
    mailbox_fini(&p->box);
    pthread_mutex_destroy(&p->lock);
    pthread_mutex_destroy(&p->desk.lock);
    free(p->series);
    free(p);
}

uint64_t polled_latest(struct polled *p, void *sample)
{
    return mailbox_read(&p->box, sample);
}
