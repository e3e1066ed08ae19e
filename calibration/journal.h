// SPDX-License-Identifier: Apache-2.0
// Readings on disk as they come: a line of JSON each, the first one says what
// the whole is for. Whatever ends the program, the lines that were written stay.
#ifndef CALIBRATION_JOURNAL_H
#define CALIBRATION_JOURNAL_H

#include <jansson.h>
#include <stdio.h>

#include "base/error.h"

struct journal {
    FILE *stream;  // NULL: only read
    json_t *head;  // object
    json_t *lines; // array of objects: what was there, then what is added
    char path[512];
};

// Opens the journal, or begins it with `head` (borrowed). A last line without
// its end is cut off. Errors: DATA for a line that is no JSON object, naming
// file and line; SYSTEM; RETRY when another program has it open.
bool journal_open(struct journal *j, const char *path, json_t *head, struct error *err);

// Reads a journal that nobody goes on with; nothing may be added.
bool journal_read(struct journal *j, const char *path, struct error *err);

// Writes a line and waits until it is on disk. Takes over `line`.
bool journal_add(struct journal *j, json_t *line, struct error *err);

void journal_close(struct journal *j); // accepts a zeroed journal

#endif
