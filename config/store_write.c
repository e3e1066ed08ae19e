// SPDX-License-Identifier: Apache-2.0
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "config/store_files.h"
#include "files/ini.h"
#include "files/write.h"

#define LOCK ".lock"
#define LITTER ".draft-" // what a killed writer may leave begins so

// ---- the lock ---------------------------------------------------------------

// STORE, STORE/BOOTH and STORE/BOOTH/DISPLAY, each on the disk with its entry.
static bool make_folders(const char *folder, struct error *err)
{
    char path[STORE_PATH];
    for (int up = 2; up >= 0; up--) {
        strcpy(path, folder);
        for (int i = 0; i < up; i++)
            *strrchr(path, '/') = 0;
        if (mkdir(path, 0777)) {
            if (errno == EEXIST)
                continue;
            return fail_errno(err, "making %s", path);
        }
        if (!store_sync_folder(dirname(path), err))
            return false;
    }
    return true;
}

// Held by the descriptor: it ends with the process, however that ends.
static bool take_lock(const struct store_place *place, int *lock, struct error *err)
{
    char path[STORE_PATH + 16];
    if (!make_folders(place->folder, err))
        return false;
    snprintf(path, sizeof path, "%s/" LOCK, place->folder);
    *lock = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (*lock < 0)
        return fail_errno(err, "%s", path);
    if (!flock(*lock, LOCK_EX | LOCK_NB))
        return true;
    bool busy = errno == EWOULDBLOCK;
    if (busy)
        fail(err, ERROR_RETRY, "%s: somebody else writes a calibration now", place->folder);
    else
        fail_errno(err, "%s: cannot be locked", path);
    close(*lock);
    *lock = -1;
    return false;
}

static void give_lock(int *lock)
{
    if (*lock >= 0)
        close(*lock);
    *lock = -1;
}

static int is_litter(const struct dirent *entry)
{
    return !strncmp(entry->d_name, LITTER, strlen(LITTER));
}

// Under the lock nobody works on a draft.
static bool sweep(const struct store_place *place, struct error *err)
{
    struct dirent **entries = NULL;
    char path[STORE_PATH + 300];
    int count = scandir(place->folder, &entries, is_litter, NULL);
    bool fine = count >= 0 || fail_errno(err, "%s", place->folder);
    for (int i = 0; i < count; i++) {
        snprintf(path, sizeof path, "%s/%s", place->folder, entries[i]->d_name);
        fine = fine && store_remove(path, err);
        free(entries[i]);
    }
    free(entries);
    return fine;
}

// ---- drafts -----------------------------------------------------------------

static bool enter(struct store_draft *d, const char *path, char *whole, size_t size,
                  struct error *err)
{
    bool inside = *path && *path != '/' && *path != '.' && !strstr(path, "/.") &&
                  strlen(path) < sizeof((struct store_file *)0)->path;
    if (!inside || snprintf(whole, size, "%s/%s", d->folder, path) >= (int)size)
        return fail(err, ERROR_RANGE, "\"%.100s\": no path within a calibration", path);
    return store_make_parents(d->folder, path, err);
}

static bool share_file(void *context, const char *whole, const char *path, struct error *err)
{
    char to[PATH_MAX];
    if (!strcmp(path, STORE_MANIFEST) || !strcmp(path, STORE_SUMS))
        return true; // of the version, not of the calibration
    return enter(context, path, to, sizeof to, err) && store_link(whole, to, err);
}

static bool start_from_current(struct store_draft *d, struct error *err)
{
    struct store_version base;
    int number;
    if (!store_current(&d->place, &number, err))
        return false;
    if (!number)
        return true;
    if (!store_open(&d->place, number, &base, err)) {
        if (err && err->code == ERROR_DATA)
            err->code = ERROR_CONFIG;
        return while_doing(err, "the calibration in force is no start (boothcal use puts another "
                                "one in force)");
    }
    bool fine = store_walk(base.folder, share_file, d, err);
    d->base = base.manifest;
    store_version_fini(&base);
    return fine;
}

bool store_begin(const struct store_place *place, bool from_current, struct store_draft *out,
                 struct error *err)
{
    struct store_draft d = {.place = *place, .lock = -1};
    snprintf(d.folder, sizeof d.folder, "%s/" LITTER "%ld", place->folder, (long)getpid());
    if (!take_lock(place, &d.lock, err))
        return false;
    bool fine = sweep(place, err);
    if (fine && mkdir(d.folder, 0777))
        fine = fail_errno(err, "making %s", d.folder);
    if (fine && (!from_current || start_from_current(&d, err))) {
        *out = d;
        return true;
    }
    store_abandon(&d);
    return false;
}

bool store_put(struct store_draft *d, const char *from, const char *path, struct error *err)
{
    char to[PATH_MAX];
    return enter(d, path, to, sizeof to, err) && store_remove(to, err) && store_copy(from, to, err);
}

void store_abandon(struct store_draft *d)
{
    if (d->lock >= 0)
        store_remove(d->folder, NULL);
    give_lock(&d->lock);
}

// ---- commit -----------------------------------------------------------------

static bool next_number(const struct store_place *place, int *number, struct error *err)
{
    int *numbers, count;
    if (!store_numbers(place, &numbers, &count, err))
        return false;
    *number = count ? numbers[count - 1] + 1 : 1;
    free(numbers);
    return *number <= 999999 || fail(err, ERROR_CONFIG, "%s: is full", place->folder);
}

static bool save_manifest(const struct store_draft *d, const struct store_manifest *facts,
                          int number, struct error *err)
{
    struct store_manifest m = *facts;
    char path[sizeof d->folder + 16];
    const struct settings_section sections[] = {{"calibration", store_manifest_settings, &m}, {0}};
    m.version = number;
    m.based_on = d->base.version;
    strcpy(m.booth, d->place.booth);
    strcpy(m.display, d->place.display);
    snprintf(path, sizeof path, "%s/" STORE_MANIFEST, d->folder);
    return ini_save(path, sections, err);
}

struct listing {
    struct store_file *files;
    int count;
};

static bool list_file(void *context, const char *whole, const char *path, struct error *err)
{
    struct listing *l = context;
    if (!strcmp(path, STORE_SUMS))
        return true;
    if (l->count == STORE_FILES_MOST || strlen(path) >= sizeof l->files->path)
        return fail(err, ERROR_RANGE,
                    "%s: a calibration holds at most %d files with paths of %zu "
                    "characters",
                    whole, STORE_FILES_MOST, sizeof l->files->path - 1);
    struct store_file *f = &l->files[l->count++];
    strcpy(f->path, path);
    return sha256_of_file(whole, &f->sum, err);
}

static bool save_sums(const struct store_draft *d, struct error *err)
{
    struct listing l = {malloc(STORE_FILES_MOST * sizeof *l.files), 0};
    char path[sizeof d->folder + 16];
    struct whole_file file;
    if (!l.files)
        return fail(err, ERROR_SYSTEM, "out of memory for the files of %s", d->folder);
    snprintf(path, sizeof path, "%s/" STORE_SUMS, d->folder);
    bool fine = store_walk(d->folder, list_file, &l, err) && whole_file_begin(&file, path, err);
    if (fine) {
        qsort(l.files, (size_t)l.count, sizeof *l.files, store_file_order);
        for (int i = 0; i < l.count; i++)
            fprintf(file.stream, "%s  %s\n", l.files[i].sum.hex, l.files[i].path);
        fine = whole_file_commit(&file, err);
    }
    free(l.files);
    return fine;
}

// From here on the version is there, and never changes.
static bool take_number(const struct store_draft *d, int number, struct error *err)
{
    char path[STORE_PATH + 16];
    store_version_path(&d->place, number, "", path, sizeof path);
    if (rename(d->folder, path))
        return fail_errno(err, "%s", path);
    return store_sync_folder(d->place.folder, err);
}

static bool put_in_force(const struct store_place *place, int number, struct error *err)
{
    char aside[STORE_PATH + 40], link[STORE_PATH + 16], target[16];
    snprintf(target, sizeof target, "%04d", number);
    snprintf(aside, sizeof aside, "%s/" LITTER "link-%ld", place->folder, (long)getpid());
    snprintf(link, sizeof link, "%s/" STORE_CURRENT, place->folder);
    if (symlink(target, aside))
        return fail_errno(err, "%s", aside);
    if (rename(aside, link)) {
        fail_errno(err, "%s", link);
        unlink(aside);
        return false;
    }
    return store_sync_folder(place->folder, err);
}

bool store_commit(struct store_draft *d, const struct store_manifest *facts, int *number,
                  struct error *err)
{
    int next = 0;
    bool fine = next_number(&d->place, &next, err) && save_manifest(d, facts, next, err) &&
                save_sums(d, err) && store_sync(d->folder, err) && take_number(d, next, err) &&
                put_in_force(&d->place, next, err);
    store_abandon(d);
    if (fine && number)
        *number = next;
    return fine;
}

bool store_use(const struct store_place *place, int number, struct error *err)
{
    struct store_version version;
    int lock;
    if (!store_open(place, number, &version, err))
        return false;
    store_version_fini(&version);
    if (!take_lock(place, &lock, err))
        return false;
    bool fine = sweep(place, err) && put_in_force(place, number, err);
    give_lock(&lock);
    return fine;
}
