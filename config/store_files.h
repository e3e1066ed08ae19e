// SPDX-License-Identifier: Apache-2.0
// Names and walks that reader and writer of the store share. Private to
// store.c, store_files.c and store_write.c.
#ifndef CONFIG_STORE_FILES_H
#define CONFIG_STORE_FILES_H

#include "config/store.h"

#define STORE_MANIFEST "manifest.ini"
#define STORE_SUMS "SHA256SUMS"
#define STORE_CURRENT "current"

// The version that a folder's name means, 0 = none.
int store_number(const char *name);

// "PLACE/0012/name", or the version's folder for a name of "".
void store_version_path(const struct store_place *place, int number, const char *name, char *out,
                        size_t size);

// Calls back for every file below folder, in no particular order: its whole
// path and the one within the folder. Ends with the first false. Refuses (DATA)
// what is neither a regular file nor a folder, and names that are hidden or no
// text.
typedef bool store_visit(void *context, const char *whole, const char *path, struct error *err);
bool store_walk(const char *folder, store_visit *visit, void *context, struct error *err);

// Of struct store_file, by path: for qsort and bsearch.
int store_file_order(const void *a, const void *b);

// Removes a file or a folder with all it holds; none there is fine too.
bool store_remove(const char *path, struct error *err);

// Flushes every file below folder, every folder and itself to the disk; the files
// become read-only.
bool store_sync(const char *folder, struct error *err);

// Flushes the entries of one folder to the disk.
bool store_sync_folder(const char *folder, struct error *err);

// Makes the folders above path that are below root and missing.
bool store_make_parents(const char *root, const char *path, struct error *err);

// A second name for a file where the file system has links, else a copy.
bool store_link(const char *from, const char *to, struct error *err);

// A copy of a file; to must not be there.
bool store_copy(const char *from, const char *to, struct error *err);

#endif
