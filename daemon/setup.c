// SPDX-License-Identifier: Apache-2.0
#include "daemon/setup.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "config/display_file.h"
#include "config/paths.h"
#include "config/view_file.h"

static const double CONDITION_WARNING = 10;

static bool load_display(struct setup *s, struct error *err)
{
    s->display_generation = ++s->generations;
    if (!path_exists(s->settings.display.model))
        return true;
    s->has_display = display_load(s->settings.display.model, &s->display, NULL, err);
    if (s->has_display && path_exists(s->settings.display.view)) {
        s->has_view = view_load(s->settings.display.view, &s->view, NULL, err);
        return s->has_view;
    }
    return s->has_display;
}

static bool declared_is_there(const struct setup *s, struct error *err)
{
    const char *declared = s->settings.lamps.declared;
    if (s->calibration.used && !s->calibration.number) // it is to be calibrated yet
        return true;
    for (int i = 0; i < s->lamps.count; i++)
        if (!strcmp(declared, s->lamps.lamps[i].file.name))
            return true;
    return !*declared || fail(err, ERROR_CONFIG, "[lamps] declared = %s: was not taught in %s",
                              declared, s->settings.lamps.folder);
}

static bool materials_are_there(const struct setup *s, struct error *err)
{
    struct stat what;
    const char *folder = s->settings.materials.folder;
    bool there = !*folder || (!stat(folder, &what) && S_ISDIR(what.st_mode));
    return there || fail(err, ERROR_CONFIG, "[materials] folder = %s: is no folder", folder);
}

static bool load_lamps(struct setup *s, struct error *err)
{
    const struct booth_settings *b = &s->settings;
    if (!path_exists(b->lamps.folder))
        return true;
    if (!lamps_load(b->lamps.folder, &s->lamps, err))
        return false;
    s->lights = calloc(s->lamps.count + 1, sizeof *s->lights);
    if (!s->lights)
        return fail(err, ERROR_SYSTEM, "no memory for light points");
    for (int i = 0; i < s->lamps.count; i++)
        if (*s->lamps.lamps[i].file.map &&
            !lamp_lights(&s->lamps.lamps[i], &b->ceiling, b->quality.cut, b->quality.lights,
                         &s->lights[i], err))
            return false;
    s->lights_generation = s->generations + 1;
    s->generations += s->lamps.count;
    return true;
}

void setup_free(struct setup *s)
{
    if (!s)
        return;
    for (int i = 0; s->lights && i < s->lamps.count; i++)
        light_points_fini(&s->lights[i]);
    free(s->lights);
    lamps_fini(&s->lamps);
    material_fini(&s->material);
    free(s->texels);
    free(s);
}

static bool show_again(struct setup *s, const struct setup *old, struct error *err)
{
    if (old && old->show == SHOW_MATERIAL)
        return setup_show(s, old->material_name, old->patch_name, err);
    if (old && old->show == SHOW_PATCH)
        setup_patch(s, old->counts);
    if (!old && *s->settings.materials.show)
        return setup_show(s, s->settings.materials.show, "", err) ||
               while_doing(err, "[materials] show");
    return true;
}

// Settings that name what is not there; path is theirs.
static bool consistent(const struct setup *s, const char *path, struct error *err)
{
    return (declared_is_there(s, err) && materials_are_there(s, err)) ||
           while_doing(err, "%s", path);
}

bool setup_age(struct setup *s, int64_t utc_s)
{
    bool before = s->expired;
    s->expired = s->calibration.number && store_expired(&s->calibration.manifest, utc_s);
    return s->expired != before;
}

// At the start the daemon goes on without a calibration that is no good: a
// new one is measured through it.
static bool take_calibration(struct setup *s, int64_t utc_s, bool start, struct error *err)
{
    struct error why = {0};
    if (!booth_from_store(&s->settings, utc_s, &s->calibration, &why)) {
        fail(&s->refused, why.code, "calibration refused: %s", why.text);
        if (!start)
            return fail(err, s->refused.code, "%s", s->refused.text);
    }
    s->unplaced = !booth_is_placed(&s->settings);
    setup_age(s, utc_s);
    return true;
}

static bool load(struct setup *s, const struct setup_source *source, int64_t utc_s,
                 const struct setup *old, struct error *err)
{
    return booth_load(source->path, source->overrides, source->override_count, &s->settings, err) &&
           booth_bands(&s->settings, &s->bands, err) && take_calibration(s, utc_s, !old, err) &&
           load_display(s, err) && load_lamps(s, err) && consistent(s, source->path, err) &&
           (show_again(s, old, err) || while_doing(err, "%s", source->path));
}

bool setup_reload(const struct setup_source *source, int64_t utc_s, const struct setup *old,
                  struct setup **out, struct error *err)
{
    struct setup *s = calloc(1, sizeof *s);
    if (!s)
        return fail(err, ERROR_SYSTEM, "no memory for the setup");
    s->baked_lamp = -1;
    s->generations = old ? old->generations : 0;
    if (load(s, source, utc_s, old, err)) {
        *out = s;
        return true;
    }
    setup_free(s);
    return false;
}

bool setup_load(const struct setup_source *source, int64_t utc_s, struct setup **out,
                struct error *err)
{
    return setup_reload(source, utc_s, NULL, out, err);
}

void setup_renumber(struct setup *s, uint64_t last)
{
    s->generations = last;
    s->display_generation = ++s->generations;
    s->lights_generation = s->generations + 1;
    s->generations += s->lamps.count;
    s->texels_generation = ++s->generations;
}

static void forget_bake(struct setup *s)
{
    free(s->texels);
    s->texels = NULL;
    s->baked_lamp = -1;
}

bool setup_show(struct setup *s, const char *name, const char *patch, struct error *err)
{
    struct material whole = {0}, one = {0};
    if (!material_load(&s->settings, name, &whole, err))
        return false;
    bool fine = !*patch || material_patch(&whole, patch, &one, err);
    if (fine) {
        material_fini(&s->material);
        s->material = *patch ? one : whole;
        snprintf(s->material_name, sizeof s->material_name, "%s", name);
        snprintf(s->patch_name, sizeof s->patch_name, "%s", patch);
        s->show = SHOW_MATERIAL;
        forget_bake(s);
    }
    if (!fine || *patch)
        material_fini(&whole);
    return fine;
}

void setup_patch(struct setup *s, struct counts counts)
{
    s->show = SHOW_PATCH;
    s->counts = counts;
}

static bool bake(struct setup *s, int lamp, struct error *err)
{
    if (s->texels && s->baked_lamp == lamp)
        return true;
    struct xyz white;
    float *texels =
        material_bake(&s->material, &s->lamps.lamps[lamp].irradiance, s->settings.quality.observer,
                      s->settings.quality.spectral, &s->bands, &white, err);
    if (!texels)
        return while_doing(err, "showing %s under %s", s->material_name,
                           s->lamps.lamps[lamp].file.name);
    forget_bake(s);
    s->texels = texels;
    s->white = white;
    s->baked_lamp = lamp;
    s->texels_generation = ++s->generations;
    return true;
}

bool setup_bake_for(struct setup *s, const char *lamp, struct error *err)
{
    for (int i = 0; s->show == SHOW_MATERIAL && i < s->lamps.count; i++)
        if (!strcmp(s->lamps.lamps[i].file.name, lamp))
            return bake(s, i, err);
    return true;
}

static void lay_material(const struct setup *s, struct scene *out)
{
    const struct material *m = &s->material;
    out->texels = s->texels;
    out->texels_width = m->width;
    out->texels_height = m->height;
    out->texels_generation = s->texels_generation;
    out->texel_offset = (struct vec3){0.5, 0.5, 0};
    out->texel_scale_x = m->width_m > 0 ? m->width_m : s->settings.screen.width_m;
    out->texel_scale_y = m->height_m > 0 ? m->height_m : s->settings.screen.height_m;
    out->white = s->white;
}

static bool too_old(const struct setup *s)
{
    return s->expired && s->settings.calibration.expired == EXPIRED_REFUSE;
}

static bool can_proof(const struct setup *s, const struct state *state)
{
    int lamp = state->lamp.index;
    return s->show == SHOW_MATERIAL && s->has_display && !s->unplaced && !too_old(s) && lamp >= 0 &&
           lamp < s->lamps.count && s->lights[lamp].count > 0;
}

bool setup_scene(struct setup *s, const struct state *state, struct scene *out, struct error *err)
{
    const struct booth_settings *b = &s->settings;
    *out = (struct scene){
        .kind = s->show == SHOW_PATCH ? SCENE_PATCH : SCENE_DARK,
        .patch = s->counts,
        .screen = b->screen,
        .booth_from_screen = stand_pose(&b->stand.stand, state->tilt.deg),
        .eye = state->eye.at,
        .screen_reflectance = b->display.reflectance,
        .display = s->has_display ? &s->display : NULL,
        .view = s->has_view ? &s->view : NULL,
        .display_generation = s->display_generation,
        .bits = booth_bits(b),
        .dither = b->display.dither,
    };
    if (!can_proof(s, state))
        return true;
    if (!bake(s, state->lamp.index, err))
        return false;
    out->kind = SCENE_SURFACE;
    out->lights = &s->lights[state->lamp.index];
    out->lights_generation = s->lights_generation + state->lamp.index;
    out->level = state->lamp.level;
    lay_material(s, out);
    return true;
}

static bool lamp_without_map(const struct setup *s, int index, char *text, size_t size)
{
    for (int i = 0; i < s->lamps.count; i++)
        if (!*s->lamps.lamps[i].file.map && index-- == 0) {
            snprintf(text, size, "lamp %s has no luminance map: nothing can be shown under it",
                     s->lamps.lamps[i].file.name);
            return true;
        }
    return false;
}

static bool calibration_warning(const struct setup *s, int *index, char *text, size_t size)
{
    const struct booth_calibration *c = &s->calibration;
    if (s->refused.code && (*index)-- == 0) {
        snprintf(text, size, "%s", s->refused.text);
        return true;
    }
    if (s->expired && (*index)-- == 0) {
        snprintf(text, size, "the calibration has expired%s: it was valid until %s",
                 too_old(s) ? " and is refused" : "", c->manifest.valid_until);
        return true;
    }
    if (c->used && !c->named && (*index)-- == 0) {
        snprintf(text, size, "the store holds no calibration yet: %s",
                 s->settings.calibration.store);
        return true;
    }
    if (c->overruled && (*index)-- == 0) {
        char rows[160];
        booth_stored_list(c->overruled, rows, sizeof rows);
        snprintf(text, size, "the settings' own count instead of the calibration's: %s", rows);
        return true;
    }
    return false;
}

bool setup_warning(const struct setup *s, int index, char *text, size_t size)
{
    const struct booth_settings *b = &s->settings;
    if (calibration_warning(s, &index, text, size))
        return true;
    if (!s->has_display && index-- == 0) {
        if (*b->display.model)
            snprintf(text, size, "the display model %s is not there yet", b->display.model);
        else
            snprintf(text, size, "the settings name no display model");
        return true;
    }
    if (s->has_display && *b->display.view && !s->has_view && index-- == 0) {
        snprintf(text, size, "the display's dependence on the angle, %s, is not there yet",
                 b->display.view);
        return true;
    }
    if (s->has_display && s->display.condition > CONDITION_WARNING && index-- == 0) {
        snprintf(text, size,
                 "the display's primaries are close together: condition %.1f is above %g",
                 s->display.condition, CONDITION_WARNING);
        return true;
    }
    if (!s->lamps.count && index-- == 0) {
        snprintf(text, size, "no lamp was taught yet in %s",
                 *b->lamps.folder ? b->lamps.folder : "the store");
        return true;
    }
    return lamp_without_map(s, index, text, size);
}
