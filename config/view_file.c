// SPDX-License-Identifier: Apache-2.0
#include "config/view_file.h"

#include "files/ini.h"

struct view_text {
    struct display_view view;
    struct view_origin origin;
};

#define AT(field) offsetof(struct view_text, field)
#define ROOM(field) SETTING_SIZE(struct view_text, field)
#define ANGLE(name, channel, what)                                                                 \
    {                                                                                              \
        name, SETTING_VECTOR, AT(view.angle[channel]), VIEW_TERMS, -1e3, 1e3, "", NULL, NULL,      \
            "ln of " what "'s gain: factors of u, v, u2, uv, v2, s2, s3; s = u2 + v2; u, v: cosines of the "  \
            "direction with the screen's x (right), y (up)."                                       \
    }
#define PLACE(name, channel, what)                                                                 \
    {                                                                                              \
        name, SETTING_VECTOR, AT(view.place[channel]), VIEW_GRID *VIEW_GRID, 0.05, 20, "", NULL,   \
            NULL, "Gain of " what " at 5 x 5 places, rows from the top; 1 at the centre."          \
    }

static const struct setting ROWS[] = {
    {"instrument", SETTING_TEXT, AT(origin.instrument), ROOM(origin.instrument), 0, 0, "", NULL, "",
     "What it was measured with."},
    {"date", SETTING_TEXT, AT(origin.date), ROOM(origin.date), 0, 0, "", NULL, "",
     "When it was measured (UTC)."},
    {"software", SETTING_TEXT, AT(origin.software), ROOM(origin.software), 0, 0, "", NULL, "",
     "Who fitted it."},
    {"model", SETTING_TEXT, AT(origin.model), ROOM(origin.model), 0, 0, "", NULL, "",
     "Display model whose primaries it stands on."},
    {"directions", SETTING_INT, AT(origin.directions), 0, 0, 10000, "", NULL, "0",
     "Directions measured."},
    {"places", SETTING_INT, AT(origin.places), 0, 0, 10000, "", NULL, "0", "Places measured."},
    {"before_de00", SETTING_DOUBLE, AT(origin.before_de00), 0, 0, 1000, "", NULL, "0",
     "Largest CIEDE2000 of white between a direction and the normal."},
    {"after_de00", SETTING_DOUBLE, AT(origin.after_de00), 0, 0, 1000, "", NULL, "0",
     "What the fit leaves of that."},
    {"sine_most", SETTING_DOUBLE, AT(view.sine_most), 0, 0, 0.99, "", NULL, NULL,
     "Sine of the outermost angle measured; beyond it the gain is held."},
    ANGLE("red_angle", 0, "red"),
    ANGLE("green_angle", 1, "green"),
    ANGLE("blue_angle", 2, "blue"),
    ANGLE("black_angle", 3, "black"),
    PLACE("red_place", 0, "red"),
    PLACE("green_place", 1, "green"),
    PLACE("blue_place", 2, "blue"),
    PLACE("black_place", 3, "black"),
    {0},
};

bool view_save(const char *path, const struct display_view *view, const struct view_origin *origin,
               struct error *err)
{
    struct view_text text = {*view, *origin};
    const struct settings_section sections[] = {{"view", ROWS, &text}, {0}};
    return ini_save(path, sections, err);
}

bool view_load(const char *path, struct display_view *view, struct view_origin *origin,
               struct error *err)
{
    struct view_text text;
    const struct settings_section sections[] = {{"view", ROWS, &text}, {0}};
    if (!ini_load(path, sections, err))
        return false;
    if (!display_view_prepare(&text.view, err))
        return while_doing(err, "%s: [view]", path);
    *view = text.view;
    if (origin)
        *origin = text.origin;
    return true;
}
