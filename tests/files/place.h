// SPDX-License-Identifier: Apache-2.0
// A temporary folder for a test program, with files put into and taken out of
// it. Include after cmocka.h.
#ifndef TESTS_FILES_PLACE_H
#define TESTS_FILES_PLACE_H

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char place[32];

static inline int open_place(void **state)
{
    (void)state;
    strcpy(place, "/tmp/files-XXXXXX");
    return mkdtemp(place) ? 0 : -1;
}

static inline int files_in_place(void)
{
    DIR *folder = opendir(place);
    int count = -2; // . and ..
    while (folder && readdir(folder))
        count++;
    closedir(folder);
    return count;
}

static inline int close_place(void **state)
{
    (void)state;
    char path[512];
    DIR *folder = opendir(place);
    for (struct dirent *entry; folder && (entry = readdir(folder));) {
        snprintf(path, sizeof path, "%s/%s", place, entry->d_name);
        unlink(path);
    }
    closedir(folder);
    return rmdir(place);
}

// Path of a name in the folder; good until the fourth call after.
static inline const char *at(const char *name)
{
    static char paths[4][96];
    static int turn;
    char *path = paths[turn++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", place, name);
    return path;
}

static inline const char *put(const char *name, const void *bytes, size_t size)
{
    FILE *out = fopen(at(name), "wb");
    assert_non_null(out);
    assert_int_equal(fwrite(bytes, 1, size, out), size);
    assert_int_equal(fclose(out), 0);
    return at(name);
}

static inline const char *put_text(const char *name, const char *text)
{
    return put(name, text, strlen(text));
}

// The whole file, NUL-terminated; to be freed.
static inline char *take(const char *path, size_t *size)
{
    FILE *in = fopen(path, "rb");
    assert_non_null(in);
    char *bytes = calloc(1, 1 << 22);
    *size = fread(bytes, 1, (1 << 22) - 1, in);
    fclose(in);
    return bytes;
}

static inline void assert_holds(const char *path, const char *text)
{
    size_t size;
    char *bytes = take(path, &size);
    assert_string_equal(bytes, text);
    free(bytes);
}

// An error must be one line of text, "PLACE/" before its text left out.
static inline void assert_complaint(const char *got, const char *expected)
{
    char path[64];
    snprintf(path, sizeof path, "%s/", place);
    assert_null(strpbrk(got, "\r\n"));
    assert_int_equal(strncmp(got, path, strlen(path)), 0);
    assert_string_equal(got + strlen(path), expected);
}

// A file of the shared measurements, which are not part of the tree; the test
// is skipped when they are not beside it.
static inline const char *shared_file(const char *name)
{
    static char path[256];
    snprintf(path, sizeof path, "../shared/data/%s", name);
    if (access(path, R_OK)) {
        printf("skipped: %s is not there\n", path);
        skip();
    }
    return path;
}

#endif
