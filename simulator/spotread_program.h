// SPDX-License-Identifier: Apache-2.0
// The emulated spotread as a process: at its terminal, beside a boothsim that
// it asks for light.
#ifndef SIMULATOR_SPOTREAD_PROGRAM_H
#define SIMULATOR_SPOTREAD_PROGRAM_H

#include <stdbool.h>

// Runs until it ends or its terminal hangs up, and returns its exit status.
// argv are the arguments after its name. interactive = standard input is to be
// a terminal, as spotread takes it unless ARGYLL_NOT_INTERACTIVE is set.
int spotread_run(const char *socket, bool interactive, int argc, char **argv);

#endif
