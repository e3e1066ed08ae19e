// SPDX-License-Identifier: Apache-2.0
// Results put into a draft of the store, each looked through first, so that no
// version holds what boothd would refuse.
#ifndef CALIBRATION_STORE_KEEP_H
#define CALIBRATION_STORE_KEEP_H

#include "config/booth.h"
#include "config/store.h"

// Settings as boothd goes by them: display model, lamps and geometry of the store's
// version in force where nothing else is given, even of one that has expired.
// One that is no good otherwise is left out. `given` stays what the file gives.
// *placed: whether anything says where the screen is.
bool store_settings(const char *config, struct booth_settings *booth, bool *placed,
                    struct error *err);

// Facts of a version made now by boothcal. renews: it is valid anew, as long as the settings
// say; else as long as the one it is based on.
struct store_manifest store_facts(const struct booth_settings *booth,
                                  const struct store_draft *draft, bool renews, const char *note);

// A lamp by its NAME.ini, with its spectrum and its map, so that the version
// stands alone. It may lie in the draft already.
bool store_keep_lamp(struct store_draft *draft, const char *ini, struct error *err);

// A display model, a geometry.ini.
bool store_keep_display(struct store_draft *draft, const char *path, struct error *err);
bool store_keep_geometry(struct store_draft *draft, const char *path, struct error *err);

// Any other file, under its own name.
bool store_keep_file(struct store_draft *draft, const char *path, struct error *err);

#endif
