// SPDX-License-Identifier: Apache-2.0
// Files that are either whole or not there: written beside their place,
// fsynced, renamed.
#ifndef FILES_WRITE_H
#define FILES_WRITE_H

#include <stdbool.h>
#include <stdio.h>

#include "base/error.h"

struct whole_file {
    FILE *stream; // write here
    char path[1024];
    char temporary[1056];
};

// Opens a temporary file in the folder of path. Error SYSTEM names the path.
bool whole_file_begin(struct whole_file *file, const char *path, struct error *err);

// Flushes, fsyncs, renames onto path, fsyncs the folder. On failure the
// temporary file is gone and path is as it was.
bool whole_file_commit(struct whole_file *file, struct error *err);

// Removes the temporary file. Accepts a zeroed or a committed file.
void whole_file_abandon(struct whole_file *file);

// Both steps for bytes at hand.
bool whole_file_write(const char *path, const void *bytes, size_t size, struct error *err);

// Reads a whole file into malloc'd memory, NUL-terminated beyond *size. Only a
// regular file: a pipe could keep its reader waiting for ever. NULL with err
// (CONFIG when there is no such file or it may not be read; DATA beyond most
// bytes; SYSTEM).
char *file_read(const char *path, size_t most, size_t *size, struct error *err);

// From now on file_read takes pipes and devices too, and waits for them: for a
// program at whose command line somebody may write <(…) or /dev/stdin. To be
// called at its start, before any thread.
void files_take_pipes(void);

#endif
