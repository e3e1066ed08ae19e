// SPDX-License-Identifier: Apache-2.0
// What of a booth's settings comes from its store of calibrations.
#ifndef CONFIG_BOOTH_STORE_H
#define CONFIG_BOOTH_STORE_H

#include "config/booth.h"
#include "config/store.h"

// The calibration in force. Plain data.
struct booth_calibration {
    bool used;  // the settings name a store
    int number; // its version in force, 0 = none
    int named;  // what `current` named when it was looked at, -1 = no version
    char folder[STORE_PATH + 16];
    struct store_manifest manifest; // of that version
    struct sha256 sum;              // names all of it
    bool has_geometry;              // it holds a geometry.ini
    unsigned overruled; // 1 << enum booth_stored: the settings' own count instead of the store's,
                        // and say something else
};

// Where the settings keep their calibrations. Error CONFIG when they name no
// store, or not the booth or the display.
bool booth_store_place(const struct booth_settings *booth, struct store_place *out,
                       struct error *err);

// Takes display model and view, lamp folder, stand and tracker from the version in force
// where the settings name a store; a setting that file or override gives counts
// instead. Verifies all of the version. Without a store, or before its first
// version, nothing happens. False when the version in force cannot be used: it
// was changed (DATA), is foreign, or expired where the settings refuse that (CONFIG),
// or nobody says where the screen is (CONFIG); then only used and named of
// *out count.
bool booth_from_store(struct booth_settings *booth, int64_t utc_s, struct booth_calibration *out,
                      struct error *err);

// Whether settings or calibration say where the screen is.
bool booth_is_placed(const struct booth_settings *booth);

// valid_until of a calibration made now, "" = for ever.
void booth_valid_until(const struct booth_settings *booth, int64_t utc_s, char text[24]);

#endif
