// SPDX-License-Identifier: Apache-2.0
#include "daemon/acquire.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"

#define POLLED INSTRUMENT_RADIOMETER // those before it are polled

static const int64_t OPEN_WITHIN_NS = 3 * NS_PER_S;
static const int64_t CLOSE_WITHIN_NS = NS_PER_S;
static const int64_t FIRST_REST_NS = 200 * NS_PER_MS;
static const int64_t LONGEST_REST_NS = NS_PER_S;      // who comes back is to run within 2 s
static const int64_t SILENT_AFTER_NS = 5 * NS_PER_S;  // without a sample it is reported
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

struct worker {
    struct acquire *all;
    enum instrument instrument;
    struct face face;
    pthread_t thread;
    bool started;
    struct mailbox box;
    pthread_mutex_t lock; // of report and due_ns
    struct instrument_report report;
    int64_t due_ns; // deadline of the call that the driver is in, 0 = in none
    struct doubt doubt;
    union any_sample sample;
};

// A request for a series and its answer, between two threads.
struct series_desk {
    pthread_mutex_t lock;
    uint64_t asked, begun, answered; // numbers of requests
    struct series_wanted wanted;
    struct series done;
    struct error err;
};

struct acquire {
    struct acquire_from from;
    struct worker workers[POLLED];
    struct series_desk series;
    pthread_mutex_t lock;
    pthread_cond_t wake;
    bool stop; // under lock
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

// True when the rest was cut short because all is to stop.
static bool rest(struct acquire *a, int64_t ns)
{
    int64_t until_ns = clock_now_ns() + ns;
    struct timespec until = {until_ns / NS_PER_S, until_ns % NS_PER_S};
    pthread_mutex_lock(&a->lock);
    while (!a->stop && ns > 0 && clock_now_ns() < until_ns)
        pthread_cond_timedwait(&a->wake, &a->lock, &until);
    bool stop = a->stop;
    pthread_mutex_unlock(&a->lock);
    return stop;
}

static bool stopping(struct acquire *a)
{
    return rest(a, 0);
}

static void change(struct worker *w, enum instrument_state state, const struct error *error)
{
    pthread_mutex_lock(&w->lock);
    bool changed = w->report.state != state;
    w->report.state = state;
    w->report.error = error ? *error : (struct error){0};
    struct instrument_report now = w->report;
    pthread_mutex_unlock(&w->lock);
    const char *name = instrument_name(w->instrument);
    if (!changed)
        return;
    if (state == INSTRUMENT_IS_RUNNING)
        log_line(LOG_LEVEL_NOTICE, "%s: running: %s %s%s", name, now.identity.model,
                 now.identity.serial, now.identity.emulated ? " (emulated)" : "");
    else
        log_line(LOG_LEVEL_WARNING, "%s: %s: %s", name, instrument_state_name(state),
                 error ? error->text : "no sample");
}

static void identified(struct worker *w, void *device)
{
    struct instrument_identity identity = {0};
    w->face.identify(&w->all->from, device, &identity);
    pthread_mutex_lock(&w->lock);
    w->report.identity = identity;
    pthread_mutex_unlock(&w->lock);
}

enum doubt_news doubt_step(struct doubt *d, bool doubts, int64_t now_ns)
{
    if (!doubts) {
        enum doubt_news news = d->told ? DOUBT_OVER : DOUBT_NO_NEWS;
        *d = (struct doubt){0};
        return news;
    }
    if (!d->lasts)
        *d = (struct doubt){.lasts = true, .since_ns = now_ns};
    if (d->told || now_ns - d->since_ns <= SILENT_AFTER_NS)
        return DOUBT_NO_NEWS;
    d->told = true;
    return DOUBT_LASTS;
}

static void log_doubt(struct worker *w)
{
    const char *name = instrument_name(w->instrument);
    switch (doubt_step(&w->doubt, w->face.doubts(&w->sample), clock_now_ns())) {
    case DOUBT_NO_NEWS:
        return;
    case DOUBT_LASTS:
        log_line(LOG_LEVEL_WARNING, "%s: its samples are passed over: %s", name,
                 w->face.note(&w->sample));
        return;
    case DOUBT_OVER:
        log_line(LOG_LEVEL_NOTICE, "%s: its samples are good again", name);
        return;
    }
}

static void deliver(struct worker *w)
{
    mailbox_post(&w->box, &w->sample);
    pthread_mutex_lock(&w->lock);
    w->report.samples++;
    w->report.latest_ns = w->face.taken(&w->sample)->latest_ns;
    snprintf(w->report.note, sizeof w->report.note, "%s", w->face.note(&w->sample));
    pthread_mutex_unlock(&w->lock);
    change(w, INSTRUMENT_IS_RUNNING, NULL);
    log_doubt(w);
}

static void note_overdue(struct worker *w)
{
    int64_t late_ns = w->due_ns ? clock_now_ns() - w->due_ns : 0;
    if (late_ns > w->report.overdue_ns)
        w->report.overdue_ns = late_ns;
}

// From now on the driver has until due_ns; 0 when it is back.
static void set_due(struct worker *w, int64_t due_ns)
{
    pthread_mutex_lock(&w->lock);
    note_overdue(w);
    w->due_ns = due_ns;
    pthread_mutex_unlock(&w->lock);
}

static void *open_by(struct worker *w, int64_t deadline_ns, struct error *err)
{
    set_due(w, deadline_ns);
    void *device = w->face.open(&w->all->from, deadline_ns, err);
    set_due(w, 0);
    return device;
}

static bool read_by(struct worker *w, void *device, int64_t deadline_ns, struct error *err)
{
    set_due(w, deadline_ns);
    bool good = w->face.read(&w->all->from, device, deadline_ns, &w->sample, err);
    set_due(w, 0);
    return good;
}

// One that was lost stays so until it gives a sample: else the log would tell of
// each try in which it can be opened and says nothing.
static void keep_silent(struct worker *w, const struct error *err)
{
    pthread_mutex_lock(&w->lock);
    enum instrument_state now = w->report.state;
    pthread_mutex_unlock(&w->lock);
    change(w, now == INSTRUMENT_IS_WAITING ? now : INSTRUMENT_IS_SILENT, err);
}

// ---- series of raw readings ----------------------------------------------------

static bool series_asked(struct acquire *a, struct series_wanted *out, uint64_t *number)
{
    struct series_desk *d = &a->series;
    pthread_mutex_lock(&d->lock);
    bool asked = d->asked != d->begun;
    d->begun = *number = d->asked;
    *out = d->wanted;
    pthread_mutex_unlock(&d->lock);
    return asked;
}

static void answer_series(struct acquire *a, uint64_t number, const struct series *done,
                          const struct error *err)
{
    struct series_desk *d = &a->series;
    pthread_mutex_lock(&d->lock);
    d->answered = number;
    d->err = *err;
    if (done)
        d->done = *done;
    pthread_mutex_unlock(&d->lock);
}

// One reading that counts; those exposed before the request do not.
static bool take_counts(struct worker *w, void *device, const struct series_wanted *wanted,
                        struct spectrum_counts *out, struct error *err)
{
    const struct spectrometer_driver *driver = w->all->from.spectrometer;
    if (!driver->counts)
        return fail(err, ERROR_CONFIG, "the driver %s has no raw counts", driver->name);
    while (!stopping(w->all) && clock_now_ns() < wanted->deadline_ns) {
        set_due(w, wanted->deadline_ns);
        bool good = driver->counts(device, wanted->integration_us, wanted->deadline_ns, out, err);
        set_due(w, 0);
        if (!good)
            return false;
        if (out->taken.earliest_ns >= wanted->asked_ns)
            return true;
    }
    return fail(err, ERROR_RETRY, "time is up");
}

// False when the instrument is lost.
static bool work_on_series(struct worker *w, void *device, struct error *err)
{
    struct series_wanted wanted;
    uint64_t number;
    if (w->instrument != INSTRUMENT_SPECTROMETER || !series_asked(w->all, &wanted, &number))
        return true;
    struct series *done = calloc(1, sizeof *done);
    struct spectrum_counts counts;
    struct error why = {0};
    bool fine = done || fail(&why, ERROR_SYSTEM, "no memory for a series");
    while (fine && done->readings < wanted.readings)
        fine =
            (take_counts(w, device, &wanted, &counts, &why) && series_add(done, &counts, &why)) ||
            while_doing(&why, "reading %d of %d", done->readings + 1, wanted.readings);
    answer_series(w->all, number, done, &why);
    free(done);
    if (why.code == ERROR_GONE)
        *err = why;
    return why.code != ERROR_GONE;
}

uint64_t acquire_ask_series(struct acquire *a, const struct series_wanted *wanted)
{
    struct series_desk *d = &a->series;
    pthread_mutex_lock(&d->lock);
    d->wanted = *wanted;
    uint64_t number = ++d->asked;
    pthread_mutex_unlock(&d->lock);
    return number;
}

bool acquire_series(struct acquire *a, uint64_t number, struct series *out, struct error *err)
{
    struct series_desk *d = &a->series;
    pthread_mutex_lock(&d->lock);
    bool answered = d->answered == number;
    if (answered) {
        *err = d->err;
        *out = d->done;
    }
    pthread_mutex_unlock(&d->lock);
    return answered;
}

// Reads until the instrument is lost or all stops. True when it gave samples.
static bool read_on(struct worker *w, void *device, struct error *err)
{
    bool any = false;
    int64_t last_ns = clock_now_ns();
    while (!stopping(w->all)) {
        int64_t before_ns = clock_now_ns();
        if (!work_on_series(w, device, err))
            return any;
        int64_t now_ns = clock_now_ns();
        last_ns += now_ns - before_ns; // no sample was due meanwhile
        int64_t patience_ns = w->face.patience_ns(&w->sample);
        if (read_by(w, device, now_ns + patience_ns, err)) {
            deliver(w);
            any = true;
            last_ns = clock_now_ns();
            continue;
        }
        now_ns = clock_now_ns();
        if (err->code != ERROR_RETRY || now_ns - last_ns > REOPEN_AFTER_NS)
            return any;
        if (now_ns - last_ns > SILENT_AFTER_NS)
            keep_silent(w, err);
        if (rest(w->all, 5 * NS_PER_MS)) // a driver may refuse at once
            break;
    }
    return any;
}

static void *work(void *argument)
{
    struct worker *w = argument;
    int64_t rest_ns = FIRST_REST_NS;
    while (!stopping(w->all)) {
        struct error err = {0};
        void *device = open_by(w, clock_now_ns() + OPEN_WITHIN_NS, &err);
        if (device) {
            identified(w, device);
            if (read_on(w, device, &err))
                rest_ns = FIRST_REST_NS;
            set_due(w, clock_now_ns() + CLOSE_WITHIN_NS);
            w->face.close(&w->all->from, device);
            set_due(w, 0);
        }
        if (stopping(w->all))
            break;
        change(w, INSTRUMENT_IS_WAITING, &err);
        rest(w->all, rest_ns);
        rest_ns = 2 * rest_ns < LONGEST_REST_NS ? 2 * rest_ns : LONGEST_REST_NS;
    }
    return NULL;
}

static bool start(struct acquire *a, enum instrument instrument, struct face face,
                  struct error *err)
{
    struct worker *w = &a->workers[instrument];
    w->all = a;
    w->instrument = instrument;
    w->face = face;
    pthread_mutex_init(&w->lock, NULL);
    if (!mailbox_init(&w->box, face.size))
        return fail(err, ERROR_SYSTEM, "no memory for samples");
    if (!face.driver)
        return true;
    snprintf(w->report.driver, sizeof w->report.driver, "%s", face.driver);
    w->report.state = INSTRUMENT_IS_SILENT;
    fail(&w->report.error, ERROR_RETRY, "being opened");
    w->started = !pthread_create(&w->thread, NULL, work, w);
    return w->started ||
           fail(err, ERROR_SYSTEM, "no thread for the %s", instrument_name(instrument));
}

struct acquire *acquire_start(const struct acquire_from *from, struct error *err)
{
    struct acquire *a = calloc(1, sizeof *a);
    if (!a) {
        fail(err, ERROR_SYSTEM, "no memory for the instruments");
        return NULL;
    }
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(&a->wake, &monotonic);
    pthread_condattr_destroy(&monotonic);
    pthread_mutex_init(&a->lock, NULL);
    pthread_mutex_init(&a->series.lock, NULL);
    a->from = *from;
    if (start(a, INSTRUMENT_SPECTROMETER, spectrometer_face(from), err) &&
        start(a, INSTRUMENT_ACCELEROMETER, accelerometer_face(from), err) &&
        start(a, INSTRUMENT_TRACKER, tracker_face(from), err))
        return a;
    acquire_stop(a, INT64_MAX);
    return NULL;
}

static bool join(struct worker *w, int64_t deadline_ns)
{
    struct timespec until = {deadline_ns / NS_PER_S, deadline_ns % NS_PER_S};
    if (w->started && pthread_clockjoin_np(w->thread, NULL, CLOCK_MONOTONIC, &until))
        return false;
    w->started = false;
    return true;
}

bool acquire_stop(struct acquire *a, int64_t deadline_ns)
{
    if (!a)
        return true;
    pthread_mutex_lock(&a->lock);
    a->stop = true;
    pthread_cond_broadcast(&a->wake);
    pthread_mutex_unlock(&a->lock);
    bool all = true;
    for (int i = 0; i < POLLED; i++)
        all = join(&a->workers[i], deadline_ns) && all;
    if (!all)
        return false;
    for (int i = 0; i < POLLED; i++) {
        mailbox_fini(&a->workers[i].box);
        pthread_mutex_destroy(&a->workers[i].lock);
    }
    pthread_mutex_destroy(&a->lock);
    pthread_mutex_destroy(&a->series.lock);
    pthread_cond_destroy(&a->wake);
    free(a);
    return true;
}

void acquire_latest(struct acquire *a, struct samples *out)
{
    struct worker *w = a->workers;
    out->spectrum_number = mailbox_read(&w[INSTRUMENT_SPECTROMETER].box, &out->spectrum);
    out->tilt_number = mailbox_read(&w[INSTRUMENT_ACCELEROMETER].box, &out->tilt);
    out->head_number = mailbox_read(&w[INSTRUMENT_TRACKER].box, &out->head);
}

void acquire_report(struct acquire *a, enum instrument instrument, struct instrument_report *out)
{
    *out = (struct instrument_report){0};
    if (instrument >= POLLED)
        return;
    struct worker *w = &a->workers[instrument];
    pthread_mutex_lock(&w->lock);
    note_overdue(w);
    *out = w->report;
    pthread_mutex_unlock(&w->lock);
}
