// SPDX-License-Identifier: Apache-2.0
#include "config/booth_store.h"

#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "config/geometry.h"
#include "config/paths.h"

bool booth_store_place(const struct booth_settings *b, struct store_place *out, struct error *err)
{
    if (!*b->calibration.store)
        return fail(err, ERROR_CONFIG, "[calibration] store: the settings name none");
    return store_place(b->calibration.store, b->booth.name, b->display.serial, out, err) ||
           while_doing(err, "[calibration] store, [booth] name, [display] serial");
}

void booth_valid_until(const struct booth_settings *b, int64_t utc_s, char text[24])
{
    *text = 0;
    if (b->calibration.valid_days > 0)
        clock_utc_text(utc_s + (int64_t)(b->calibration.valid_days * 86400), text);
}

bool booth_is_placed(const struct booth_settings *b)
{
    return !*b->calibration.store || b->given & 1u << STORED_CENTRE;
}

static bool given(const struct booth_settings *b, enum booth_stored row)
{
    return b->given & 1u << row;
}

// What the version holds under that name, or what is given instead.
static bool take_path(struct booth_settings *b, enum booth_stored row, char *field, size_t size,
                      const char *name, struct booth_calibration *c, struct error *err)
{
    char path[sizeof c->folder + 32];
    snprintf(path, sizeof path, "%s/%s", c->folder, name);
    if (!path_exists(path))
        return true;
    if (!given(b, row))
        return path_absolute(path, field, size, err);
    c->overruled |= 1u << row;
    return true;
}

static bool take_geometry(struct booth_settings *b, struct booth_calibration *c, struct error *err)
{
    struct geometry found;
    char path[sizeof c->folder + 32];
    snprintf(path, sizeof path, "%s/" STORE_GEOMETRY, c->folder);
    if (!path_exists(path))
        return true;
    if (!geometry_load(path, &found, err))
        return false;
    c->overruled |= geometry_differs(b, &found.booth, found.rows & b->given);
    geometry_take(b, &found.booth, found.rows & ~b->given);
    b->given |= found.rows;
    c->has_geometry = true;
    return true;
}

static bool is_placed(const struct booth_settings *b, struct error *err)
{
    return booth_is_placed(b) ||
           fail(err, ERROR_CONFIG,
                "[stand] centre_from_hinge_m: neither the settings nor a calibration (boothcal "
                "tilt) say where the screen is");
}

static bool take_version(struct booth_settings *booth, const struct store_version *v,
                         struct booth_calibration *c, struct error *err)
{
    struct booth_settings b = *booth;
    c->number = v->manifest.version;
    c->manifest = v->manifest;
    c->sum = v->sum;
    strcpy(c->folder, v->folder);
    if (!take_path(&b, STORED_MODEL, b.display.model, sizeof b.display.model, STORE_DISPLAY, c,
                   err) ||
        !take_path(&b, STORED_VIEW, b.display.view, sizeof b.display.view, STORE_VIEW, c, err) ||
        !take_path(&b, STORED_LAMPS, b.lamps.folder, sizeof b.lamps.folder, STORE_LAMPS, c, err) ||
        !take_geometry(&b, c, err) || !is_placed(&b, err))
        return false;
    *booth = b;
    return true;
}

static bool fit_to_use(const struct booth_settings *b, const struct store_version *v, int64_t utc_s,
                       struct error *err)
{
    bool expired = b->calibration.expired == EXPIRED_REFUSE && store_expired(&v->manifest, utc_s);
    return !expired || fail(err, ERROR_CONFIG, "%s: expired: it was valid until %s", v->folder,
                            v->manifest.valid_until);
}

bool booth_from_store(struct booth_settings *booth, int64_t utc_s, struct booth_calibration *out,
                      struct error *err)
{
    struct booth_calibration c = {.used = *booth->calibration.store, .named = -1};
    struct store_version version = {0};
    struct store_place place;
    bool fine =
        !c.used || (booth_store_place(booth, &place, err) && store_current(&place, &c.named, err));
    if (fine && c.used && c.named)
        fine = store_open(&place, c.named, &version, err) &&
               fit_to_use(booth, &version, utc_s, err) && take_version(booth, &version, &c, err);
    else
        fine = fine && is_placed(booth, err);
    store_version_fini(&version);
    *out = fine ? c : (struct booth_calibration){.used = c.used, .named = c.named};
    return fine;
}
