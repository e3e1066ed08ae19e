// SPDX-License-Identifier: Apache-2.0
#include "calibration/geometry_keep.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/commands.h"
#include "calibration/store_keep.h"
#include "config/booth_store.h"
#include "config/paths.h"

static const unsigned STAND_ROWS = 1u << STORED_HINGE | 1u << STORED_CENTRE | 1u << STORED_TURNED;

bool geometry_take_option(int letter, const char *value, struct geometry_options *o)
{
    const char **const texts[] = {&o->config, &o->socket, &o->booth, &o->in, &o->keep, &o->out};
    static const char LETTERS[] = "csbfko";
    const char *found = letter ? strchr(LETTERS, letter) : NULL;
    if (found)
        *texts[found - LETTERS] = value;
    o->store = o->store || letter == 'S';
    o->json = o->json || letter == 'j';
    return found || letter == 'S' || letter == 'j';
}

bool geometry_can_store(const struct booth_settings *booth, struct error *err)
{
    struct store_place place;
    struct store_draft trial;
    if (!booth_store_place(booth, &place, err) || !store_begin(&place, true, &trial, err))
        return false;
    store_abandon(&trial);
    return true;
}

void geometry_merge(struct geometry *old, const struct geometry *found, bool stand)
{
    unsigned part = stand ? STAND_ROWS : ~STAND_ROWS;
    struct geometry_uncertainty *u = &old->uncertainty;
    const struct geometry_uncertainty *v = &found->uncertainty;
    geometry_take(&old->booth, &found->booth, found->rows & part);
    old->rows = (old->rows & ~part) | (found->rows & part);
    memcpy(old->origin.software, found->origin.software, sizeof old->origin.software);
    if (stand) {
        memcpy(u->hinge_m, v->hinge_m, sizeof u->hinge_m);
        memcpy(u->centre_from_hinge_m, v->centre_from_hinge_m, sizeof u->centre_from_hinge_m);
        memcpy(u->turned_deg, v->turned_deg, sizeof u->turned_deg);
        memcpy(old->origin.stand_at, found->origin.stand_at, sizeof old->origin.stand_at);
        old->origin.stand_poses = found->origin.stand_poses;
        return;
    }
    memcpy(u->place_m, v->place_m, sizeof u->place_m);
    u->pitch_deg = v->pitch_deg;
    u->yaw_deg = v->yaw_deg;
    u->roll_deg = v->roll_deg;
    memcpy(old->origin.tracker_at, found->origin.tracker_at, sizeof old->origin.tracker_at);
    old->origin.tracker_points = found->origin.tracker_points;
}

bool geometry_keep_in_file(const char *path, const struct geometry *found, bool stand,
                           struct error *err)
{
    struct geometry all = {.rows = 0};
    if (path_exists(path) && !geometry_load(path, &all, err))
        return while_doing(err, "it is to take what was found");
    geometry_merge(&all, found, stand);
    return geometry_save(path, &all, err);
}

bool geometry_keep_in_store(const struct booth_settings *booth, const struct geometry *found,
                            bool stand, const char *note, int *number, struct error *err)
{
    struct store_place place;
    struct store_draft d;
    char path[PATH_MAX];
    if (!booth_store_place(booth, &place, err) || !store_begin(&place, true, &d, err))
        return false;
    struct store_manifest facts = store_facts(booth, &d, false, note);
    snprintf(path, sizeof path, "%s/" STORE_GEOMETRY, d.folder);
    if (geometry_keep_in_file(path, found, stand, err) && store_commit(&d, &facts, number, err))
        return true;
    store_abandon(&d);
    return while_doing(err, "keeping the geometry");
}

void geometry_overruled(const struct booth_settings *booth, const struct geometry *found,
                        char *text, size_t size)
{
    booth_stored_list(geometry_differs(booth, &found->booth, found->rows & booth->given), text,
                      size);
}

double geometry_rounded(double value, const char *unit)
{
    double step = strcmp(unit, "m") ? 1e4 : 1e6;
    return rint(value * step) / step;
}

void geometry_values_print(const struct geometry_value *values, int count)
{
    printf("  %-24s %12s  %12s\n", "", "found", "+- (k = 2)");
    for (int i = 0; i < count; i++) {
        const struct geometry_value *v = &values[i];
        int digits = strcmp(v->unit, "m") ? 3 : 5;
        if (v->uncertainty > 0)
            printf("  %-24s %12.*f  %12.*f %s\n", v->name, digits, v->value, digits, v->uncertainty,
                   v->unit);
        else
            printf("  %-24s %12.*f  %12s %s\n", v->name, digits, v->value, "as it was", v->unit);
    }
}

json_t *geometry_values_json(const struct geometry_value *values, int count)
{
    json_t *all = json_array();
    for (int i = 0; i < count; i++) {
        const struct geometry_value *v = &values[i];
        json_array_append_new(
            all,
            json_pack("{s:s, s:s, s:f, s:o}", "name", v->name, "unit", v->unit, "value", v->value,
                      "uncertainty", v->uncertainty > 0 ? json_real(v->uncertainty) : json_null()));
    }
    return all;
}

static bool keep(const struct geometry_options *o, const struct booth_settings *booth,
                 const struct geometry *found, bool stand, int *number, struct error *err)
{
    const char *note = stand ? "stand and inclinometer fitted" : "tracker fitted";
    return (!o->out || geometry_keep_in_file(o->out, found, stand, err)) &&
           (!o->store || geometry_keep_in_store(booth, found, stand, note, number, err));
}

static void say(const struct geometry_options *o, const struct geometry *found, int number,
                const char *warning, json_t *report)
{
    if (o->json) {
        json_object_set_new(report, "version", number ? json_integer(number) : json_null());
        json_object_set_new(report, "warning", *warning ? json_string(warning) : json_null());
        json_dumpf(report, stdout, JSON_INDENT(1) | JSON_REAL_PRECISION(9));
        putchar('\n');
        return;
    }
    putchar('\n');
    geometry_print(found, stdout);
    if (o->out)
        printf("\nwritten to %s\n", o->out);
    if (number)
        printf("\ncalibration %04d is in force\n", number);
}

int geometry_deliver(const struct geometry_options *o, const struct booth_settings *booth,
                     const struct geometry *found, bool stand, const char *warning, json_t *report)
{
    struct error err = {0};
    char rows[256], text[640];
    int number = 0;
    if (!keep(o, booth, found, stand, &number, &err))
        return command_failed(&err);
    geometry_overruled(booth, found, rows, sizeof rows);
    bool overruled = o->store && *rows;
    snprintf(text, sizeof text, "%s%s%s%s", warning, *warning && overruled ? "; " : "",
             overruled ? "the settings' own values count instead of the calibration's: take these "
                         "rows out of them: "
                       : "",
             overruled ? rows : "");
    say(o, found, number, text, report);
    return command_warned(text);
}
