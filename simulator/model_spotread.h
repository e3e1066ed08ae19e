// SPDX-License-Identifier: Apache-2.0
// ArgyllCMS's spotread with an instrument behind it, as a program that runs at
// a terminal: text out, keys in, readings that take their time. It knows no
// terminal and no clock; spotread_program.h gives it both. See wires.md.
#ifndef SIMULATOR_MODEL_SPOTREAD_H
#define SIMULATOR_MODEL_SPOTREAD_H

#include <stddef.h>
#include <stdint.h>

#include "colorimetry/spectrum.h"
#include "simulator/model_lapse.h"
#include "simulator/spotread_meter.h"

struct spotread_settings {
    enum spotread_kind kind;
    char serial[32];
    uint64_t seed;
    double hurry; // divides the times, >= 1; the noise stays as it is
    struct lapse_rates lapses;
};

// What befalls the instrument. STUCK: a reading does not end while it lasts.
// FATAL: an error that spotread ends of. WEAK, BRIGHT: as if the light were.
enum spotread_trouble {
    SPOTREAD_WELL,
    SPOTREAD_GONE,
    SPOTREAD_STUCK,
    SPOTREAD_FATAL,
    SPOTREAD_WEAK,
    SPOTREAD_BRIGHT,
};

// What it meets at a moment.
struct spotread_sight {
    struct spectrum radiance; // W m-2 sr-1 nm-1
    enum spotread_trouble trouble;
    enum lapse_kind lapse;
    int plug; // how often it was plugged in; spotread knows the one that it began with
};

struct spotread;

// Begins with the arguments after the program's name. NULL when out of memory;
// wrong arguments only make it say so and end.
struct spotread *spotread_create(const struct spotread_settings *settings, int argc, char **argv);
void spotread_destroy(struct spotread *program);

// What it waits for. KEY: a key, looked for now and then. NEXT_KEY: a key,
// awaited. FRESH_KEY: a key that is pressed from now on, awaited. LINE: a line
// of text. SIGHT: to look. TIME: until *until_ns. END: nothing more.
enum spotread_want {
    SPOTREAD_KEY,
    SPOTREAD_NEXT_KEY,
    SPOTREAD_FRESH_KEY,
    SPOTREAD_LINE,
    SPOTREAD_SIGHT,
    SPOTREAD_TIME,
    SPOTREAD_END,
};
enum spotread_want spotread_wants(const struct spotread *program, int64_t now_ns,
                                  int64_t *until_ns);

// Each gives what was wanted. A key 0 is none that means anything; line is
// without its end.
void spotread_key(struct spotread *program, int64_t now_ns, int key);
void spotread_line(struct spotread *program, int64_t now_ns, const char *line);
void spotread_sight(struct spotread *program, int64_t now_ns, const struct spotread_sight *sight);
void spotread_time(struct spotread *program, int64_t now_ns);

// Whether keys that were pressed before are to be dropped, before the text that
// is there now is told. Once.
bool spotread_drops_keys(struct spotread *program);

// Text for standard output (or error) since the last call, NUL-terminated; good
// until the next call of anything.
const char *spotread_out(struct spotread *program);
const char *spotread_err(struct spotread *program);

// What the program ends with.
int spotread_status(const struct spotread *program);

#endif
