// SPDX-License-Identifier: Apache-2.0
// What spotread leaves on disk: spectra (.sp) and its log of readings.
#ifndef SIMULATOR_SPOTREAD_FILE_H
#define SIMULATOR_SPOTREAD_FILE_H

#include <stdio.h>

#include "simulator/spotread_meter.h"

bool spotread_save_spectrum(const char *path, const struct spotread_bands *bands,
                            struct error *err);

// Adds a row; the titles too when number is 1.
bool spotread_log(FILE *log, int number, const struct spotread_reading *reading, bool with_bands);

#endif
