// SPDX-License-Identifier: Apache-2.0
#include "calibration/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/facts_json.h"
#include "calibration/report_steps.h"
#include "config/display_file.h"

static const uint64_t SEED = 20060101;

void report_fini(struct report *r)
{
    for (int i = 0; i < FACTS_LAMPS; i++) {
        budget_fini(&r->lamps[i].measured);
        budget_fini(&r->lamps[i].shown);
    }
}

// ---- what it was made from ---------------------------------------------------------

static void note_input(struct report *r, const char *path)
{
    if (!*path || sealed_inputs_add(&r->inputs, path, NULL))
        return;
    for (int i = 0; i < r->missing_count; i++)
        if (!strcmp(r->missing[i], path))
            return;
    if (r->missing_count < REPORT_MISSING)
        snprintf(r->missing[r->missing_count++], sizeof *r->missing, "%s", path);
}

static void note_beside(struct report *r, const char *folder, const char *name)
{
    char path[512];
    if (*folder && snprintf(path, sizeof path, "%s/%s", folder, name) < (int)sizeof path)
        note_input(r, path);
}

static void note_inputs(struct report *r, const char *folder)
{
    const struct session_facts *f = r->facts;
    note_beside(r, folder, "session.json");
    note_input(r, f->config);
    note_input(r, f->display.measurements);
    note_beside(r, folder, "verify.ti3");
    note_input(r, f->display.model);
    note_input(r, r->uncertainty_file);
    for (int i = 0; i < f->lamp_count; i++) {
        note_input(r, f->lamps[i].map);
        note_input(r, f->lamps[i].picture);
    }
}

static void digest_settings(struct report *r)
{
    struct sha256 digest;
    const json_t *settings = json_object_get(r->facts->settings, "settings");
    char *text = json_dumps(settings, JSON_COMPACT | JSON_SORT_KEYS | JSON_ENCODE_ANY);
    if (text && sha256_of_bytes(text, strlen(text), &digest, NULL))
        memcpy(r->settings_sha256, digest.hex, sizeof r->settings_sha256);
    free(text);
}

// ---- the budgets -------------------------------------------------------------------

// False when the reading has no spectrum.
static bool radiance_of(const json_t *reading, struct spectrum *out)
{
    const json_t *nm = json_object_get(reading, "nm"), *v = json_object_get(reading, "values");
    size_t n = json_array_size(nm);
    double *room = n >= 2 && json_array_size(v) == n ? calloc(2 * n, sizeof *room) : NULL;
    for (size_t i = 0; room && i < n; i++) {
        room[i] = json_number_value(json_array_get(nm, i));
        room[n + i] = json_number_value(json_array_get(v, i));
    }
    bool fine = room && spectrum_from_samples(room, room + n, n, false, out, NULL);
    free(room);
    return fine;
}

struct budget_room {
    struct budget_patch patches[FACTS_PATCHES];
    struct spectrum radiances[FACTS_PATCHES];
    int modes;
    struct xyz *mode; // owned
};

// The display model as its file has it.
struct known_display {
    struct display_model model;
    struct display_origin origin;
};

// Own findings before presets: the radiometer repeated itself while it looked
// at white.
static struct uncertainties found_out(const struct report *r, const struct lamp_report *from)
{
    struct uncertainties u = r->u;
    if (from->repeats > 2) {
        u.radiometer_repeat = fmax(u.radiometer_repeat, from->repeat_level);
        u.radiometer_colour = fmax(u.radiometer_colour, from->repeat_colour);
    }
    u.level = fmax(u.level, fabs(from->chart_drift_percent) / 100 / sqrt(3));
    u.display_drift = fmax(u.display_drift, r->facts->display.white_drift_percent / 100 / sqrt(12));
    return u;
}

static struct budget_input input_of(const struct report *r, const struct lamp_report *from,
                                    const struct report_lamp *lamp, const struct budget_room *room)
{
    const struct session_facts *f = r->facts;
    struct rigid pose = stand_pose(&f->place.stand, f->place.tilt_deg);
    struct vec3 to_eye = vec3_sub(f->place.eye, pose.translation);
    struct vec3 normal = mat3_apply(pose.rotation, (struct vec3){0, 0, 1});
    double distance = vec3_length(to_eye);
    struct budget_input in = {
        .u = found_out(r, from),
        .observer = OBSERVER_1931_2,
        .lamp = from->irradiance,
        .lamp_noise = from->teach_readings > 0 ? from->spread / sqrt(from->teach_readings) : 0,
        .map_by_radiometer = true,
        .eye_distance_m = distance,
        .eye_angle_deg =
            distance > 0 ? acos(fmin(vec3_dot(to_eye, normal) / distance, 1)) * 180 / M_PI : 0,
        .display_modes = room->modes,
        .display_mode = room->mode,
        .display_rms = f->display.residual,
        .reflectance = f->place.reflectance,
        .shares = true,
        .white = from->white_patch,
        .count = from->patch_count,
        .patches = room->patches};
    struct summary spots = summarise(from->spot_ratios, from->spots);
    booth_light_into(&lamp->light, spots.n ? spots.std / spots.mean : 0, from->spots, &in);
    in.lux = from->proof_lux;
    return in;
}

static void fill_room(const struct report *r, const struct lamp_report *from,
                      const struct known_display *display, enum budget_scope scope,
                      struct budget_room *room)
{
    const struct session_facts *f = r->facts;
    for (int i = 0; i < from->patch_count; i++) {
        const struct patch_report *p = &from->patches[i];
        const json_t *reading = json_array_get(f->readings, (size_t)p->reading);
        struct budget_patch *b = &room->patches[i];
        *b = (struct budget_patch){.reflectance = f->chart[i].reflectance,
                                   .screen = scope == SCOPE_MEASURED ? p->measured : p->predicted,
                                   .counts = p->in_gamut};
        if (radiance_of(reading, &room->radiances[i]))
            b->radiance = &room->radiances[i];
        if (scope == SCOPE_SHOWN && display)
            b->screen = report_reached(f, from, &display->model, p->counts);
        if (scope == SCOPE_SHOWN && display && !f->place.dither)
            b->by_code = report_by_code(from, &display->model, p->counts, f->place.bits);
    }
}

static bool load_light(const struct session_facts *f, const struct lamp_report *from,
                       struct booth_light *out, struct error *err)
{
    struct ceiling ceiling = {.width_m = f->place.width_m, .depth_m = f->place.depth_m};
    struct luminance_map map;
    struct map_spot spots[SPOTS_MOST];
    memcpy(ceiling.centre_m, f->place.centre_m, sizeof ceiling.centre_m);
    if (!luminance_map_load(from->map, &ceiling, &map, err))
        return false;
    luminance_map_scale(&map, from->map_scale);
    for (int i = 0; i < from->spots; i++)
        spots[i] = (struct map_spot){from->spot_x_m[i], from->spot_z_m[i]};
    bool fine =
        booth_light_at(&map, &f->place.stand, f->place.tilt_deg, spots, from->spots, out, err);
    luminance_map_fini(&map);
    return fine;
}

static bool make_budgets(struct report *r, int index, const struct known_display *display,
                         struct error *err)
{
    const struct lamp_report *from = &r->facts->lamps[index];
    struct report_lamp *lamp = &r->lamps[index];
    struct budget_room *room = calloc(1, sizeof *room);
    if (!room)
        return fail(err, ERROR_SYSTEM, "out of memory for the budget");
    bool fine = r->facts->chart_count == from->patch_count ||
                fail(err, ERROR_DATA, "the facts have %d reflectances for %d patches",
                     r->facts->chart_count, from->patch_count);
    fine = fine && load_light(r->facts, from, &lamp->light, err) &&
           (!display || report_display_modes(from, &display->model, &display->origin.uncertainty,
                                             &room->modes, &room->mode, err));
    for (int scope = SCOPE_MEASURED; fine && scope <= SCOPE_SHOWN; scope++) {
        fill_room(r, from, display, (enum budget_scope)scope, room);
        struct budget_input in = input_of(r, from, lamp, room);
        in.scope = (enum budget_scope)scope;
        fine = budget_make(&in, r->draws, SEED + (uint64_t)index,
                           scope == SCOPE_MEASURED ? &lamp->measured : &lamp->shown, err);
    }
    free(room->mode);
    free(room);
    return fine;
}

// ---- the patches -------------------------------------------------------------------

static void find_worst(const struct lamp_report *from, struct report_lamp *lamp)
{
    lamp->worst_count = 0;
    for (int i = 0; i < from->patch_count; i++) {
        int at = lamp->worst_count < REPORT_WORST ? lamp->worst_count++ : REPORT_WORST;
        for (; at > 0 &&
               from->patches[lamp->worst[at - 1]].de_absolute < from->patches[i].de_absolute;
             at--)
            if (at < REPORT_WORST)
                lamp->worst[at] = lamp->worst[at - 1];
        if (at < REPORT_WORST)
            lamp->worst[at] = i;
    }
}

static void sum_up_outside(const struct lamp_report *from, struct report_lamp *lamp)
{
    double v[4][FACTS_PATCHES];
    int n = 0;
    for (int i = 0; i < from->patch_count; i++) {
        const struct patch_report *p = &from->patches[i];
        if (p->in_gamut)
            continue;
        v[0][n] = p->de_absolute;
        v[1][n] = p->de_published;
        v[2][n] = lamp->patches[i].floor_absolute;
        v[3][n++] = lamp->patches[i].floor_published;
    }
    lamp->absolute_out = summarise(v[0], n);
    lamp->published_out = summarise(v[1], n);
    lamp->floor_absolute = summarise(v[2], lamp->split ? n : 0);
    lamp->floor_published = summarise(v[3], lamp->split ? n : 0);
}

static void make_lamp(struct report *r, int index, const struct known_display *display)
{
    const struct lamp_report *from = &r->facts->lamps[index];
    struct report_lamp *lamp = &r->lamps[index];
    struct error why = {0};
    lamp->budgeted = make_budgets(r, index, display, &why);
    snprintf(lamp->no_budget, sizeof lamp->no_budget, "%.250s", lamp->budgeted ? "" : why.text);
    if (display)
        report_steps(r->facts, from, &display->model, lamp);
    find_worst(from, lamp);
    sum_up_outside(from, lamp);
}

bool report_make(const struct session_facts *facts, const char *folder,
                 const char *uncertainty_file, int draws, struct report *out, struct error *err)
{
    struct known_display *display = calloc(1, sizeof *display);
    *out = (struct report){.facts = facts, .draws = draws};
    if (!display)
        return fail(err, ERROR_SYSTEM, "out of memory for the report");
    snprintf(out->uncertainty_file, sizeof out->uncertainty_file, "%s",
             uncertainty_file ? uncertainty_file : "");
    if (!uncertainties_load(uncertainty_file, &out->u, err)) {
        free(display);
        return false;
    }
    note_inputs(out, folder);
    digest_settings(out);
    bool there = display_load(facts->display.model, &display->model, &display->origin, NULL);
    for (int i = 0; i < facts->lamp_count; i++)
        make_lamp(out, i, there ? display : NULL);
    free(display);
    return true;
}
