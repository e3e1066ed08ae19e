// SPDX-License-Identifier: Apache-2.0
// Where the ceiling's places fall in a picture, and its picture from below.
#include "tests/fakes/support.h"

#include "calibration/ceiling_view.h"
#include "tests/fakes/folder.h"

static const double EXACT = 1e-9;  // pixels: projections in double, some of them inverted
static const double SOLVED = 1e-6; // pixels: OpenCV's iterations end at 1e-12 of a focal length
static const double FOUND =
    0.05; // pixels: 200 places along a side, light from 6 x 6 places of a pixel
static const double BILINEAR = 2e-3; // relative: a parabola between pixels

static const struct ceiling CEILING = {{0, 0.75, 0.05}, 0.9, 0.6};

static struct still_camera camera(void)
{
    return (struct still_camera){.lens = {410, 405, 322, 238, -0.12, 0.03, -0.0004, 0.0006, 0.002}};
}

// A camera under the ceiling that pitches and turns a little: where a place of
// the ceiling falls, by the formulas themselves.
static void project(const struct still_camera *c, double x, double z, double px[2])
{
    struct mat3 turn =
        mat3_mul(mat3_rotation(0, 0.06), mat3_mul(mat3_rotation(1, -0.04), mat3_rotation(2, 0.03)));
    // Camera: x right, y down (away from the observer), z up.
    struct vec3 p = mat3_apply(mat3_transpose(turn), (struct vec3){x - 0.02, -(z - 0.03), 0.7});
    double tangent[1][2] = {{p.x / p.z, p.y / p.z}}, seen[1][2];
    struct error err;
    assert_true(hdr_distort(&c->lens, (const double(*)[2])tangent, 1, seen, &err));
    px[0] = seen[0][0];
    px[1] = seen[0][1];
}

static void corners_of(const struct still_camera *c, double inset, double corner[4][2])
{
    double x = 0.45 - inset, z = 0.30 - inset;
    project(c, -x, -z, corner[0]);
    project(c, x, -z, corner[1]);
    project(c, x, z, corner[2]);
    project(c, -x, z, corner[3]);
}

static struct ceiling_view view_of(const struct still_camera *c)
{
    struct ceiling_view view;
    struct error err = {0};
    double corner[4][2];
    corners_of(c, c->inset_m, corner);
    if (!ceiling_view_make(c, 640, 480, (const double(*)[2])corner, &CEILING, &view, &err))
        print_error("%s\n", err.text);
    assert_string_equal(err.text, "");
    return view;
}

// ---- lens ------------------------------------------------------------------

static void distortion_is_that_of_brown_in_the_usual_order(void **state)
{
    (void)state;
    struct hdr_lens lens = {100, 200, 10, 20, -0.12, 0.03, -0.0004, 0.0006, -0.004};
    double tangent[1][2] = {{0.3, 0.4}}, px[1][2];
    struct error err;
    assert_true(hdr_distort(&lens, (const double(*)[2])tangent, 1, px, &err));
    // r2 = 0.25: factor 0.9718125; p1 = -0.0004 mostly y, p2 = 0.0006 mostly x.
    double x = 0.3 * 0.9718125 + 2 * -0.0004 * 0.12 + 0.0006 * (0.25 + 2 * 0.09);
    double y = 0.4 * 0.9718125 + -0.0004 * (0.25 + 2 * 0.16) + 2 * 0.0006 * 0.12;
    assert_near(px[0][0], 10 + 100 * x, EXACT);
    assert_near(px[0][1], 20 + 200 * y, EXACT);
}

static void undistorting_leads_back(void **state)
{
    (void)state;
    struct still_camera c = camera();
    struct error err;
    for (double x = 0; x < 640; x += 71)
        for (double y = 0; y < 480; y += 53) {
            double px[1][2] = {{x, y}}, tangent[1][2], back[1][2];
            assert_true(hdr_undistort(&c.lens, (const double(*)[2])px, 1, tangent, &err));
            assert_true(hdr_distort(&c.lens, (const double(*)[2])tangent, 1, back, &err));
            assert_near(back[0][0], x, SOLVED);
            assert_near(back[0][1], y, SOLVED);
        }
}

static void a_lens_that_folds_the_picture_is_refused(void **state)
{
    (void)state;
    struct hdr_lens lens = {100, 100, 0, 0, -1, 0, 0, 0, 0}; // r (1 - r2) never exceeds 0.385
    double px[1][2] = {{60, 0}}, tangent[1][2];
    struct error err;
    assert_false(hdr_undistort(&lens, (const double(*)[2])px, 1, tangent, &err));
    assert_int_equal(err.code, ERROR_DATA);
}

static void light_falls_off_with_cosine_and_polynomial(void **state)
{
    (void)state;
    struct still_camera c = {.cos4 = true};
    assert_near(still_camera_falloff(&c, (double[2]){0, 0}), 1, EXACT);
    assert_near(still_camera_falloff(&c, (double[2]){0.6, 0.8}), 0.25, EXACT); // 45 degrees
    c = (struct still_camera){.v2 = -0.2, .v4 = 0.1, .v6 = 0.01};
    assert_near(still_camera_falloff(&c, (double[2]){1, 1}), 1 - 0.4 + 0.4 + 0.08, EXACT);
}

static void a_lens_is_read_from_its_file(void **state)
{
    (void)state;
    struct folder folder;
    struct still_camera c;
    struct error err = {0};
    folder_open(&folder);
    const char *path = folder_put(&folder, "camera.ini",
                                  "[camera]\nwidth_px = 640\nheight_px = 480\nfx_px = 410\n"
                                  "fy_px = 405\ncx_px = 322\ncy_px = 238\nk1 = -0.12\ncos4 = yes\n"
                                  "[ceiling]\ntop = left\ninset_m = 0.012\n");
    assert_true(still_camera_load(path, &c, &err));
    assert_near(c.lens.fy_px, 405, 0);
    assert_near(c.lens.k1, -0.12, 0);
    assert_near(c.lens.k2, 0, 0);
    assert_true(c.cos4);
    assert_int_equal(c.top, SIDE_LEFT);
    assert_near(c.inset_m, 0.012, 0);
    assert_true(still_camera_fit(&c, 640, 480, &err));
    assert_false(still_camera_fit(&c, 641, 480, &err));
    assert_holds(err.text, "640 x 480");
    path = folder_put(&folder, "camera.ini", "[camera]\nwidth_px = 640\n");
    assert_false(still_camera_load(path, &c, &err));
    c = (struct still_camera){.cos4 = true};
    assert_false(still_camera_fit(&c, 640, 480, &err));
    assert_holds(err.text, "focal length");
    folder_close(&folder);
}

// ---- corners ---------------------------------------------------------------

static void every_place_of_the_ceiling_falls_where_it_does(void **state)
{
    (void)state;
    for (int k = 0; k < 2; k++) {
        struct still_camera c = camera();
        c.inset_m = k ? 0.012 : 0;
        struct ceiling_view view = view_of(&c);
        struct error err;
        for (double u = 0; u <= 1; u += 0.125)
            for (double v = 0; v <= 1; v += 0.125) {
                double uv[1][2] = {{u, v}}, px[1][2], wanted[2];
                assert_true(ceiling_view_pixels(&view, (const double(*)[2])uv, 1, px, &err));
                project(&c, (u - 0.5) * 0.9, (v - 0.5) * 0.6, wanted);
                assert_near(px[0][0], wanted[0], SOLVED);
                assert_near(px[0][1], wanted[1], SOLVED);
            }
    }
}

static void without_a_lens_four_corners_are_enough(void **state)
{
    (void)state;
    struct still_camera c = {0};
    double corner[4][2] = {{100, 400}, {500, 380}, {420, 80}, {160, 100}};
    double uv[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5, 0.5}}, px[5][2];
    struct ceiling_view view;
    struct error err;
    assert_true(ceiling_view_make(&c, 640, 480, (const double(*)[2])corner, &CEILING, &view, &err));
    assert_true(ceiling_view_pixels(&view, (const double(*)[2])uv, 5, px, &err));
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++)
            assert_near(px[i][k], corner[i][k], SOLVED);
    // The middle is where the diagonals meet.
    double ax = 420 - 100, ay = 80 - 400, bx = 160 - 500, by = 100 - 380;
    double t = ((500 - 100) * by - (380 - 400) * bx) / (ax * by - ay * bx);
    assert_near(px[4][0], 100 + t * ax, SOLVED);
    assert_near(px[4][1], 400 + t * ay, SOLVED);
}

static void refused(const double corner[4][2], const struct still_camera *c, const char *says)
{
    struct ceiling_view view;
    struct error err = {0};
    assert_false(ceiling_view_make(c, 640, 480, corner, &CEILING, &view, &err));
    assert_int_equal(err.code, ERROR_DATA);
    assert_holds(err.text, says);
}

static void corners_that_cannot_be_are_refused(void **state)
{
    (void)state;
    struct still_camera plain = {0}, known = camera();
    double turned[4][2];
    refused((const double[4][2]){{100, 400}, {500, 380}, {200, 300}, {160, 100}}, &plain, "convex");
    refused((const double[4][2]){{100, 400}, {500, 380}, {160, 100}, {420, 80}}, &plain, "convex");
    refused((const double[4][2]){{100, 400}, {100, 400}, {420, 80}, {160, 100}}, &plain, "convex");
    refused((const double[4][2]){{100, 100}, {500, 100}, {500, 400}, {100, 400}}, &plain,
            "clockwise");
    refused((const double[4][2]){{100, 400}, {700, 380}, {420, 80}, {160, 100}}, &plain,
            "far right corner, 700.0, 380.0, is outside");
    refused((const double[4][2]){{100, NAN}, {500, 380}, {420, 80}, {160, 100}}, &plain,
            "far left");
    corners_of(&known, 0, turned);
    double first[2] = {turned[0][0], turned[0][1]};
    memmove(turned[0], turned[1], 3 * sizeof turned[0]);
    memcpy(turned[3], first, sizeof first);
    refused((const double(*)[2])turned, &known, "not a rectangle of 1.50 to 1");
}

// ---- the picture from below ------------------------------------------------

static struct hdr blank(void)
{
    size_t count = 640 * 480;
    struct hdr h = {.width = 640,
                    .height = 480,
                    .light = calloc(count, sizeof(double)),
                    .sigma = calloc(count, sizeof(double)),
                    .clipped = calloc(count, 1)};
    for (size_t i = 0; i < count; i++)
        h.sigma[i] = 0.01;
    return h;
}

// Where the rays of pixel corners meet the ceiling, by inverting project();
// tangents of the pixels' middles. Made once for camera().
static double at_corner[481][641][2], at_middle[480][640][2];

static int make_places(void **state)
{
    (void)state;
    struct still_camera c = camera();
    struct mat3 turn =
        mat3_mul(mat3_rotation(0, 0.06), mat3_mul(mat3_rotation(1, -0.04), mat3_rotation(2, 0.03)));
    struct error err;
    for (int y = 0; y < 481; y++) {
        double px[641][2], tangent[641][2];
        for (int x = 0; x < 641; x++) {
            px[x][0] = x - 0.5;
            px[x][1] = y - 0.5;
        }
        if (!hdr_undistort(&c.lens, (const double(*)[2])px, 641, tangent, &err))
            return -1;
        for (int x = 0; x < 641; x++) {
            struct vec3 d = mat3_apply(turn, (struct vec3){tangent[x][0], tangent[x][1], 1});
            at_corner[y][x][0] = 0.02 + 0.7 * d.x / d.z;
            at_corner[y][x][1] = 0.03 - 0.7 * d.y / d.z;
        }
        for (int x = 0; x < 640; x++) {
            px[x][0] = x;
            px[x][1] = y;
        }
        if (y < 480 && !hdr_undistort(&c.lens, (const double(*)[2])px, 640, at_middle[y], &err))
            return -1;
    }
    return 0;
}

// u, v in 0..1 within the pixel; along it places run straight.
static void place_of(int x, int y, double u, double v, double at[2])
{
    for (int k = 0; k < 2; k++)
        at[k] = (1 - v) * ((1 - u) * at_corner[y][x][k] + u * at_corner[y][x + 1][k]) +
                v * ((1 - u) * at_corner[y + 1][x][k] + u * at_corner[y + 1][x + 1][k]);
}

enum { ACROSS = 6 }; // places through a pixel, a side

static void paint(struct hdr *h, double (*light)(double x, double z))
{
    for (int i = 0; i < 640 * 480; i++)
        for (int k = 0; k < ACROSS * ACROSS; k++) {
            double at[2];
            place_of(i % 640, i / 640, (k % ACROSS + 0.5) / ACROSS, (k / ACROSS + 0.5) / ACROSS,
                     at);
            h->light[i] += light(at[0], at[1]) / (ACROSS * ACROSS);
        }
}

static double soft(double x, double z)
{
    return 1 + 0.5 * sin(6 * x) + 0.3 * cos(8 * z) + x * z;
}

static void a_picture_of_a_smooth_ceiling_is_that_ceiling(void **state)
{
    (void)state;
    struct still_camera c = camera();
    c.cos4 = true;
    struct ceiling_view view = view_of(&c);
    struct hdr h = blank();
    struct ceiling_picture p;
    struct error err = {0};
    paint(&h, soft);
    for (int i = 0; i < 640 * 480; i++) {
        h.light[i] *= still_camera_falloff(&c, at_middle[i / 640][i % 640]);
        h.clipped[i] = at_corner[i / 640][i % 640][0] > 0.3;
    }
    assert_true(ceiling_view_take(&view, &h, 90, 60, &p, &err));
    for (int row = 0; row < 60; row++)
        for (int col = 0; col < 90; col++) {
            double x = (col + 0.5) * 0.01 - 0.45, z = (row + 0.5) * 0.01 - 0.30;
            assert_near(p.light[row * 90 + col], soft(x, z), BILINEAR * soft(x, z));
            assert_near(p.clipped[row * 90 + col], x > 0.3, fabs(x - 0.3) < 0.011 ? 1 : EXACT);
        }
    assert_true(p.px_across > 4 && p.px_across < 7); // 410 px over 0.7 m: 5.9 px to a centimetre
    assert_near(p.sigma[30 * 90 + 45], 0.01 / 5.9, 0.2 * 0.01 / 5.9); // and some falloff
    ceiling_picture_fini(&p);
    hdr_fini(&h);
}

// ---- corners that are found ------------------------------------------------

// A dim field with a bright tube, dark trim around it, walls beyond.
static double booth(double x, double z)
{
    if (fabs(x) > 0.45 || fabs(z) > 0.30)
        return 20;
    if (fabs(x) > 0.438 || fabs(z) > 0.288)
        return 0.5;
    double tube = exp(-pow((z - 0.05) / 0.03, 4)) / (1 + exp((fabs(x) - 0.38) / 0.01));
    return 60 + 40 * cos(3 * x) + 6000 * tube;
}

static void the_lit_field_is_found_to_a_twentieth_of_a_pixel(void **state)
{
    (void)state;
    struct still_camera c = camera();
    struct hdr h = blank();
    paint(&h, booth);
    double found[4][2], wanted[4][2];
    struct error err = {0};
    corners_of(&c, 0.012, wanted);
    // Seen from below the order of sides is near, right, far, left (clockwise from the top);
    // with another side on top the same places have other names.
    static const int FIRST[] = {[SIDE_NEAR] = 0, [SIDE_FAR] = 2, [SIDE_LEFT] = 3, [SIDE_RIGHT] = 1};
    for (int top = SIDE_NEAR; top <= SIDE_RIGHT; top++) {
        c.top = top;
        if (!ceiling_corners_find(&c, &h, found, &err))
            print_error("%s\n", err.text);
        for (int i = 0; i < 4; i++)
            for (int k = 0; k < 2; k++)
                assert_near(found[i][k], wanted[(i + FIRST[top]) % 4][k], FOUND);
    }
    hdr_fini(&h);
}

static double plain_ceiling(double x, double z)
{
    return fabs(x) < 0.45 && fabs(z) < 0.30 ? 100 - 60 * x * x : 25;
}

static void a_ceiling_without_trim_is_found_before_darker_walls(void **state)
{
    (void)state;
    struct still_camera c = camera();
    struct hdr h = blank();
    double found[4][2], wanted[4][2];
    struct error err = {0};
    paint(&h, plain_ceiling);
    corners_of(&c, 0, wanted);
    if (!ceiling_corners_find(&c, &h, found, &err))
        print_error("%s\n", err.text);
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++)
            assert_near(found[i][k], wanted[i][k], FOUND);
    hdr_fini(&h);
}

static void where_there_is_no_quadrilateral_none_is_found(void **state)
{
    (void)state;
    struct still_camera c = camera();
    struct hdr h = blank();
    double found[4][2];
    struct error err = {0};
    for (int i = 0; i < 640 * 480; i++)
        h.light[i] = hypot(i % 640 - 320, i / 640 - 240) < 150 ? 100 : 5; // round
    assert_false(ceiling_corners_find(&c, &h, found, &err));
    assert_int_equal(err.code, ERROR_DATA);
    for (int i = 0; i < 640 * 480; i++)
        h.light[i] = 100; // all over the picture
    assert_false(ceiling_corners_find(&c, &h, found, &err));
    hdr_fini(&h);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distortion_is_that_of_brown_in_the_usual_order),
        cmocka_unit_test(undistorting_leads_back),
        cmocka_unit_test(a_lens_that_folds_the_picture_is_refused),
        cmocka_unit_test(light_falls_off_with_cosine_and_polynomial),
        cmocka_unit_test(a_lens_is_read_from_its_file),
        cmocka_unit_test(every_place_of_the_ceiling_falls_where_it_does),
        cmocka_unit_test(without_a_lens_four_corners_are_enough),
        cmocka_unit_test(corners_that_cannot_be_are_refused),
        cmocka_unit_test(a_picture_of_a_smooth_ceiling_is_that_ceiling),
        cmocka_unit_test(the_lit_field_is_found_to_a_twentieth_of_a_pixel),
        cmocka_unit_test(a_ceiling_without_trim_is_found_before_darker_walls),
        cmocka_unit_test(where_there_is_no_quadrilateral_none_is_found),
    };
    return cmocka_run_group_tests(tests, make_places, NULL);
}
