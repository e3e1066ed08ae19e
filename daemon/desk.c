// SPDX-License-Identifier: Apache-2.0
#include "daemon/desk.h"

#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"

static const int LOOK_EVERY_MS = 100;
static const int64_t SAMPLE_POLL_NS = 5 * NS_PER_MS; // well below any exposure
static const int64_t GRACE_NS = 5 * NS_PER_S;        // for a driver that ends at its deadline
static const int64_t OPEN_WITHIN_NS = 10 * NS_PER_S; // a PR-655 wakes up slowly

struct desk {
    const struct radiometer_driver *driver;
    struct radiometer_options options;
    struct radiometer *device;
    struct acquire *instruments;
    struct jobs *jobs;
    pthread_t thread;
    bool started;
    pthread_mutex_t lock; // of stop and report
    bool stop;
    struct instrument_report report;
};

static bool stopping(struct desk *d)
{
    pthread_mutex_lock(&d->lock);
    bool stop = d->stop;
    pthread_mutex_unlock(&d->lock);
    return stop;
}

static void report(struct desk *d, enum instrument_state state, const struct error *error)
{
    pthread_mutex_lock(&d->lock);
    bool changed = d->report.state != state;
    d->report.state = state;
    d->report.error = error ? *error : (struct error){0};
    pthread_mutex_unlock(&d->lock);
    if (changed && error)
        log_line(LOG_LEVEL_WARNING, "radiometer: %s: %s", instrument_state_name(state),
                 error->text);
    else if (changed && state == INSTRUMENT_IS_RUNNING)
        log_line(LOG_LEVEL_NOTICE, "radiometer: open: %s %s%s", d->report.identity.model,
                 d->report.identity.serial, d->report.identity.emulated ? " (emulated)" : "");
}

static bool radiometer_there(struct desk *d, int64_t deadline_ns, struct error *err)
{
    if (!d->driver)
        return fail(err, ERROR_CONFIG, "the settings name no radiometer");
    if (d->device)
        return true;
    int64_t within_ns = clock_now_ns() + OPEN_WITHIN_NS;
    d->device =
        d->driver->open(&d->options, within_ns < deadline_ns ? within_ns : deadline_ns, err);
    if (!d->device) {
        report(d, INSTRUMENT_IS_WAITING, err);
        return false;
    }
    struct instrument_identity identity = {0};
    d->driver->identify(d->device, &identity);
    pthread_mutex_lock(&d->lock);
    d->report.identity = identity;
    pthread_mutex_unlock(&d->lock);
    report(d, INSTRUMENT_IS_RUNNING, NULL);
    return true;
}

static bool read_radiance(struct desk *d, int64_t deadline_ns, struct radiance_sample *sample,
                          struct error *err)
{
    if (!radiometer_there(d, deadline_ns, err))
        return false;
    if (d->driver->read(d->device, deadline_ns, sample, err)) {
        pthread_mutex_lock(&d->lock);
        d->report.samples++;
        d->report.latest_ns = sample->taken.latest_ns;
        pthread_mutex_unlock(&d->lock);
        report(d, INSTRUMENT_IS_RUNNING, NULL);
        return true;
    }
    bool lost = err->code == ERROR_GONE || err->code == ERROR_SYSTEM;
    if (lost) {
        d->driver->close(d->device);
        d->device = NULL;
    }
    report(d, lost ? INSTRUMENT_IS_WAITING : INSTRUMENT_IS_RUNNING, err);
    return false;
}

static json_t *numbers(const double *values, int count)
{
    json_t *array = json_array();
    for (int i = 0; i < count; i++)
        json_array_append_new(array, json_real(values[i]));
    return array;
}

static void add_identity(json_t *reply, const struct instrument_identity *identity)
{
    char now[21];
    clock_utc(now);
    json_object_set_new(reply, "instrument", json_string(identity->model));
    json_object_set_new(reply, "serial", json_string(identity->serial));
    json_object_set_new(reply, "emulated", json_boolean(identity->emulated));
    json_object_set_new(reply, "taken_at", json_string(now));
}

static void measure(struct desk *d, struct job *job)
{
    struct radiance_sample sample;
    int64_t begun_ns = clock_now_ns();
    int64_t deadline_ns = begun_ns + (int64_t)(job->timeout_s * NS_PER_S);
    if (!read_radiance(d, deadline_ns, &sample, &job->err))
        return;
    json_t *nm = json_array();
    for (int i = 0; i < sample.count; i++)
        json_array_append_new(nm, json_real(sample.first_nm + i * sample.step_nm));
    job->reply = json_pack("{s:[f,f,f], s:o, s:o, s:f}", "XYZ", sample.xyz.X, sample.xyz.Y,
                           sample.xyz.Z, "nm", nm, "values", numbers(sample.raw, sample.count),
                           "seconds", (double)(clock_now_ns() - begun_ns) / NS_PER_S);
    add_identity(job->reply, &d->report.identity);
}

void teach_average(const struct spectrum *readings, int count, struct spectrum *mean,
                   double *spread)
{
    double off = 0, all = 0;
    *mean = (struct spectrum){{0}};
    for (int k = 0; k < SPECTRUM_COUNT; k++) {
        for (int i = 0; i < count; i++)
            mean->v[k] += readings[i].v[k] / count;
        for (int i = 0; i < count; i++)
            off += pow(readings[i].v[k] - mean->v[k], 2) / count;
        all += mean->v[k] * mean->v[k];
    }
    *spread = all > 0 ? sqrt(off / all) : 0;
}

// ---- teaching ------------------------------------------------------------------

void teach_sigma(const struct spectrum *sigmas, int count, struct spectrum *sigma)
{
    for (int k = 0; k < SPECTRUM_COUNT; k++) {
        double squares = 0;
        for (int i = 0; i < count; i++)
            squares += sigmas[i].v[k] * sigmas[i].v[k];
        sigma->v[k] = sqrt(squares / count);
    }
}

// Good readings that began after this call, and behind all of them their sigmas.
static bool gather(struct desk *d, const struct job *job, struct spectrum *readings,
                   struct error *err)
{
    struct samples *seen = calloc(1, sizeof *seen);
    if (!seen)
        return fail(err, ERROR_SYSTEM, "no memory for readings");
    int64_t begun_ns = clock_now_ns(), now_ns;
    int64_t deadline_ns = begun_ns + (int64_t)(job->timeout_s * NS_PER_S);
    uint64_t last = 0;
    int count = 0;
    while (count < job->readings && (now_ns = clock_now_ns()) < deadline_ns && !stopping(d)) {
        acquire_latest(d->instruments, seen);
        bool another = seen->spectrum_number != last;
        last = seen->spectrum_number;
        if (another && seen->spectrum.taken.earliest_ns >= begun_ns &&
            seen->spectrum.status == SPECTROMETER_GOOD) {
            readings[job->readings + count] = seen->spectrum.sigma;
            readings[count++] = seen->spectrum.irradiance;
        } else
            clock_sleep_until_ns(now_ns + SAMPLE_POLL_NS);
    }
    free(seen);
    return count == job->readings ||
           fail(err, ERROR_RETRY, "the spectrometer gave %d of %d good readings within %g s", count,
                job->readings, job->timeout_s);
}

static void teach(struct desk *d, struct job *job)
{
    struct instrument_report from;
    struct spectrum mean, sigma, *readings = calloc(2 * (size_t)job->readings, sizeof *readings);
    double spread;
    acquire_report(d->instruments, INSTRUMENT_SPECTROMETER, &from);
    if (!readings)
        fail(&job->err, ERROR_SYSTEM, "no memory for readings");
    else if (from.state == INSTRUMENT_IS_NONE)
        fail(&job->err, ERROR_CONFIG, "the settings name no spectrometer");
    else if (gather(d, job, readings, &job->err)) {
        teach_average(readings, job->readings, &mean, &spread);
        teach_sigma(readings + job->readings, job->readings, &sigma);
        json_t *nm = json_array();
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            json_array_append_new(nm, json_integer(SPECTRUM_FIRST_NM + i));
        job->reply =
            json_pack("{s:s, s:i, s:o, s:o, s:o, s:f, s:f}", "lamp", job->name, "readings",
                      job->readings, "nm", nm, "irradiance", numbers(mean.v, SPECTRUM_COUNT),
                      "sigma", numbers(sigma.v, SPECTRUM_COUNT), "spread", spread, "lux",
                      xyz_absolute(&mean, OBSERVER_1931_2).Y);
        add_identity(job->reply, &from.identity);
    }
    free(readings);
}

// ---- raw counts ----------------------------------------------------------------

// False when the time is up, or when nobody would answer.
static bool await_series(struct desk *d, const struct job *job, struct series *out,
                         struct error *err)
{
    int64_t now_ns = clock_now_ns();
    const struct series_wanted wanted = {job->integration_us, job->readings, now_ns,
                                         now_ns + (int64_t)(job->timeout_s * NS_PER_S)};
    uint64_t number = acquire_ask_series(d->instruments, &wanted);
    while (!acquire_series(d->instruments, number, out, err)) {
        if (clock_now_ns() > wanted.deadline_ns + GRACE_NS || stopping(d))
            return fail(err, ERROR_RETRY, "the spectrometer did not answer within %g s",
                        job->timeout_s);
        clock_sleep_until_ns(clock_now_ns() + SAMPLE_POLL_NS);
    }
    return err->code == ERROR_NONE;
}

static json_t *range_json(const struct pixel_range *r)
{
    return json_pack("[i,i]", r->first, r->last);
}

static json_t *series_json(const struct series *s)
{
    const struct detector *r = &s->detector;
    json_t *black = json_array();
    for (int i = 0; i < DETECTOR_BLACK_RANGES; i++)
        if (r->black[i].last >= r->black[i].first)
            json_array_append_new(black, range_json(&r->black[i]));
    return json_pack(
        "{s:i, s:i, s:i, s:o, s:o, s:o, s:o, s:o, s:o, s:f, s:f, s:o, s:o, s:o}", "integration_us",
        s->integration_us, "readings", s->readings, "saturated", s->saturated, "counts",
        numbers(s->mean, r->pixels), "deviation", numbers(s->deviation, r->pixels), "active_means",
        numbers(s->active, s->readings), "black_means", numbers(s->black, s->readings), "active",
        range_json(&r->active), "black", black, "saturation", r->saturation, "full_counts",
        r->full_counts, "nonlinearity", numbers(r->nonlinearity, r->order + 1), "wavelength_nm",
        numbers(r->wavelength, 4), "own_wavelength_nm", numbers(r->own_wavelength, 4));
}

static void raw(struct desk *d, struct job *job)
{
    struct instrument_report from;
    struct series *series = calloc(1, sizeof *series);
    acquire_report(d->instruments, INSTRUMENT_SPECTROMETER, &from);
    if (!series)
        fail(&job->err, ERROR_SYSTEM, "no memory for raw counts");
    else if (from.state == INSTRUMENT_IS_NONE)
        fail(&job->err, ERROR_CONFIG, "the settings name no spectrometer");
    else if (from.state == INSTRUMENT_IS_WAITING)
        fail(&job->err, ERROR_GONE, "the spectrometer is not there: %s", from.error.text);
    else if (await_series(d, job, series, &job->err)) {
        job->reply = series_json(series);
        add_identity(job->reply, &from.identity);
    }
    free(series);
}

void desk_do(struct desk *d, struct job *job)
{
    switch (job->kind) {
    case JOB_MEASURE:
        measure(d, job);
        return;
    case JOB_TEACH:
        teach(d, job);
        return;
    case JOB_RAW:
        raw(d, job);
        return;
    case JOB_SHOW:
    case JOB_PATCH:
    case JOB_CAPTURE:
    case JOB_PROBE:
    case JOB_RELOAD:
    case JOB_QUIT:
        fail(&job->err, ERROR_RANGE, "not the desk's");
        return;
    }
}

static void *work(void *argument)
{
    struct desk *d = argument;
    struct pollfd waiting = {jobs_fd(d->jobs), POLLIN, 0};
    while (!stopping(d)) {
        struct job job;
        poll(&waiting, 1, LOOK_EVERY_MS);
        if (!jobs_take(d->jobs, &job))
            continue;
        desk_do(d, &job);
        jobs_finish(d->jobs, &job);
    }
    return NULL;
}

static void free_desk(struct desk *d)
{
    if (d->device)
        d->driver->close(d->device);
    jobs_destroy(d->jobs);
    pthread_mutex_destroy(&d->lock);
    free(d);
}

struct desk *desk_create(const struct booth_settings *settings, struct acquire *instruments,
                         struct error *err)
{
    struct desk *d = calloc(1, sizeof *d);
    if (!d) {
        fail(err, ERROR_SYSTEM, "no memory for measuring");
        return NULL;
    }
    pthread_mutex_init(&d->lock, NULL);
    d->driver = booth_radiometer(settings);
    d->options = settings->radiometer.options;
    d->instruments = instruments;
    d->report.state = d->driver ? INSTRUMENT_IS_IDLE : INSTRUMENT_IS_NONE;
    if (d->driver)
        snprintf(d->report.driver, sizeof d->report.driver, "%s", d->driver->name);
    d->jobs = jobs_create(err);
    if (d->jobs)
        return d;
    free_desk(d);
    return NULL;
}

struct desk *desk_open(const struct booth_settings *settings, struct acquire *instruments,
                       struct error *err)
{
    struct desk *d = desk_create(settings, instruments, err);
    if (!d)
        return NULL;
    d->started = !pthread_create(&d->thread, NULL, work, d);
    if (d->started)
        return d;
    fail(err, ERROR_SYSTEM, "no thread for measuring");
    free_desk(d);
    return NULL;
}

bool desk_close(struct desk *d, int64_t deadline_ns)
{
    if (!d)
        return true;
    struct timespec until = {deadline_ns / NS_PER_S, deadline_ns % NS_PER_S};
    pthread_mutex_lock(&d->lock);
    d->stop = true;
    pthread_mutex_unlock(&d->lock);
    if (d->started && pthread_clockjoin_np(d->thread, NULL, CLOCK_MONOTONIC, &until))
        return false;
    free_desk(d);
    return true;
}

struct jobs *desk_jobs(struct desk *d)
{
    return d->jobs;
}

void desk_report(struct desk *d, struct instrument_report *out)
{
    pthread_mutex_lock(&d->lock);
    *out = d->report;
    pthread_mutex_unlock(&d->lock);
}
