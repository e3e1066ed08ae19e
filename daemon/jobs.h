// SPDX-License-Identifier: Apache-2.0
// Requests that the control thread passes on: to the main thread, which owns
// renderer and setup, or to the desk, which waits for instruments. A job goes
// in by jobs_post, is worked on by one taker, and comes back by jobs_finished.
#ifndef DAEMON_JOBS_H
#define DAEMON_JOBS_H

#include <jansson.h>
#include <stdint.h>

#include "base/error.h"
#include "colorimetry/display.h"

enum job_kind {
    JOB_SHOW, // main thread …
    JOB_PATCH,
    JOB_CAPTURE,
    JOB_PROBE,
    JOB_RELOAD,
    JOB_QUIT,
    JOB_MEASURE, // … the desk
    JOB_TEACH,
    JOB_RAW,
};

struct job {
    enum job_kind kind;
    uint64_t ticket; // of base/control.h
    // Asked; which fields count depends on the kind.
    char name[512]; // material, file or lamp
    char patch[64]; // SHOW, "" = the whole material
    struct counts counts;
    int x_px, y_px, readings;
    int integration_us; // RAW, 0 = as it is
    double timeout_s;
    // Answered: a reply, or NULL with err; CAPTURE also one of the pictures.
    json_t *reply;
    struct error err;
    int width, height;
    uint8_t *picture; // counts, malloc'd
    float *light;     // XYZ cd/m2, malloc'd
};

enum { JOBS_MOST = 16 };

struct jobs;

struct jobs *jobs_create(struct error *err);
void jobs_destroy(struct jobs *jobs); // what is left inside is freed; accepts NULL

// Readable while a job waits for its taker, for poll(2).
int jobs_fd(const struct jobs *jobs);

// Takes over *job. False (RETRY) when JOBS_MOST wait already. Any thread.
bool jobs_post(struct jobs *jobs, const struct job *job, struct error *err);

// The oldest waiting job; false when there is none. Any thread.
bool jobs_take(struct jobs *jobs, struct job *out);

// Hands a taken job back, with its answer. Any thread.
void jobs_finish(struct jobs *jobs, const struct job *job);

// The oldest finished job; the caller owns reply and pictures. Any thread.
bool jobs_finished(struct jobs *jobs, struct job *out);

// Frees reply and pictures.
void job_fini(struct job *job);

#endif
