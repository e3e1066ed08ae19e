// SPDX-License-Identifier: Apache-2.0
#include "config/paths.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static bool too_long(const char *name, size_t size, struct error *err)
{
    return fail(err, ERROR_CONFIG, "the path of \"%.200s\" is longer than %zu characters", name,
                size - 1);
}

bool path_beside(const char *file, const char *name, char *out, size_t size, struct error *err)
{
    const char *slash = file ? strrchr(file, '/') : NULL;
    char whole[2 * PATH_MAX];
    int length = slash && *name && *name != '/'
                     ? snprintf(whole, sizeof whole, "%.*s/%s", (int)(slash - file), file, name)
                     : snprintf(whole, sizeof whole, "%s", name);
    if ((size_t)length >= size || (size_t)length >= sizeof whole)
        return too_long(name, size, err);
    memcpy(out, whole, (size_t)length + 1);
    return true;
}

bool path_absolute(const char *path, char *out, size_t size, struct error *err)
{
    char here[PATH_MAX];
    if (*path == '/')
        return path_beside(NULL, path, out, size, err);
    if (!getcwd(here, sizeof here - 1))
        return fail_errno(err, "the working folder");
    strcat(here, "/");
    return path_beside(here, path, out, size, err);
}

int path_is_ini(const struct dirent *entry)
{
    size_t size = strlen(entry->d_name);
    return size > 4 && *entry->d_name != '.' && !strcmp(entry->d_name + size - 4, ".ini");
}

bool path_exists(const char *path)
{
    return *path && access(path, F_OK) == 0;
}
