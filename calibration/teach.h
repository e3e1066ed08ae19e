// SPDX-License-Identifier: Apache-2.0
// Teaching a lamp: waiting until its light stands still, averaging its
// spectrum, refusing one that could not be told from another.
#ifndef CALIBRATION_TEACH_H
#define CALIBRATION_TEACH_H

#include "calibration/bench.h"
#include "calibration/spots.h"
#include "calibration/statistics.h"
#include "config/lamps.h"

struct teach_plan {
    double drift;      // greatest relative change per minute of a lamp that stands still, > 0
    double patience_s; // it is waited for at most so long
    int readings;      // averaged, 1..10000
};

// Of a minute 0.5 %, half an hour, 20 readings; for a rehearsal 20 %.
extern const struct teach_plan TEACH_WHOLE, TEACH_REHEARSAL;

// How the light changed, just before it was averaged.
struct steadiness {
    double per_minute, per_minute_u; // relative slope, its standard uncertainty
    double window_s, waited_s;       // what the slope was taken from; since the first reading
};

// Whether a light that gave lux[n] at at_s[n] (ascending) stands still: over
// some window that ends with the newest reading, of 3 s and six readings or
// more, the size of the slope and twice its uncertainty together are within
// plan->drift. *out is of that window; else of the longest.
bool light_is_steady(const double *at_s, const double *lux, int n, const struct teach_plan *plan,
                     struct steadiness *out);

// Switches the lamp on (see bench_lamp) and waits until it stands still.
// Error RETRY, with the slope, when plan->patience_s were not enough.
bool teach_await(struct bench *b, const char *lamp, const struct teach_plan *plan,
                 struct steadiness *out, struct error *err);

// ---- telling lamps apart ---------------------------------------------------

enum likeness {
    LAMPS_APART,
    LAMPS_CLOSE, // readings with the noise that is allowed may be within the limits of both
    LAMPS_ALIKE, // a clean reading of the one is within the limit of the other
};

struct lamp_pair {
    enum likeness likeness;
    double distance; // the smaller of both directions of lamp_distance
    double limit;    // the larger lamp_limit
};

// threshold: the settings' [state] lamp_distance.
struct lamp_pair lamps_compare(const struct lamp *a, const struct lamp *b, double threshold);

// ---- teaching --------------------------------------------------------------

struct teaching {
    struct taught taught;
    struct steadiness steadiness;
    struct spot_scale spots; // count 0 without a map
    double map_scale;        // 1 without a map
    bool map_kept;           // the map of an earlier teaching, rescaled by the change of light
    char close[128];         // taught lamps that are CLOSE to it, "" = none
};

// Teaches the lamp of that name and writes it into settings' lamp folder. map:
// its luminance map, scaled by spot readings and written down as a path; NULL
// keeps the map that is there. Errors: those of the bench and of lamps_load;
// DATA when the lamp is LAMPS_ALIKE another one, which it names: nothing is
// written then.
bool teach_lamp(struct bench *b, const struct booth_settings *settings, const char *name,
                const char *map, const struct teach_plan *plan, struct teaching *out,
                struct error *err);

#endif
