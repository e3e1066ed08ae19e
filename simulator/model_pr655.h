// SPDX-License-Identifier: Apache-2.0
// A Photo Research PR-655 spectroradiometer at the end of a serial line:
// characters in, characters out, and exposures that take their time. See
// wires.md.
#ifndef SIMULATOR_MODEL_PR655_H
#define SIMULATOR_MODEL_PR655_H

#include "simulator/around.h"
#include "simulator/model_lapse.h"

enum { PR655_FIRST_NM = 380, PR655_STEP_NM = 4, PR655_POINTS = 101 };

struct pr655_options {
    struct around around;
    const char *serial;
    uint64_t seed;
    double hurry; // divides exposure times, >= 1; the noise stays that of the full exposure
    struct lapse_rates lapses;
};

struct pr655;

// NULL when out of memory.
struct pr655 *pr655_create(const struct pr655_options *options);
void pr655_destroy(struct pr655 *device);

// One character from the host.
void pr655_in(struct pr655 *device, int64_t now_ns, char c);

// Goes on measuring and copies at most size characters for the host into out.
// Returns how many; *again_ns is when to call again although nothing came in,
// INT64_MAX = never. While it measures, call it at least that often.
size_t pr655_out(struct pr655 *device, int64_t now_ns, char *out, size_t size, int64_t *again_ns);

// From now on measurements end with this status (such as -1); 0 = as they are.
void pr655_upset(struct pr655 *device, int status);

// How readings go wrong from now on. A misread that is an error ends with -1,
// as if the light had not been constant.
void pr655_lapse(struct pr655 *device, enum lapse_kind kind);

#endif
