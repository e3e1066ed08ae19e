// SPDX-License-Identifier: Apache-2.0
#include "config/store_files.h"

#include <errno.h>
#include <fcntl.h>
#include <fts.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <unistd.h>

#include "files/text.h"

int store_file_order(const void *a, const void *b)
{
    return strcmp(((const struct store_file *)a)->path, ((const struct store_file *)b)->path);
}

static FTS *open_tree(const char *folder, struct error *err)
{
    char *const roots[] = {(char *)folder, NULL};
    FTS *tree = fts_open(roots, FTS_PHYSICAL | FTS_NOCHDIR | FTS_COMFOLLOW, NULL);
    if (!tree)
        fail_errno(err, "%s", folder);
    return tree;
}

static bool fit_to_list(const FTSENT *e, struct error *err)
{
    bool hidden = e->fts_level > 0 && *e->fts_name == '.';
    bool plain = text_utf8_end(e->fts_name, e->fts_namelen) == e->fts_namelen &&
                 !strpbrk(e->fts_name, "\n\r\t\\");
    return (plain && !hidden) ||
           fail(err, ERROR_DATA, "%s: no name for a file of a calibration", e->fts_path);
}

static bool visit_one(const FTSENT *e, const char *folder, store_visit *visit, void *context,
                      struct error *err)
{
    switch (e->fts_info) {
    case FTS_DP:
        return true;
    case FTS_D:
        return fit_to_list(e, err);
    case FTS_F:
        return fit_to_list(e, err) &&
               visit(context, e->fts_path, e->fts_path + strlen(folder) + 1, err);
    case FTS_DNR:
    case FTS_ERR:
    case FTS_NS:
        errno = e->fts_errno;
        return fail_errno(err, "%s", e->fts_path);
    default:
        return fail(err, ERROR_DATA, "%s: is no regular file", e->fts_path);
    }
}

bool store_walk(const char *folder, store_visit *visit, void *context, struct error *err)
{
    FTS *tree = open_tree(folder, err);
    bool fine = tree;
    for (FTSENT *e; fine && (e = fts_read(tree));)
        fine = visit_one(e, folder, visit, context, err);
    if (tree)
        fts_close(tree);
    return fine;
}

static bool remove_one(const FTSENT *e, struct error *err)
{
    if (e->fts_info == FTS_D)
        return true;
    int failed = e->fts_info == FTS_DP ? rmdir(e->fts_path) : unlink(e->fts_path);
    return !failed || errno == ENOENT || fail_errno(err, "%s: cannot be removed", e->fts_path);
}

bool store_remove(const char *path, struct error *err)
{
    struct stat what;
    if (lstat(path, &what))
        return errno == ENOENT || fail_errno(err, "%s", path);
    if (!S_ISDIR(what.st_mode))
        return !unlink(path) || fail_errno(err, "%s: cannot be removed", path);
    FTS *tree = open_tree(path, err);
    bool fine = tree;
    for (FTSENT *e; fine && (e = fts_read(tree));)
        fine = remove_one(e, err);
    if (tree)
        fts_close(tree);
    return fine;
}

static bool sync_path(const char *path, int flags, bool fix, struct error *err)
{
    struct stat what;
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOFOLLOW | flags);
    bool fine = fd >= 0 && !fstat(fd, &what) &&
                (!fix || !(what.st_mode & 0222) || !fchmod(fd, what.st_mode & 07555)) && !fsync(fd);
    if (!fine)
        fail_errno(err, "%s: cannot be flushed to the disk", path);
    if (fd >= 0)
        close(fd);
    return fine;
}

bool store_sync_folder(const char *folder, struct error *err)
{
    return sync_path(folder, O_DIRECTORY, false, err);
}

bool store_sync(const char *folder, struct error *err)
{
    FTS *tree = open_tree(folder, err);
    bool fine = tree;
    for (FTSENT *e; fine && (e = fts_read(tree));)
        if (e->fts_info == FTS_F)
            fine = sync_path(e->fts_path, 0, true, err);
        else if (e->fts_info == FTS_DP)
            fine = store_sync_folder(e->fts_path, err);
    if (tree)
        fts_close(tree);
    return fine;
}

bool store_make_parents(const char *root, const char *path, struct error *err)
{
    char whole[PATH_MAX];
    size_t from = strlen(root) + 1;
    if (snprintf(whole, sizeof whole, "%s/%s", root, path) >= (int)sizeof whole)
        return fail(err, ERROR_CONFIG, "the path %.200s is too long", path);
    for (char *slash = whole + from; (slash = strchr(slash, '/')); slash++) {
        *slash = 0;
        if (mkdir(whole, 0777) && errno != EEXIST)
            return fail_errno(err, "making %s", whole);
        *slash = '/';
    }
    return true;
}

static bool copy_bytes(int from, int to)
{
    ssize_t count;
    do
        count = sendfile(to, from, NULL, 1 << 30);
    while (count > 0 || (count < 0 && errno == EINTR));
    return !count;
}

bool store_copy(const char *from, const char *to, struct error *err)
{
    struct stat what;
    int in = open(from, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (in < 0 || fstat(in, &what) || !S_ISREG(what.st_mode)) {
        if (in >= 0)
            close(in);
        return fail(err, ERROR_CONFIG, "%s: %s", from,
                    in < 0 ? strerror(errno) : "is no regular file");
    }
    int out = open(to, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    bool fine = out >= 0 && copy_bytes(in, out);
    if (!fine)
        fail_errno(err, "%s: cannot be written", to);
    if (out >= 0 && close(out) && fine)
        fine = fail_errno(err, "%s: cannot be written", to);
    close(in);
    return fine;
}

bool store_link(const char *from, const char *to, struct error *err)
{
    if (!link(from, to))
        return true;
    bool without = errno == EPERM || errno == EOPNOTSUPP || errno == EMLINK || errno == EXDEV ||
                   errno == EACCES || errno == ENOSYS;
    return without ? store_copy(from, to, err) : fail_errno(err, "%s: cannot be linked", to);
}
