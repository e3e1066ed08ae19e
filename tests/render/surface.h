// SPDX-License-Identifier: Apache-2.0
// A complete SURFACE scene for tests, on a small screen of the emulated
// booth's size: 24 patches of made-up colours, half of them dark.
#ifndef TESTS_RENDER_SURFACE_H
#define TESTS_RENDER_SURFACE_H

#include "render/reference.h"
#include "render/renderer.h"
#include "tests/render/support.h"

enum { SURFACE_WIDTH = 160, SURFACE_HEIGHT = 100, SURFACE_COLUMNS = 6, SURFACE_ROWS = 4 };

struct surface {
    struct luminance_map map;
    struct light_points lights;
    struct display_model display;
    struct display_view view; // of surface_view
    float texels[SURFACE_COLUMNS * SURFACE_ROWS][3];
    struct scene scene;
};

static inline void surface_tilt(struct surface *s, double tilt_deg)
{
    static const struct stand stand = {{0, 0, 0}, {0, 0.20, 0.03}};
    s->scene.booth_from_screen = stand_pose(&stand, tilt_deg);
}

// Reflectances from 0.005 to 0.9; white as that of CIE D65 or CIE A.
static inline void surface_paint(struct surface *s, bool warm)
{
    struct xyz white = warm ? (struct xyz){1.0985, 1, 0.3558} : (struct xyz){0.9505, 1, 1.0891};
    for (int i = 0; i < SURFACE_COLUMNS * SURFACE_ROWS; i++) {
        double r = 0.005 + 0.895 * pow(i / 23.0, 2);
        s->texels[i][0] = (float)(r * white.X * (1 + 0.15 * sin(i)));
        s->texels[i][1] = (float)r;
        s->texels[i][2] = (float)(r * white.Z * (1 - 0.25 * sin(2 * i)));
    }
    s->scene.white = white;
    s->scene.texels_generation++;
}

static inline void surface_light(struct surface *s, double (*pattern)(double, double), int most)
{
    struct error err = {0};
    luminance_map_fini(&s->map);
    light_points_fini(&s->lights);
    s->map = map_from(booth_ceiling(), 128, 80, pattern);
    assert_good(median_cut(&s->map, CUT_VARIANCE, most, &s->lights, &err), err);
    s->scene.lights = &s->lights;
    s->scene.lights_generation++;
}

static inline void surface_init(struct surface *s)
{
    memset(s, 0, sizeof *s);
    s->display = panel();
    s->scene = (struct scene){
        .kind = SCENE_SURFACE,
        .screen = {0.520, 0.325, SURFACE_WIDTH, SURFACE_HEIGHT},
        .level = 1,
        .texels = s->texels[0],
        .texels_width = SURFACE_COLUMNS,
        .texels_height = SURFACE_ROWS,
        .texel_offset = {0.5, 0.5, 0},
        .texel_scale_x = 0.520,
        .texel_scale_y = 0.325,
        .screen_reflectance = 0.002,
        .display = &s->display,
        .display_generation = 1,
        .bits = 8,
    };
    surface_paint(s, false);
    surface_light(s, tubes, 32);
    surface_tilt(s, 30);
}

// A display whose light falls with the angle, to the left more than to the
// right, and towards its corners; its black rises.
static inline void surface_view(struct surface *s, struct vec3 eye)
{
    static const double fall[VIEW_CHANNELS] = {-1.6, -1.5, -1.9, 2.5};
    struct error err = {0};
    display_view_none(&s->view);
    s->view.sine_most = 0.7;
    for (int c = 0; c < VIEW_CHANNELS; c++) {
        const double a[VIEW_TERMS] = {0.05, -0.02, fall[c], 0.1, 0.9 * fall[c], -0.3, 0.1};
        memcpy(s->view.angle[c], a, sizeof a);
        for (int i = 0; i < VIEW_GRID; i++)
            for (int j = 0; j < VIEW_GRID; j++)
                s->view.place[c][i][j] =
                    1 - 0.01 * (c + 1) * ((i - 2) * (i - 2) + 0.5 * (j - 2) * (j - 2) - 0.2 * (j - 2));
    }
    assert_good(display_view_prepare(&s->view, &err), err);
    s->scene.view = &s->view;
    s->scene.eye = eye;
    s->scene.display_generation++;
}

static inline void surface_fini(struct surface *s)
{
    luminance_map_fini(&s->map);
    light_points_fini(&s->lights);
}

#endif
