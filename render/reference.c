// SPDX-License-Identifier: Apache-2.0
#include "render/reference.h"

#include <math.h>

#define real double
#include "render/shaders/output.glsl"

static double emitted_of(const struct scene *scene, double surface, double white, double lux)
{
    return output_finite(output_emitted(surface, scene->screen_reflectance, white, lux));
}

static double rounded(const struct scene *scene, double count)
{
    double last = (1 << scene->bits) - 1;
    return scene->dither ? count : floor(count * last + 0.5) / last;
}

static struct xyz sent_of(const struct scene *scene, const struct pixel *p)
{
    const struct counts *c = &p->inverse.counts;
    struct counts shown = {rounded(scene, c->r), rounded(scene, c->g), rounded(scene, c->b)};
    struct xyz at_centre = display_forward(scene->display, shown);
    struct xyz out =
        scene->view ? display_view_leaves(scene->display, p->gains, at_centre) : at_centre;
    return (struct xyz){out.X + p->surface.X - p->emitted.X, out.Y + p->surface.Y - p->emitted.Y,
                        out.Z + p->surface.Z - p->emitted.Z};
}

struct pixel reference_pixel(const struct scene *scene, int x_px, int y_px)
{
    struct pixel out = {.inverse.in_gamut = true};
    int column = scene_texel_column(scene, x_px), row = scene_texel_row(scene, y_px);
    struct vec3 p = rigid_apply(scene->booth_from_screen, screen_point(&scene->screen, x_px, y_px));
    struct vec3 n = mat3_apply(scene->booth_from_screen.rotation, (struct vec3){0, 0, 1});
    if (scene->lights)
        out.illuminance = light_points_illuminance(scene->lights, scene->level, p, n);
    if (column < 0 || row < 0)
        return out;
    const float *texel = scene->texels + 3 * ((size_t)row * scene->texels_width + column);
    out.surface.X = output_surface(texel[0], out.illuminance);
    out.surface.Y = output_surface(texel[1], out.illuminance);
    out.surface.Z = output_surface(texel[2], out.illuminance);
    out.emitted.X = emitted_of(scene, out.surface.X, scene->white.X, out.illuminance);
    out.emitted.Y = emitted_of(scene, out.surface.Y, scene->white.Y, out.illuminance);
    out.emitted.Z = emitted_of(scene, out.surface.Z, scene->white.Z, out.illuminance);
    out.gains = scene_gains(scene, x_px, y_px);
    out.asked =
        scene->view ? display_view_ask(scene->display, out.gains, out.emitted) : out.emitted;
    out.inverse = display_invert(scene->display, out.asked);
    out.sent = sent_of(scene, &out);
    return out;
}
