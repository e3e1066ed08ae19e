// SPDX-License-Identifier: Apache-2.0
#include "daemon/jobs.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

// More than may ever wait, so that finishing cannot fail.
enum { ROOM = 2 * JOBS_MOST };

struct queue {
    struct job jobs[ROOM];
    int first, count;
};

struct jobs {
    pthread_mutex_t lock;
    struct queue waiting, finished;
    int taken; // and not yet finished
    int fd;
};

static void push(struct queue *q, const struct job *job)
{
    q->jobs[(q->first + q->count++) % ROOM] = *job;
}

static bool pop(struct queue *q, struct job *out)
{
    if (!q->count)
        return false;
    *out = q->jobs[q->first];
    q->first = (q->first + 1) % ROOM;
    q->count--;
    return true;
}

struct jobs *jobs_create(struct error *err)
{
    struct jobs *jobs = calloc(1, sizeof *jobs);
    if (!jobs) {
        fail(err, ERROR_SYSTEM, "no memory for requests");
        return NULL;
    }
    jobs->fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK | EFD_SEMAPHORE);
    pthread_mutex_init(&jobs->lock, NULL);
    if (jobs->fd >= 0)
        return jobs;
    fail_errno(err, "no event for requests");
    jobs_destroy(jobs);
    return NULL;
}

void job_fini(struct job *job)
{
    json_decref(job->reply);
    free(job->picture);
    free(job->light);
    job->reply = NULL;
    job->picture = NULL;
    job->light = NULL;
}

void jobs_destroy(struct jobs *jobs)
{
    struct job job;
    if (!jobs)
        return;
    while (pop(&jobs->waiting, &job) || pop(&jobs->finished, &job))
        job_fini(&job);
    if (jobs->fd >= 0)
        close(jobs->fd);
    pthread_mutex_destroy(&jobs->lock);
    free(jobs);
}

int jobs_fd(const struct jobs *jobs)
{
    return jobs->fd;
}

bool jobs_post(struct jobs *jobs, const struct job *job, struct error *err)
{
    pthread_mutex_lock(&jobs->lock);
    bool room = jobs->waiting.count + jobs->taken + jobs->finished.count < JOBS_MOST;
    if (room) {
        push(&jobs->waiting, job);
        eventfd_write(jobs->fd, 1);
    }
    pthread_mutex_unlock(&jobs->lock);
    return room || fail(err, ERROR_RETRY, "%d requests wait already", JOBS_MOST);
}

bool jobs_take(struct jobs *jobs, struct job *out)
{
    eventfd_t one;
    pthread_mutex_lock(&jobs->lock);
    bool any = pop(&jobs->waiting, out);
    if (any) {
        jobs->taken++;
        eventfd_read(jobs->fd, &one);
    }
    pthread_mutex_unlock(&jobs->lock);
    return any;
}

void jobs_finish(struct jobs *jobs, const struct job *job)
{
    pthread_mutex_lock(&jobs->lock);
    jobs->taken--;
    push(&jobs->finished, job);
    pthread_mutex_unlock(&jobs->lock);
}

bool jobs_finished(struct jobs *jobs, struct job *out)
{
    pthread_mutex_lock(&jobs->lock);
    bool any = pop(&jobs->finished, out);
    pthread_mutex_unlock(&jobs->lock);
    return any;
}
