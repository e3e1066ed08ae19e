// SPDX-License-Identifier: Apache-2.0
// The booth of the day: its world, a station for each instrument and what
// boothd makes of them. Include after cmocka.h.
#ifndef TESTS_WHOLE_DAY_BOOTH_H
#define TESTS_WHOLE_DAY_BOOTH_H

#include "base/clock.h"
#include "daemon/desk.h"
#include "daemon/polled.h"
#include "daemon/state.h"
#include "tests/whole/day.h"

#include "tests/fakes/folder.h"

// The last one is that of boothd's main thread: what is believed.
enum { SPECTROMETER, INCLINOMETER, GATEWAY, CAMERA, POSES, RADIOMETER, BELIEF, LANES };

union sample {
    struct spectrum_sample spectrum;
    struct tilt_sample tilt;
    struct head_sample head;
};

// A sample that was posted: at once for its driver, who may be ahead of others.
struct letter {
    uint64_t number;
    int64_t posted_ns, good_ns; // good_ns: latest instant of the last good sample, 0 = none yet
    union sample sample;
};

struct station {
    struct lane lane;
    const struct day_kind *kinds;
    int kind_count;
    enum instrument instrument;
    int64_t cold_ns, hot_ns;  // pause after a sample while all is well, and around faults
    int64_t integration_ns;   // longest of one sample
    struct polled *polled;    // NULL: radiometer and belief
    struct letter letters[2]; // the last one and the one before
    int64_t latest_ns;        // latest instant of the last sample
    int struck;               // the last fault,
    int struck_lines;         // lines of the log before it,
    int64_t over_ns;          // when it was over, 0 = there was none,
    int good;                 // and good samples since
    uint64_t samples, good_samples;
    int faults, recovered, failures; // failures: of the radiometer, in a row
    int64_t worst_ns;                // recovery
    int worst_fault;
    int64_t longest_ns;    // turn
    uint64_t series_asked; // request of raw readings that is not answered yet, 0 = none
    uint64_t series_next;  // with this number of samples the next one is asked for
    int series_done, series_refused;
};

struct day {
    struct folder folder;
    struct booth_settings settings;
    struct world *world;
    struct around around; // the world's senses, and what is wrong with them
    struct station stations[LANES];
    struct desk *desk;
    struct estimator estimator;
    struct samples seen;
    struct state state;
};

extern struct day day;

static const int64_t DAY_START_NS = 3 * NS_PER_S; // the machine has just come up

static const double DAY_TAUGHT_LUX = 1500;

// Setup and teardown of cmocka; the latter returns how much the libraries
// handed out and did not get back.
int day_open(void **state);
int day_close(void **state);

#endif
