// SPDX-License-Identifier: Apache-2.0
#include "config/geometry.h"

#include <string.h>

#include "files/ini.h"

enum { SECTIONS_MOST = STORED_COUNT + 2, ROWS_MOST = 2 * STORED_COUNT + 2, GIVEN_MOST = 64 };

#define KNOWN(field, type, count, unit, preset)                                                    \
    {                                                                                              \
#field, type, offsetof(struct geometry_uncertainty, field), count, 0, 1000, unit, NULL,    \
            preset, "Expanded uncertainty, k = 2."                                                 \
    }

static const struct setting uncertainty_rows[] = {
    KNOWN(hinge_m, SETTING_VECTOR, 3, "m", "0 0 0"),
    KNOWN(centre_from_hinge_m, SETTING_VECTOR, 3, "m", "0 0 0"),
    KNOWN(turned_deg, SETTING_VECTOR, 3, "deg", "0 0 0"),
    KNOWN(place_m, SETTING_VECTOR, 3, "m", "0 0 0"),
    KNOWN(pitch_deg, SETTING_DOUBLE, 0, "deg", "0"),
    KNOWN(yaw_deg, SETTING_DOUBLE, 0, "deg", "0"),
    KNOWN(roll_deg, SETTING_DOUBLE, 0, "deg", "0"),
    {0},
};

#define AT(field) offsetof(struct geometry_origin, field)
#define ROOM(field) SETTING_SIZE(struct geometry_origin, field)

static const struct setting origin_rows[] = {
    {"stand_at", SETTING_TEXT, AT(stand_at), ROOM(stand_at), 0, 0, "", NULL, "",
     "When the stand was fitted (UTC)."},
    {"stand_poses", SETTING_INT, AT(stand_poses), 0, 0, 1e6, "", NULL, "0",
     "Poses it was fitted to."},
    {"tracker_at", SETTING_TEXT, AT(tracker_at), ROOM(tracker_at), 0, 0, "", NULL, "",
     "When the tracker was fitted (UTC)."},
    {"tracker_points", SETTING_INT, AT(tracker_points), 0, 0, 1e6, "", NULL, "0",
     "Points it was fitted to."},
    {"software", SETTING_TEXT, AT(software), ROOM(software), 0, 0, "", NULL, "",
     "Program that fitted."},
    {0}};

// The sections of a geometry.ini with the rows of a mask.
struct layout {
    struct booth_tables tables;
    struct settings_section sections[SECTIONS_MOST];
    struct setting rows[ROWS_MOST];
};

// The bit of a row of geometry, 0 of any other.
static unsigned bit_of(const char *section, const char *key)
{
    size_t length = strlen(section);
    for (int i = STORED_HINGE; i < STORED_COUNT; i++) {
        const char *name = booth_stored_name(i);
        if (!strncmp(name, section, length) && name[length] == '.' &&
            !strcmp(name + length + 1, key))
            return 1u << i;
    }
    return 0;
}

static void lay_out(struct layout *l, struct geometry *g, unsigned rows)
{
    struct setting *row = l->rows;
    struct settings_section *section = l->sections;
    *l = (struct layout){0};
    booth_tables_init(&l->tables, &g->booth);
    for (const struct settings_section *s = l->tables.sections; s->name; s++) {
        struct setting *first = row;
        for (const struct setting *r = s->rows; r->name; r++)
            if (bit_of(s->name, r->name) & rows)
                *row++ = *r;
        if (row == first)
            continue;
        *section++ = (struct settings_section){s->name, first, &g->booth};
        row++; // all zero: the end of the section
    }
    *section++ = (struct settings_section){"uncertainty", uncertainty_rows, &g->uncertainty};
    *section++ = (struct settings_section){"origin", origin_rows, &g->origin};
}

bool geometry_load(const char *path, struct geometry *out, struct error *err)
{
    struct geometry g = {0};
    struct layout layout;
    bool given[GIVEN_MOST] = {0};
    lay_out(&layout, &g, ~0u);
    if (!ini_load_onto(path, layout.sections, given, err))
        return false;
    const bool *seen = given;
    for (const struct settings_section *s = layout.sections; s->name; s++)
        for (const struct setting *r = s->rows; r->name; r++, seen++)
            g.rows |= *seen ? bit_of(s->name, r->name) : 0;
    *out = g;
    return true;
}

bool geometry_save(const char *path, const struct geometry *geometry, struct error *err)
{
    struct geometry g = *geometry;
    struct layout layout;
    lay_out(&layout, &g, g.rows);
    return ini_save(path, layout.sections, err);
}

void geometry_print(const struct geometry *geometry, FILE *out)
{
    struct geometry g = *geometry;
    struct layout layout;
    lay_out(&layout, &g, g.rows);
    for (const struct settings_section *s = layout.sections; s->target == &g.booth; s++)
        settings_write(s, out);
}

static size_t size_of(const struct setting *row)
{
    return row->type == SETTING_VECTOR ? row->size * sizeof(double) : sizeof(double);
}

void geometry_take(struct booth_settings *to, const struct booth_settings *from, unsigned rows)
{
    struct booth_tables tables;
    booth_tables_init(&tables, NULL);
    for (const struct settings_section *s = tables.sections; s->name; s++)
        for (const struct setting *r = s->rows; r->name; r++)
            if (bit_of(s->name, r->name) & rows)
                memcpy((char *)to + r->offset, (const char *)from + r->offset, size_of(r));
}

unsigned geometry_differs(const struct booth_settings *a, const struct booth_settings *b,
                          unsigned rows)
{
    struct booth_tables tables;
    unsigned found = 0;
    booth_tables_init(&tables, NULL);
    for (const struct settings_section *s = tables.sections; s->name; s++)
        for (const struct setting *r = s->rows; r->name; r++)
            if (memcmp((const char *)a + r->offset, (const char *)b + r->offset, size_of(r)))
                found |= bit_of(s->name, r->name) & rows;
    return found;
}
