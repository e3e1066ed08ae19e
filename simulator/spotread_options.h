// SPDX-License-Identifier: Apache-2.0
// The command line of spotread: -v -e -p -c -N -H -O -s -x -h -u -T -Q -X -Y -y
// -W -D and a log file. Others are known and refused.
#ifndef SIMULATOR_SPOTREAD_OPTIONS_H
#define SIMULATOR_SPOTREAD_OPTIONS_H

#include "colorimetry/colour.h"

enum spotread_form { SPOTREAD_LAB, SPOTREAD_YXY, SPOTREAD_LCH, SPOTREAD_YUV };

struct spotread_options {
    bool verbose, spectrum, cct, high_res, no_calibration, one, ambient;
    enum spotread_form form;
    enum observer observer;
    int port, display_type;
    const char *correction, *one_path, *log_path; // NULL = none
};

// As the real one takes them: an option's value is the rest of its word or the
// next word, unless that begins with '-'. False with one line in `why`.
bool spotread_options(struct spotread_options *options, int argc, char **argv, char why[128]);

#endif
