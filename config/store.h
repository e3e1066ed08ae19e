// SPDX-License-Identifier: Apache-2.0
// The store of calibrations:
//
//   STORE/BOOTH/DISPLAY/0001, 0002, …   versions: complete sets of files
//   STORE/BOOTH/DISPLAY/current         link to the version in force
//
// A version holds display.ini, lamps/, geometry.ini, measurements and reports,
// besides manifest.ini (struct store_manifest) and SHA256SUMS, as sha256sum(1)
// reads it, which lists every file but itself. Nothing of a version changes
// once it has its number. A writer works in a draft beside the versions,
// fsyncs every file and folder of it, and renames first the draft and then the
// link: killed at any instant it leaves the versions and the link whole, and
// what litter it leaves the next writer sweeps away.
#ifndef CONFIG_STORE_H
#define CONFIG_STORE_H

#include <stdint.h>

#include "base/settings.h"
#include "files/sha256.h"

enum { STORE_PATH = 1024, STORE_FILES_MOST = 10000 };

#define STORE_DISPLAY "display.ini"      // of a version: the display model
#define STORE_VIEW "view.ini"            // its dependence on direction and place
#define STORE_LAMPS "lamps"              // the lamp folder
#define STORE_GEOMETRY "geometry.ini"    // stand and tracker
#define STORE_MEASUREMENTS "display.ti3" // what the model was fitted to
#define STORE_VERIFICATION "verify.ti3"  // what it was checked on

// Where the calibrations of one booth and display lie.
struct store_place {
    char folder[STORE_PATH];      // STORE/BOOTH/DISPLAY; need not be there yet
    char booth[64], display[128]; // as the settings name them
};

// The folders are named after booth and display, anything but letters, digits,
// '.', '-' and '_' as '-'. Error CONFIG when a name is empty or a path too long.
bool store_place(const char *store, const char *booth, const char *display, struct store_place *out,
                 struct error *err);

// manifest.ini, section [calibration].
struct store_manifest {
    int version;          // equal to the folder's number, 1..999999
    int based_on;         // version it started from, 0 = none
    char booth[64];       // what it is for
    char display[128];    // panel and serial number
    char created[24];     // UTC
    char valid_until[24]; // UTC, "" = for ever
    char software[64];
    char note[256]; // one line
};

extern const struct setting store_manifest_settings[];

struct store_file {
    char path[256]; // within the version
    struct sha256 sum;
};

// A version, verified. Owned by whoever opened it.
struct store_version {
    char folder[STORE_PATH + 16];
    struct store_manifest manifest;
    struct sha256 sum; // of SHA256SUMS: names the whole set
    int count;
    struct store_file *files; // in the order of their paths
};

void store_version_fini(struct store_version *version); // accepts a zeroed one

// Number of the version in force, 0 while there is none. Errors (DATA): the
// link names no version.
bool store_current(const struct store_place *place, int *number, struct error *err);

// Opens version `number` and verifies all of it. Errors (DATA), naming the
// file: missing, changed, not listed, no regular file; (CONFIG): there is no
// such version, or it is of another booth or display. What has expired is
// opened: see store_expired.
bool store_open(const struct store_place *place, int number, struct store_version *out,
                struct error *err);

// Its manifest alone, without a look at the files or whom it is for.
bool store_manifest(const struct store_place *place, int number, struct store_manifest *out,
                    struct error *err);

// Numbers of all versions, ascending, malloc'd. A store that is not there has none.
bool store_numbers(const struct store_place *place, int **numbers, int *count, struct error *err);

// The sum of a file of the version, NULL when it holds none of that path.
const struct sha256 *store_sum(const struct store_version *version, const char *path);

// utc_s: see clock_utc_s.
bool store_expired(const struct store_manifest *manifest, int64_t utc_s);

// Its age in days; NAN when the manifest does not say when it was made.
double store_age_days(const struct store_manifest *manifest, int64_t utc_s);

// ---- writing ----------------------------------------------------------------

// A version in the making. One writer at a time has one.
struct store_draft {
    struct store_place place;
    char folder[STORE_PATH + 32]; // work here: only by writing files anew (files/write.h),
                                  // since unchanged ones are shared with the base
    struct store_manifest base;   // of the version it started from; version 0 = none
    int lock;                     // descriptor, -1 = none
};

// Locks the place (its folders are made; STORE's own parents are not), sweeps
// what killed writers left, and starts a draft: from the version in force, or
// from nothing. A version in force that store_open refuses is no start: CONFIG,
// with what to do. RETRY while another writer is at work.
bool store_begin(const struct store_place *place, bool from_current, struct store_draft *out,
                 struct error *err);

// Copies a file into the draft as `path`, such as "lamps/D50.sp".
bool store_put(struct store_draft *draft, const char *from, const char *path, struct error *err);

// Makes the draft the next version and puts it in force. Of facts, created,
// valid_until, software and note count. *number may be NULL. The draft is
// ended in any case; on failure nothing has changed, but that a complete version may be
// there without being in force.
bool store_commit(struct store_draft *draft, const struct store_manifest *facts, int *number,
                  struct error *err);

// Ends a draft without a trace. Accepts one that is ended.
void store_abandon(struct store_draft *draft);

// Puts a version in force that store_open accepts. RETRY while another writer
// is at work.
bool store_use(const struct store_place *place, int number, struct error *err);

#endif
