// SPDX-License-Identifier: Apache-2.0
// What was loaded: settings, display model, lamps with their light points, and
// the material on show, baked for the lamp that is on. Each stage remembers
// what it was made from and is made again only when that changes. Main thread.
#ifndef DAEMON_SETUP_H
#define DAEMON_SETUP_H

#include "config/booth_store.h"
#include "config/lamps.h"
#include "config/materials.h"
#include "daemon/state.h"
#include "render/scene.h"

enum { OVERRIDES_MOST = 32 };

// Where settings come from; borrowed texts.
struct setup_source {
    const char *path;
    const char *overrides[OVERRIDES_MOST]; // "section.key=value"
    int override_count;
};

enum show_kind { SHOW_NOTHING, SHOW_PATCH, SHOW_MATERIAL };

struct setup {
    struct booth_settings settings;
    struct booth_calibration calibration; // of the store
    struct error refused; // why a calibration of the store is not in force; code NONE while it is
    bool unplaced;        // nobody says where the screen is
    bool expired;         // the calibration in force may be used no longer
    struct band_set bands;
    bool has_display;
    struct display_model display;
    bool has_view;
    struct display_view view;
    uint64_t display_generation; // of both
    struct lamps lamps;
    struct light_points *lights; // per lamp; count 0 without a luminance map
    uint64_t lights_generation;  // of lamp 0; lamp i has i more
    enum show_kind show;
    struct counts counts;    // PATCH
    char material_name[512]; // as asked for
    char patch_name[64];     // "" = whole
    struct material material;
    float *texels; // baked, NULL = not for any lamp
    struct xyz white;
    int baked_lamp;
    uint64_t texels_generation;
    uint64_t generations; // last one given
};

// Loads settings, display model, lamps and the material to start with. What is
// named but not there yet (display model file, lamp folder) is left out; what
// is there but wrong is an error. A calibration of the store that cannot be used
// is left out too, and `refused` says why. setup is untouched on failure. utc_s:
// see clock_utc_s.
bool setup_load(const struct setup_source *source, int64_t utc_s, struct setup **out,
                struct error *err);

// As setup_load, keeping what is on show; generations go on from old's. A
// calibration that cannot be used is an error here. Of old, only show, the names
// and counts of what is shown, and generations are read.
bool setup_reload(const struct setup_source *source, int64_t utc_s, const struct setup *old,
                  struct setup **out, struct error *err);

// Bakes what is on show for the lamp of that name, so that the first frame need not.
bool setup_bake_for(struct setup *setup, const char *lamp, struct error *err);

// Gives everything loaded new generations, from the one after `last` on.
void setup_renumber(struct setup *setup, uint64_t last);

// Looks whether the calibration has expired. True when that has changed.
bool setup_age(struct setup *setup, int64_t utc_s);

void setup_free(struct setup *setup); // accepts NULL

// What to show from now on. Unchanged on failure. patch "" = whole material.
bool setup_show(struct setup *setup, const char *material, const char *patch, struct error *err);
void setup_patch(struct setup *setup, struct counts counts);

// The scene for a state: SURFACE when material, display model and a lamp with
// light points are there, else DARK. Bakes the material when lamp or material
// changed. Pointers in *out are borrowed from setup until its next change.
bool setup_scene(struct setup *setup, const struct state *state, struct scene *out,
                 struct error *err);

// One reason why no true proof can be shown, or is shown now, per call;
// index 0, 1, …; false when there are no more.
bool setup_warning(const struct setup *setup, int index, char *text, size_t size);

#endif
