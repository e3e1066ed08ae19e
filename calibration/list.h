// SPDX-License-Identifier: Apache-2.0
// What boothcal list prints.
#ifndef CALIBRATION_LIST_H
#define CALIBRATION_LIST_H

#include <stdio.h>

#include "drivers/found.h"

// A table with one line per instrument and a note below each that is not usable.
void list_text(const struct found_list *list, FILE *out);

// One array of objects with kind, driver, place, model, serial, firmware,
// emulated, access, note.
void list_json(const struct found_list *list, FILE *out);

// Whether any may not be opened for want of permission.
bool list_refused(const struct found_list *list);

#endif
