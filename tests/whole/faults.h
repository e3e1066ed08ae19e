// SPDX-License-Identifier: Apache-2.0
// The table of faults, docs/faults.md: what its rows are made of and how one is
// run. An instrument of the table is a kind; its rows are run in turn on lanes,
// one per running booth that has the instrument, each a thread while a row lasts.
#ifndef TESTS_WHOLE_FAULTS_H
#define TESTS_WHOLE_FAULTS_H

#include <pthread.h>

#include "base/control.h"
#include "tests/whole/booth_here.h"

// What boothd does; the words of the table.
#define EFFECTS(X)                                                                                 \
    X(GOES, "goes")     /* away until the cause is */                                              \
    X(BLINKS, "blinks") /* lost once, and back by itself */                                        \
    X(MUTE, "mute")     /* there, says nothing that can be believed: silent or waiting */          \
    X(RIDES, "rides")   /* samples go on */                                                        \
    X(FAILS, "fails")   /* the reading that was asked for fails, the next does not */

enum effect {
#define X(name, text) name,
    EFFECTS(X)
#undef X
};

const char *effect_text(enum effect effect);

struct row {
    const char *fault; // boothsim's word
    enum effect effect;
    const char *says;  // in the instrument's error; NULL = not looked at
    const char *name;  // in the table; NULL = fault
    const char *first; // another fault, before this one
    const char *on;    // another instrument of boothsim that fails
    // Of full, that the lamp is dimmed to before the fault and once it is there; 0 = it is not.
    double light_before, light;
    int lasts_s;  // once it shows; 0 = no longer than is needed to see it
    int stops_ms; // boothd itself is stopped for so long
    bool alone;   // no other row while this one is run
    // Found out:
    char finding[512]; // what was wrong; "" = nothing
    char said[512];    // the instrument's error meanwhile
    double back_ms, allowed_ms;
    bool run;
};

const char *row_name(const struct row *row);

struct lane;

struct kind {
    const char *label;      // in the table
    const char *instrument; // boothsim's word
    const char *name;       // boothd's word
    const char *runs;       // how the log says that it is there
    double enumerates_ms;   // boothsim's preset, after it was away
    struct row *rows;
    int count;
    // Any may be NULL: then boothsim is asked, value[0] > 0 is believed, the row is polled.
    bool (*cause)(struct lane *lane, const char *fault); // "fine" ends it
    void (*value)(const json_t *status, double value[3], double *held_ms);
    bool (*is_true)(const struct lane *lane, const double value[3]);
    void (*run)(struct lane *lane, struct row *row);
    bool (*come_up)(struct lane *lane); // what is to be done before its first row
};

extern const struct kind spectrometer_kind, second_spectrometer_kind, inclinometer_kind, tcp_kind,
    camera_kind, opentrack_kind, radiometer_kind, averaging_radiometer_kind;

struct lane {
    const struct kind *kind;
    struct booth_here *here;
    struct control_client *daemon, *booth;
    double truth[3];  // value when all was well
    double light;     // of full, that the value is true of
    double period_ms; // from sample to sample then
    struct row *row;  // being run, NULL = none
    pthread_t thread;
};

// What is looked at in a status.
struct look {
    char state[16], error[200];
    double samples, age_ms, overdue_ms; // of the instrument
    double value[3], held_ms;           // of what it tells the booth
    int64_t answered_ns;
};

// Keeps the first finding. Always false.
__attribute__((format(printf, 2, 3))) bool found(struct row *row, const char *format, ...);

// False when boothd does not answer.
bool look_at(struct lane *lane, struct row *row, struct look *look);

// The same after a short rest.
bool look_again(struct lane *lane, struct row *row, struct look *look);

bool is_true_value(const struct lane *lane, const struct look *look);

// Dims the booth's lamp to a part of full.
bool dim(struct lane *lane, struct row *row, double level);

// Brings a fault of the row about, or "fine".
bool cause(struct lane *lane, struct row *row, const char *fault);

// Lines of the log from that place on that tell a change of the instrument's
// state; finds fault with a state that follows itself or a last line that is
// not of its running.
int changes_logged(struct lane *lane, struct row *row, long from);

// Asks for a reading of the radiometer, within timeout_s.
bool measures(struct lane *lane, int timeout_s, double *luminance, struct error *err);

// Runs the row of a polled instrument.
void run_polled(struct lane *lane, struct row *row);

// Whether it came back in time: 2 s, its enumeration, three samples of period_ms, and what the
// machine did meanwhile (faults_pace.h). Fills what the row found out about it.
void judge_recovery(struct lane *lane, struct row *row, int64_t fine_ns, int64_t back_ns);

// How long a thread may outlast its deadline on this machine between these instants, in ms.
double lateness_allowed_ms(int64_t from_ns, int64_t to_ns);

// A UDP port of 127.0.0.1 that nobody has.
int opentrack_free_port(void);

#endif
