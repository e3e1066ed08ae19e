// SPDX-License-Identifier: Apache-2.0
#include "files/write.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

// A link stays a link: its target is what gets replaced.
static bool resolve(struct whole_file *file, const char *path, struct error *err)
{
    char real[PATH_MAX];
    struct stat there;
    const char *target = path;
    if (!stat(path, &there)) {
        if (!S_ISREG(there.st_mode))
            return fail(err, ERROR_SYSTEM, "%s: is not a regular file", path);
        if (realpath(path, real))
            target = real;
    }
    if (strlen(target) >= sizeof file->path)
        return fail(err, ERROR_RANGE, "%.80s...: path is longer than %zu characters", target,
                    sizeof file->path - 1);
    strcpy(file->path, target);
    return true;
}

bool whole_file_begin(struct whole_file *file, const char *path, struct error *err)
{
    *file = (struct whole_file){0};
    if (!resolve(file, path, err))
        return false;
    int fd = -1;
    for (int i = 0; i < 100 && fd < 0; i++) {
        snprintf(file->temporary, sizeof file->temporary, "%s.%ld-%d.tmp", file->path,
                 (long)getpid(), i);
        fd = open(file->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (fd < 0 && errno != EEXIST)
            break;
    }
    file->stream = fd < 0 ? NULL : fdopen(fd, "w");
    if (file->stream)
        return true;
    fail_errno(err, "%s: cannot be written", path);
    if (fd >= 0) {
        close(fd);
        unlink(file->temporary);
    }
    *file = (struct whole_file){0};
    return false;
}

// The rename itself must survive a power cut.
static void sync_folder(const char *path)
{
    char copy[sizeof((struct whole_file *)0)->path];
    strcpy(copy, path);
    int folder = open(dirname(copy), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0)
        return;
    fsync(folder);
    close(folder);
}

bool whole_file_commit(struct whole_file *file, struct error *err)
{
    bool written = !ferror(file->stream) && !fflush(file->stream) && !fsync(fileno(file->stream));
    int saved = errno;
    bool closed = !fclose(file->stream);
    file->stream = NULL;
    if (written && closed && !rename(file->temporary, file->path)) {
        sync_folder(file->path);
        *file = (struct whole_file){0};
        return true;
    }
    if (!written)
        errno = saved;
    fail_errno(err, "%s: writing failed, the file is as it was", file->path);
    whole_file_abandon(file);
    return false;
}

void whole_file_abandon(struct whole_file *file)
{
    if (file->stream)
        fclose(file->stream);
    if (*file->temporary)
        unlink(file->temporary);
    *file = (struct whole_file){0};
}

bool whole_file_write(const char *path, const void *bytes, size_t size, struct error *err)
{
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    fwrite(bytes, 1, size, file.stream);
    return whole_file_commit(&file, err);
}

static bool pipes_too; // written before any thread

void files_take_pipes(void)
{
    pipes_too = true;
}

static FILE *open_to_read(const char *path, struct error *err)
{
    struct stat what;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY | (pipes_too ? 0 : O_NONBLOCK));
    bool there = fd >= 0 && !fstat(fd, &what);
    FILE *stream = NULL;
    if (there && S_ISDIR(what.st_mode))
        there = false, errno = EISDIR;
    if (!there)
        fail(err, ERROR_CONFIG, "%s: cannot be read: %s", path, strerror(errno));
    else if (!pipes_too && !S_ISREG(what.st_mode))
        fail(err, ERROR_CONFIG, "%s: is no regular file", path);
    else if (!(stream = fdopen(fd, "rb")))
        fail_errno(err, "%s: cannot be read", path);
    if (!stream && fd >= 0)
        close(fd);
    return stream;
}

static char *read_stream(FILE *stream, size_t most, size_t *size)
{
    size_t room = 65536, used = 0;
    char *bytes = malloc(room + 1);
    while (bytes) {
        used += fread(bytes + used, 1, room - used, stream);
        if (used < room || used > most)
            break;
        room *= 2;
        char *more = realloc(bytes, room + 1);
        if (!more)
            free(bytes);
        bytes = more;
    }
    *size = used;
    return bytes;
}

char *file_read(const char *path, size_t most, size_t *size, struct error *err)
{
    FILE *stream = open_to_read(path, err);
    if (!stream)
        return NULL;
    char *bytes = read_stream(stream, most, size);
    bool bad = ferror(stream);
    if (!bytes || bad)
        fail_errno(err, "%s: cannot be read", path);
    else if (*size > most)
        bad = true, fail(err, ERROR_DATA, "%s: is larger than %zu bytes", path, most);
    fclose(stream);
    if (bad) {
        free(bytes);
        return NULL;
    }
    if (bytes)
        bytes[*size] = 0;
    return bytes;
}
