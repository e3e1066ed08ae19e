// SPDX-License-Identifier: Apache-2.0
#include "render/scene.h"

static int texel_at(double place, int count)
{
    double texel = floor(place * count);
    return texel >= 0 && texel < count ? (int)texel : -1;
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
