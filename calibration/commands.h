// SPDX-License-Identifier: Apache-2.0
// The commands of boothcal. Each family lies in one file and is one row of the
// table in boothcal.c; its own subcommands are a table of the same kind.
#ifndef CALIBRATION_COMMANDS_H
#define CALIBRATION_COMMANDS_H

#include "base/error.h"

// What boothcal ends with.
enum command_exit {
    COMMAND_FINE = 0,
    COMMAND_FAILED = 1, // the work could not be done
    COMMAND_USAGE = 2,  // a wrong command line, or an input that must be corrected
    COMMAND_WARNED = 3, // done, with a warning on stderr
};

struct command {
    const char *name; // NULL ends a table
    int (*run)(int argc, char **argv); // argv[0] is the command's own name
    const char *arguments;             // "FILE [--json]", "" without
    const char *help; // one sentence; then, behind an empty line, a line for each option, which
                      // only the row's own --help shows. Without those the row answers --help.
};

// Runs the row that argv[1] names, or prints its help when "--help" or "-h" is
// among its arguments, or the table's help ("--help", "-h", "help", or nothing,
// which is COMMAND_USAGE). family is what stands before, such as "boothcal
// colour".
int command_run(const char *family, const struct command *table, int argc, char **argv);

// Each prints one line on stderr and returns the exit code: the first two
// COMMAND_USAGE, command_failed what the error's code says (base/error.h).
int command_bad_usage(const char *format, ...) __attribute__((format(printf, 1, 2)));
int command_bad_input(const struct error *err);
int command_failed(const struct error *err);

// Prints the warning; COMMAND_FINE without one ("").
int command_warned(const char *warning);

// The families. Each takes its own name as argv[0].
int command_colour(int argc, char **argv);
int command_display(int argc, char **argv);
int command_bands(int argc, char **argv);
int command_light(int argc, char **argv);
int command_session(int argc, char **argv);
int command_list(int argc, char **argv);
int command_spectrometer(int argc, char **argv);
int command_audit(int argc, char **argv);
int command_tilt(int argc, char **argv);
int command_tracker(int argc, char **argv);
int command_keep(int argc, char **argv);
int command_report(int argc, char **argv);
int command_verify(int argc, char **argv);
int command_history(int argc, char **argv);
int command_diff(int argc, char **argv);
int command_use(int argc, char **argv);

#endif
