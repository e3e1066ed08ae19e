// SPDX-License-Identifier: Apache-2.0
#include "config/store.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "config/store_files.h"
#include "files/ini.h"
#include "files/write.h"

enum { SUMS_BYTES_MOST = STORE_FILES_MOST * 400, DIGITS_MOST = 6, SUM = 64 };

#define TEXT(field, preset_text, sentence)                                                         \
    {                                                                                              \
        .name = #field, .type = SETTING_TEXT,                                                      \
        .offset = SETTING_FIELD(struct store_manifest, field),                                     \
        .size = SETTING_SIZE(struct store_manifest, field), .unit = "", .preset = preset_text,     \
        .help = sentence                                                                           \
    }
#define NUMBER(field, from, preset_text, sentence)                                                 \
    {                                                                                              \
        .name = #field, .type = SETTING_INT,                                                       \
        .offset = SETTING_FIELD(struct store_manifest, field), .least = from, .most = 999999,      \
        .unit = "", .preset = preset_text, .help = sentence                                        \
    }

const struct setting store_manifest_settings[] = {
    NUMBER(version, 1, NULL, "Number of this version."),
    NUMBER(based_on, 0, "0", "Version it started from; 0: none."),
    TEXT(booth, NULL, "Booth it is for."),
    TEXT(display, NULL, "Display it is for: panel and serial number."),
    TEXT(created, NULL, "When it was made (UTC)."),
    TEXT(valid_until, "", "Until when it may be used (UTC); empty: for ever."),
    TEXT(software, "", "Program that made it."),
    TEXT(note, "", "What it is."),
    {0},
};

// ---- places ----------------------------------------------------------------

static void folder_name(const char *text, char *out)
{
    static const char fine[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";
    size_t i = 0;
    for (; text[i]; i++)
        out[i] = strchr(fine, text[i]) && (i || text[i] != '.') ? text[i] : '-';
    out[i] = 0;
}

bool store_place(const char *store, const char *booth, const char *display, struct store_place *out,
                 struct error *err)
{
    struct store_place place;
    char names[2][sizeof place.display];
    size_t length = strlen(store);
    while (length > 1 && store[length - 1] == '/')
        length--;
    if (!*booth || strlen(booth) >= sizeof place.booth)
        return fail(err, ERROR_CONFIG, "a store of calibrations needs the booth's name");
    if (!*display || strlen(display) >= sizeof place.display)
        return fail(err, ERROR_CONFIG,
                    "a store of calibrations needs the display's panel and serial number");
    folder_name(booth, names[0]);
    folder_name(display, names[1]);
    strcpy(place.booth, booth);
    strcpy(place.display, display);
    // Room for what lies in it.
    if (snprintf(place.folder, sizeof place.folder, "%.*s/%s/%s", (int)length, store, names[0],
                 names[1]) >= (int)sizeof place.folder - 300)
        return fail(err, ERROR_CONFIG, "the path of the store %.200s is too long", store);
    *out = place;
    return true;
}

int store_number(const char *name)
{
    size_t digits = strspn(name, "0123456789");
    return digits >= 4 && digits <= DIGITS_MOST && !name[digits] ? atoi(name) : 0;
}

void store_version_path(const struct store_place *place, int number, const char *name, char *out,
                        size_t size)
{
    snprintf(out, size, "%s/%04d%s%s", place->folder, number, *name ? "/" : "", name);
}

bool store_current(const struct store_place *place, int *number, struct error *err)
{
    char link[STORE_PATH + 16], target[64] = "", folder[STORE_PATH + 16];
    struct stat what;
    snprintf(link, sizeof link, "%s/" STORE_CURRENT, place->folder);
    ssize_t size = readlink(link, target, sizeof target - 1);
    if (size < 0 && (errno == ENOENT || errno == ENOTDIR)) {
        *number = 0;
        return true;
    }
    if (size < 0 && errno != EINVAL)
        return fail_errno(err, "%s", link);
    int named = size < 0 ? 0 : store_number(target);
    store_version_path(place, named, "", folder, sizeof folder);
    if (!named || stat(folder, &what) || !S_ISDIR(what.st_mode))
        return fail(err, ERROR_DATA, "%s: names no version (\"%s\")", link, target);
    *number = named;
    return true;
}

static int is_version(const struct dirent *entry)
{
    return store_number(entry->d_name) > 0;
}

static int ascending(const void *a, const void *b)
{
    return *(const int *)a - *(const int *)b;
}

bool store_numbers(const struct store_place *place, int **numbers, int *count, struct error *err)
{
    struct dirent **entries = NULL;
    int n = scandir(place->folder, &entries, is_version, NULL);
    if (n < 0 && errno != ENOENT)
        return fail_errno(err, "%s", place->folder);
    n = n < 0 ? 0 : n;
    int *found = malloc((size_t)(n + 1) * sizeof *found);
    for (int i = 0; i < n; i++) {
        if (found)
            found[i] = store_number(entries[i]->d_name);
        free(entries[i]);
    }
    free(entries);
    if (!found)
        return fail(err, ERROR_SYSTEM, "out of memory for %d versions", n);
    qsort(found, (size_t)n, sizeof *found, ascending);
    *numbers = found;
    *count = n;
    return true;
}

// ---- manifest ---------------------------------------------------------------

static bool no_such_version(const struct store_place *place, int number, struct error *err)
{
    return fail(err, ERROR_CONFIG, "%s: there is no version %04d", place->folder, number);
}

static bool check_times(const struct store_manifest *m, const char *path, struct error *err)
{
    int64_t at;
    if (!clock_utc_parse(m->created, &at))
        return fail(err, ERROR_DATA, "%s: created: \"%s\" is no time (UTC)", path, m->created);
    if (*m->valid_until && !clock_utc_parse(m->valid_until, &at))
        return fail(err, ERROR_DATA, "%s: valid_until: \"%s\" is no time (UTC)", path,
                    m->valid_until);
    return true;
}

bool store_manifest(const struct store_place *place, int number, struct store_manifest *out,
                    struct error *err)
{
    struct store_manifest m = {0};
    char path[STORE_PATH + 64];
    const struct settings_section sections[] = {{"calibration", store_manifest_settings, &m}, {0}};
    struct stat what;
    store_version_path(place, number, "", path, sizeof path);
    if (number < 1 || stat(path, &what))
        return no_such_version(place, number, err);
    store_version_path(place, number, STORE_MANIFEST, path, sizeof path);
    if (!ini_load(path, sections, err)) {
        if (err)
            err->code = ERROR_DATA;
        return false;
    }
    if (m.version != number)
        return fail(err, ERROR_DATA, "%s: version: %d is not its folder's", path, m.version);
    if (!check_times(&m, path, err))
        return false;
    *out = m;
    return true;
}

static bool check_owner(const struct store_place *place, const struct store_manifest *m,
                        struct error *err)
{
    if (strcmp(m->booth, place->booth))
        return fail(err, ERROR_CONFIG, "foreign: it is of the booth \"%s\", not of \"%s\"",
                    m->booth, place->booth);
    if (strcmp(m->display, place->display))
        return fail(err, ERROR_CONFIG, "foreign: it is of the display \"%s\", not of \"%s\"",
                    m->display, place->display);
    return true;
}

bool store_expired(const struct store_manifest *m, int64_t utc_s)
{
    int64_t until;
    return *m->valid_until && clock_utc_parse(m->valid_until, &until) && utc_s > until;
}

double store_age_days(const struct store_manifest *m, int64_t utc_s)
{
    int64_t created;
    return clock_utc_parse(m->created, &created) ? (double)(utc_s - created) / 86400 : NAN;
}

// ---- sums -------------------------------------------------------------------

void store_version_fini(struct store_version *version)
{
    free(version->files);
    *version = (struct store_version){0};
}

// One line of SHA256SUMS: 64 digits, two blanks, the path.
static bool take_sum(const char *line, size_t size, struct store_file *out)
{
    const char *path = line + SUM + 2;
    if (size <= SUM + 2 || size - SUM - 2 >= sizeof out->path ||
        strspn(line, "0123456789abcdef") != SUM || memcmp(line + SUM, "  ", 2))
        return false;
    memcpy(out->sum.hex, line, SUM);
    out->sum.hex[SUM] = 0;
    memcpy(out->path, path, size - SUM - 2);
    out->path[size - SUM - 2] = 0;
    return true;
}

static bool take_sums(const char *path, const char *text, struct store_version *v,
                      struct error *err)
{
    for (int line = 1; *text; line++) {
        size_t size = strcspn(text, "\n");
        if (v->count == STORE_FILES_MOST || text[size] != '\n' ||
            !take_sum(text, size, &v->files[v->count]))
            return fail(err, ERROR_DATA, "%s:%d: is no checksum and path", path, line);
        if (v->count && strcmp(v->files[v->count - 1].path, v->files[v->count].path) >= 0)
            return fail(err, ERROR_DATA, "%s:%d: is not in order", path, line);
        v->count++;
        text += size + 1;
    }
    return true;
}

static bool load_sums(struct store_version *v, struct error *err)
{
    char path[sizeof v->folder + 16];
    size_t size;
    snprintf(path, sizeof path, "%s/" STORE_SUMS, v->folder);
    char *text = file_read(path, SUMS_BYTES_MOST, &size, err);
    if (!text) {
        if (err && err->code == ERROR_CONFIG)
            err->code = ERROR_DATA;
        return false;
    }
    v->files = malloc(STORE_FILES_MOST * sizeof *v->files);
    bool fine = v->files
                    ? take_sums(path, text, v, err) && sha256_of_bytes(text, size, &v->sum, err)
                    : fail(err, ERROR_SYSTEM, "out of memory for the files of %s", v->folder);
    free(text);
    struct store_file *less =
        fine ? realloc(v->files, (size_t)(v->count + 1) * sizeof *less) : NULL;
    v->files = less ? less : v->files;
    return fine;
}

const struct sha256 *store_sum(const struct store_version *v, const char *path)
{
    struct store_file key;
    if (strlen(path) >= sizeof key.path || !v->count)
        return NULL;
    strcpy(key.path, path);
    const struct store_file *found =
        bsearch(&key, v->files, (size_t)v->count, sizeof key, store_file_order);
    return found ? &found->sum : NULL;
}

struct verification {
    const struct store_version *version;
    int seen;
};

static bool verify_file(void *context, const char *whole, const char *path, struct error *err)
{
    struct verification *v = context;
    struct sha256 found;
    if (!strcmp(path, STORE_SUMS))
        return true;
    const struct sha256 *listed = store_sum(v->version, path);
    if (!listed)
        return fail(err, ERROR_DATA, "%s: is not listed in " STORE_SUMS, whole);
    if (!sha256_of_file(whole, &found, err))
        return false;
    if (strcmp(found.hex, listed->hex))
        return fail(err, ERROR_DATA, "%s: was changed: its checksum is another one", whole);
    v->seen++;
    return true;
}

// Every file found is listed; as many as listed: all are there.
static bool verify(const struct store_version *v, struct error *err)
{
    struct verification found = {v, 0};
    struct stat what;
    char whole[sizeof v->folder + sizeof v->files->path + 1];
    if (!store_walk(v->folder, verify_file, &found, err))
        return false;
    for (int i = 0; found.seen < v->count && i < v->count; i++) {
        snprintf(whole, sizeof whole, "%s/%s", v->folder, v->files[i].path);
        if (lstat(whole, &what))
            return fail(err, ERROR_DATA, "%s: is missing", whole);
    }
    return found.seen == v->count ||
           fail(err, ERROR_DATA, "%s: changes while it is read", v->folder);
}

bool store_open(const struct store_place *place, int number, struct store_version *out,
                struct error *err)
{
    struct store_version v = {0};
    store_version_path(place, number, "", v.folder, sizeof v.folder);
    bool fine = store_manifest(place, number, &v.manifest, err);
    bool ours = fine && (check_owner(place, &v.manifest, err) || while_doing(err, "%s", v.folder));
    if (ours && load_sums(&v, err) && verify(&v, err)) {
        *out = v;
        return true;
    }
    store_version_fini(&v);
    return false;
}
