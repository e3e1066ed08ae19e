// SPDX-License-Identifier: Apache-2.0
// A temporary folder, with text files put into it. Include after cmocka.h.
#ifndef TESTS_FAKES_FOLDER_H
#define TESTS_FAKES_FOLDER_H

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

struct folder {
    char path[64];
};

static inline void folder_open(struct folder *f)
{
    snprintf(f->path, sizeof f->path, "/tmp/boothd-test-XXXXXX");
    assert_non_null(mkdtemp(f->path));
}

static inline int folder_remove(const char *path, const struct stat *what, int kind,
                                struct FTW *where)
{
    (void)what, (void)kind, (void)where;
    return remove(path);
}

static inline void folder_close(struct folder *f)
{
    nftw(f->path, folder_remove, 16, FTW_DEPTH | FTW_PHYS);
}

// "folder/name"; good until the sixteenth call after.
static inline const char *folder_at(const struct folder *f, const char *name)
{
    static char paths[16][256];
    static int turn;
    char *path = paths[turn++ % 16];
    snprintf(path, sizeof *paths, "%s/%s", f->path, name);
    return path;
}

// Writes a text file; name may hold one subfolder, which is made.
static inline const char *folder_put(const struct folder *f, const char *name, const char *text)
{
    const char *path = folder_at(f, name);
    char sub[256];
    snprintf(sub, sizeof sub, "%s", path);
    *strrchr(sub, '/') = 0;
    mkdir(sub, 0755);
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fputs(text, out);
    fclose(out);
    return path;
}

#endif
