// SPDX-License-Identifier: Apache-2.0
// Paths in settings files are relative to the file that names them.
#ifndef CONFIG_PATHS_H
#define CONFIG_PATHS_H

#include <dirent.h>
#include <stdbool.h>
#include <stddef.h>

#include "base/error.h"

// Puts into out (size bytes) where `name`, as it stands in the file `file`,
// really lies: name itself when it is absolute, else beside file. file may be
// NULL: then relative to the working folder, that is, unchanged. An empty name
// stays empty. name may be out itself. Error CONFIG when it does not fit; out
// is then untouched.
bool path_beside(const char *file, const char *name, char *out, size_t size, struct error *err);

// path made absolute from the working folder. Error CONFIG when it does not
// fit, SYSTEM when there is no working folder.
bool path_absolute(const char *path, char *out, size_t size, struct error *err);

// For scandir: a name such as "D50.ini" that is not hidden.
int path_is_ini(const struct dirent *entry);

// True when a file or folder of that name exists.
bool path_exists(const char *path);

#endif
