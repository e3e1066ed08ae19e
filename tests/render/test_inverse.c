// SPDX-License-Identifier: Apache-2.0
// The renderer's inverse of every kind of display model, against the double
// one, on colours all over the gamut.
#include "tests/render/surface.h"

// Half a code of rounding, and single precision at the half-way line.
#define ROUNDING (0.5 + 2e-3)
// What a residual's table may add (colorimetry/display_table.h): half a code,
// but for channels below the fourth.
#define TABLE 0.5
#define DARK_CODES 4
// Mean of a rounding error that is uniform within half a code.
#define MEAN_ROUNDING 0.25
#define MEAN_ROOM 0.01

enum { PIXELS = SURFACE_WIDTH * SURFACE_HEIGHT };

struct colours {
    struct surface surface;
    float texels[PIXELS][3];
    struct counts wanted[PIXELS];
};

static struct renderer *renderer;
static uint64_t seed;

static int open_renderer(void **state)
{
    (void)state;
    struct error err = {0};
    struct renderer_options options = {.width = SURFACE_WIDTH, .height = SURFACE_HEIGHT};
    renderer = renderer_create(&options, &err);
    if (!renderer)
        printf("skipped: no OpenGL through EGL here: %s\n", err.text);
    return renderer || strncmp(err.text, "EGL: no ", 8) == 0 ? 0 : -1;
}

static int close_renderer(void **state)
{
    (void)state;
    renderer_destroy(renderer);
    return 0;
}

static double uniform(void)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (double)(seed >> 11) / 9007199254740992.0;
}

static struct display_model panel_of(enum display_kind kind)
{
    static const double terms[3][DISPLAY_TERMS] = {
        {-34, -9, -11, 9, -6, 2}, {-36, -22, -9, 4, 17, -1}, {-1, -31, -38, 0, 1, 19}};
    struct display_model m = panel();
    struct error err = {0};
    m.kind = kind;
    memcpy(m.interaction, terms, sizeof terms);
    m.residual.least = (struct vec3){-10, -110, -130};
    m.residual.most = (struct vec3){110, 115, 115};
    for (int k = 0; k < LATTICE_NODES; k++) {
        double x = k / 36 / 5.0, y = k / 6 % 6 / 5.0 - 0.5, z = k % 6 / 5.0 - 0.5;
        m.residual.node[k][0] = 4 * x - 3 * x * x + y;
        m.residual.node[k][1] = 8 * y * x - 6 * y * y + z;
        m.residual.node[k][2] = 6 * z - 5 * y * z;
    }
    assert_good(display_model_prepare(&m, &err), err);
    return m;
}

// A texel for every pixel, such that the pixel must emit the colour of random
// counts under the light that falls on it.
static void paint(struct colours *s, enum display_kind kind, bool dark)
{
    struct scene *scene = &s->surface.scene;
    s->surface.display = panel_of(kind);
    scene->display_generation++;
    scene->texels = s->texels[0];
    scene->texels_width = SURFACE_WIDTH;
    scene->texels_height = SURFACE_HEIGHT;
    scene->texels_generation++;
    scene->screen_reflectance = 0;
    for (int i = 0; i < PIXELS; i++) {
        double lux = reference_pixel(scene, i % SURFACE_WIDTH, i / SURFACE_WIDTH).illuminance;
        struct counts c = {uniform(), uniform(), uniform()};
        if (dark && i % 2)
            c.r *= 0.1 * uniform();
        if (dark && i % 3)
            c.b *= 0.1 * uniform();
        struct xyz target = display_forward(&s->surface.display, c);
        s->texels[i][0] = (float)(target.X * M_PI / lux);
        s->texels[i][1] = (float)(target.Y * M_PI / lux);
        s->texels[i][2] = (float)(target.Z * M_PI / lux);
        s->wanted[i] = c;
    }
}

// Greatest and mean difference in codes of what was shown from what the double
// inverse of the very target wants; channels below `dark` codes do not count.
static double compare(struct colours *s, double dark, double *mean)
{
    struct error err = {0};
    double most = 0, sum = 0;
    long count = 0;
    if (!renderer)
        skip();
    assert_good(renderer_show(renderer, &s->surface.scene, true, NULL, &err), err);
    uint8_t *shown = renderer_counts(renderer, &err);
    assert_good(shown, err);
    for (int i = 0; i < PIXELS; i++) {
        struct pixel p = reference_pixel(&s->surface.scene, i % SURFACE_WIDTH, i / SURFACE_WIDTH);
        const double is[3] = {p.inverse.counts.r, p.inverse.counts.g, p.inverse.counts.b};
        for (int c = 0; c < 3; c++) {
            double off = fabs(shown[3 * i + c] - 255 * is[c]);
            assert_true(off <= 1 + TABLE + ROUNDING);
            if (255 * is[c] < dark)
                continue;
            most = fmax(most, off);
            sum += off;
            count++;
        }
    }
    free(shown);
    *mean = sum / (double)count;
    return most;
}

static void every_kind_is_inverted_to_half_a_code_all_over_its_gamut(void **state)
{
    (void)state;
    struct colours *s = calloc(1, sizeof *s);
    assert_non_null(s);
    surface_init(&s->surface);
    for (int kind = DISPLAY_DAY; kind <= DISPLAY_RESIDUAL; kind++)
        for (int dark = 0; dark < 2; dark++) {
            double mean;
            seed = 40 + (uint64_t)kind;
            paint(s, (enum display_kind)kind, dark);
            bool table = kind == DISPLAY_RESIDUAL;
            double most = compare(s, table ? DARK_CODES : 0, &mean);
            print_message("%s%s: %.4f codes at most, %.4f on average, rounding included\n",
                          display_kind_names[kind], dark ? ", dark" : "", most, mean);
            assert_true(most <= ROUNDING + (table ? TABLE : 0));
            assert_float_within(mean, MEAN_ROUNDING, MEAN_ROOM);
        }
    surface_fini(&s->surface);
    free(s);
}

// Random targets over and under the gamut: flagged as the double inverse flags
// them, but for those nearer to the gamut's surface than a table tells.
static void what_is_out_of_gamut_is_flagged_for_every_kind(void **state)
{
    (void)state;
    struct colours *s = calloc(1, sizeof *s);
    assert_non_null(s);
    if (!renderer)
        skip();
    surface_init(&s->surface);
    for (int kind = DISPLAY_DAY; kind <= DISPLAY_RESIDUAL; kind++) {
        struct error err = {0};
        int outside = 0, doubtful = 0;
        seed = 50;
        paint(s, (enum display_kind)kind, false);
        for (int i = 0; i < PIXELS; i++) {
            double k = 1.4 * uniform();
            for (int c = 0; c < 3; c++)
                s->texels[i][c] *= (float)k;
        }
        assert_good(renderer_show(renderer, &s->surface.scene, true, NULL, &err), err);
        for (int i = 0; i < PIXELS; i++) {
            struct display_inverse at =
                reference_pixel(&s->surface.scene, i % SURFACE_WIDTH, i / SURFACE_WIDTH).inverse;
            const double l[3] = {at.linear.r, at.linear.g, at.linear.b};
            bool near = false;
            for (int c = 0; c < 3; c++)
                near = near || fabs(l[c]) < 2e-4 || fabs(l[c] - 1) < 2e-4;
            outside += !at.in_gamut;
            doubtful += near;
        }
        print_message("%s: %d of %d out of gamut, %d on its surface\n", display_kind_names[kind],
                      outside, PIXELS, doubtful);
        assert_true(outside > PIXELS / 50);
        assert_float_within(renderer_out_of_gamut(renderer), (double)outside / PIXELS,
                            (doubtful + 0.5) / PIXELS);
    }
    surface_fini(&s->surface);
    free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_is_inverted_to_half_a_code_all_over_its_gamut),
        cmocka_unit_test(what_is_out_of_gamut_is_flagged_for_every_kind),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
