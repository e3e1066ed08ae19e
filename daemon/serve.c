// SPDX-License-Identifier: Apache-2.0
#include "daemon/serve.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/log.h"

static const int IDLE_MS = 100, BUSY_MS = 3; // how soon a stop or a finished job is seen

struct serve {
    struct control_server *server;
    struct serve_with with;
    struct snapshot snapshot; // of the control thread
    int open;                 // jobs passed on and not yet answered
    pthread_t thread;
    pthread_mutex_t lock; // of stop and ended
    bool stop, ended;
};

static bool stopping(struct serve *s)
{
    pthread_mutex_lock(&s->lock);
    bool stop = s->stop;
    pthread_mutex_unlock(&s->lock);
    return stop;
}

static json_t *status(struct serve *s)
{
    struct instruments_report reports;
    for (int i = 0; i < INSTRUMENT_RADIOMETER; i++)
        acquire_report(s->with.instruments, i, &reports.of[i]);
    desk_report(s->with.desk, &reports.of[INSTRUMENT_RADIOMETER]);
    mailbox_read(s->with.snapshots, &s->snapshot);
    return status_json(&s->snapshot, &reports, s->with.since, clock_now_ns());
}

static json_t *handle(void *context, const char *what, json_t *request, struct error *err)
{
    struct serve *s = context;
    struct job job;
    if (!strcmp(what, CONTROL_STATUS))
        return status(s);
    if (!command_parse(what, request, &job, err))
        return NULL;
    struct jobs *jobs = command_is_for_desk(job.kind) ? desk_jobs(s->with.desk) : s->with.main_jobs;
    job.ticket = control_later(s->server);
    if (!jobs_post(jobs, &job, err))
        control_answer(s->server, job.ticket, NULL, err);
    else
        s->open++;
    return NULL;
}

static void answer_finished(struct serve *s, struct jobs *jobs)
{
    struct job job;
    while (jobs_finished(jobs, &job)) {
        struct error err = {0};
        mailbox_read(s->with.snapshots, &s->snapshot);
        json_t *reply = command_reply(&job, &s->snapshot, &err);
        control_answer(s->server, job.ticket, reply, &err);
        job_fini(&job);
        s->open--;
    }
}

static void *work(void *argument)
{
    struct serve *s = argument;
    struct error err = {0};
    bool fine = true;
    while (fine && !stopping(s)) {
        fine = control_serve(s->server, s->open ? BUSY_MS : IDLE_MS, handle, s, &err);
        answer_finished(s, s->with.main_jobs);
        answer_finished(s, desk_jobs(s->with.desk));
    }
    if (fine)
        return NULL;
    log_line(LOG_LEVEL_ERROR, "control socket: %s", err.text);
    pthread_mutex_lock(&s->lock);
    s->ended = true;
    pthread_mutex_unlock(&s->lock);
    return NULL;
}

bool serve_ended(struct serve *s)
{
    pthread_mutex_lock(&s->lock);
    bool ended = s->ended;
    pthread_mutex_unlock(&s->lock);
    return ended;
}

// What nobody will work on any more.
static void refuse_waiting(struct jobs *jobs)
{
    struct job job;
    while (jobs_take(jobs, &job)) {
        fail(&job.err, ERROR_GONE, "boothd is stopping");
        jobs_finish(jobs, &job);
    }
}

struct serve *serve_start(const char *path, const struct serve_with *with, struct error *err)
{
    struct serve *s = calloc(1, sizeof *s);
    if (!s) {
        fail(err, ERROR_SYSTEM, "no memory for the control socket");
        return NULL;
    }
    s->with = *with;
    pthread_mutex_init(&s->lock, NULL);
    s->server = control_listen(path, err);
    if (s->server && !pthread_create(&s->thread, NULL, work, s))
        return s;
    if (s->server)
        fail(err, ERROR_SYSTEM, "no thread for the control socket");
    control_unlisten(s->server);
    pthread_mutex_destroy(&s->lock);
    free(s);
    return NULL;
}

void serve_stop(struct serve *s)
{
    if (!s)
        return;
    pthread_mutex_lock(&s->lock);
    s->stop = true;
    pthread_mutex_unlock(&s->lock);
    pthread_join(s->thread, NULL);
    refuse_waiting(s->with.main_jobs);
    refuse_waiting(desk_jobs(s->with.desk));
    answer_finished(s, s->with.main_jobs);
    answer_finished(s, desk_jobs(s->with.desk));
    control_unlisten(s->server);
    pthread_mutex_destroy(&s->lock);
    free(s);
}
