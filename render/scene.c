// SPDX-License-Identifier: Apache-2.0
#include "render/scene.h"

static int texel_at(double place, int count)
{
    double texel = floor(place * count);
    return texel >= 0 && texel < count ? (int)texel : -1;
}

struct view_gains scene_gains(const struct scene *scene, int x_px, int y_px)
{
    if (!scene->view)
        return (struct view_gains){{1, 1, 1, 1}};
    struct vec3 eye = rigid_apply(rigid_inverse(scene->booth_from_screen), scene->eye);
    struct vec3 to_eye = vec3_unit(vec3_sub(eye, screen_point(&scene->screen, x_px, y_px)));
    return display_view_gains(scene->view, to_eye.x, to_eye.y,
                              (x_px + 0.5) / scene->screen.width_px,
                              (y_px + 0.5) / scene->screen.height_px);
}

int scene_texel_column(const struct scene *scene, int x_px)
{
    double x_m = screen_point(&scene->screen, x_px, 0).x;
    return texel_at(scene->texel_offset.x + x_m / scene->texel_scale_x, scene->texels_width);
}

int scene_texel_row(const struct scene *scene, int y_px)
{
    double y_m = screen_point(&scene->screen, 0, y_px).y;
    return texel_at(scene->texel_offset.y - y_m / scene->texel_scale_y, scene->texels_height);
}
