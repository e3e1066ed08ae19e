// SPDX-License-Identifier: Apache-2.0
#include "calibration/still_camera.h"

#include <math.h>

#include "files/ini.h"

#define AT(field) offsetof(struct still_camera, field)
#define NUMBER(name, field, least, most, unit, preset, help)                                       \
    {                                                                                              \
        name, SETTING_DOUBLE, AT(field), 0, least, most, unit, NULL, preset, help                  \
    }

static const struct setting ROWS[] = {
    {"width_px", SETTING_INT, AT(width_px), 0, 1, 16384, "px", NULL, NULL, "Columns of a picture."},
    {"height_px", SETTING_INT, AT(height_px), 0, 1, 16384, "px", NULL, NULL, "Rows of a picture."},
    NUMBER("fx_px", lens.fx_px, 1, 1e6, "px", NULL, "Focal length across."),
    NUMBER("fy_px", lens.fy_px, 1, 1e6, "px", NULL, "Focal length down."),
    NUMBER("cx_px", lens.cx_px, -16384, 32768, "px", NULL, "Column of the optical axis."),
    NUMBER("cy_px", lens.cy_px, -16384, 32768, "px", NULL, "Row of the optical axis."),
    NUMBER("k1", lens.k1, -100, 100, "", "0", "Radial distortion, second power."),
    NUMBER("k2", lens.k2, -100, 100, "", "0", "Radial distortion, fourth power."),
    NUMBER("p1", lens.p1, -10, 10, "", "0", "Tangential distortion, down."),
    NUMBER("p2", lens.p2, -10, 10, "", "0", "Tangential distortion, across."),
    NUMBER("k3", lens.k3, -100, 100, "", "0", "Radial distortion, sixth power."),
    {"cos4", SETTING_BOOL, AT(cos4), 0, 0, 0, "", NULL, "no",
     "Whether light falls off with the fourth power of the cosine."},
    NUMBER("v2", v2, -100, 100, "", "0", "Falloff beside it: squared tangent."),
    NUMBER("v4", v4, -100, 100, "", "0", "Its fourth power."),
    NUMBER("v6", v6, -100, 100, "", "0", "Its sixth power."),
    {0}};

static const char *const SIDES[] = {"near", "far", "left", "right", NULL};
static const struct setting CEILING_ROWS[] = {
    {"top", SETTING_ENUM, AT(top), 0, 0, 0, "", SIDES, "near",
     "Side of the ceiling that is on top of the picture."},
    NUMBER("inset_m", inset_m, 0, 5, "m", "0", "How far the lit field ends within the edges."),
    {0}};

bool still_camera_load(const char *path, struct still_camera *out, struct error *err)
{
    struct still_camera read = {0};
    const struct settings_section sections[] = {
        {"camera", ROWS, &read}, {"ceiling", CEILING_ROWS, &read}, {0}};
    if (!ini_load(path, sections, err))
        return false;
    *out = read;
    return true;
}

bool still_camera_fit(struct still_camera *c, int width, int height, struct error *err)
{
    if (c->width_px && (c->width_px != width || c->height_px != height))
        return fail(err, ERROR_CONFIG,
                    "the lens is that of pictures of %d x %d pixels; these have %d x %d",
                    c->width_px, c->height_px, width, height);
    bool known = c->lens.fx_px > 0;
    if (!known || isnan(c->lens.cx_px)) {
        c->lens.cx_px = (width - 1) / 2.0;
        c->lens.cy_px = (height - 1) / 2.0;
    }
    if (known)
        return true;
    if (c->cos4 || c->v2 != 0 || c->v4 != 0 || c->v6 != 0)
        return fail(err, ERROR_CONFIG, "falloff by angle needs the focal length");
    c->lens.fx_px = c->lens.fy_px = 1;
    return true;
}

double still_camera_falloff(const struct still_camera *c, const double tangent[2])
{
    double t2 = tangent[0] * tangent[0] + tangent[1] * tangent[1];
    double beside = 1 + t2 * (c->v2 + t2 * (c->v4 + t2 * c->v6));
    return c->cos4 ? beside / ((1 + t2) * (1 + t2)) : beside;
}
