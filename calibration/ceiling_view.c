// SPDX-License-Identifier: Apache-2.0
#include "calibration/ceiling_view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES_LEAST = 2, SAMPLES_MOST = 16 }; // across a pixel
static const double FINER = 1.5;               // samples to one of the camera's pixels
static const double NOT_RECTANGULAR = 0.1;
static const double FLAT_CORNER = 1e-3; // sine of an angle that is no corner

static bool inside(const double px[2], int width, int height)
{
    return px[0] >= -0.5 && px[1] >= -0.5 && px[0] <= width - 0.5 && px[1] <= height - 0.5;
}

// Sine of the turn at corner i, positive for clockwise as seen.
static double turn_at(const double corner[4][2], int i)
{
    const double *a = corner[i], *b = corner[(i + 1) % 4], *c = corner[(i + 2) % 4];
    double ax = b[0] - a[0], ay = b[1] - a[1], bx = c[0] - b[0], by = c[1] - b[1];
    double lengths = hypot(ax, ay) * hypot(bx, by);
    return lengths > 0 ? (ax * by - ay * bx) / lengths : 0;
}

static bool check_corners(const double corner[4][2], int width, int height, struct error *err)
{
    static const char *const NAMES[4] = {"far left", "far right", "near right", "near left"};
    int clockwise = 0, anticlockwise = 0;
    for (int i = 0; i < 4; i++) {
        if (!inside(corner[i], width, height))
            return fail(err, ERROR_DATA,
                        "the %s corner, %.1f, %.1f, is outside the picture of %d x %d pixels",
                        NAMES[i], corner[i][0], corner[i][1], width, height);
        clockwise += turn_at(corner, i) > FLAT_CORNER;
        anticlockwise += turn_at(corner, i) < -FLAT_CORNER;
    }
    if (clockwise == 4)
        return fail(err, ERROR_DATA,
                    "the corners far left, far right, near right, near left run clockwise; seen "
                    "from below they run the other way: is the picture mirrored, or their order "
                    "another?");
    return anticlockwise == 4 ||
           fail(err, ERROR_DATA, "the four corners are not those of a convex quadrilateral");
}

static void square_to(const double corner[4][2], double m[3][3])
{
    double x1 = corner[1][0] - corner[2][0], x2 = corner[3][0] - corner[2][0];
    double y1 = corner[1][1] - corner[2][1], y2 = corner[3][1] - corner[2][1];
    double sx = corner[0][0] - corner[1][0] + corner[2][0] - corner[3][0];
    double sy = corner[0][1] - corner[1][1] + corner[2][1] - corner[3][1];
    double det = x1 * y2 - x2 * y1, g = (sx * y2 - x2 * sy) / det, h = (x1 * sy - sx * y1) / det;
    for (int k = 0; k < 2; k++) {
        m[k][0] = corner[1][k] - corner[0][k] + g * corner[1][k];
        m[k][1] = corner[3][k] - corner[0][k] + h * corner[3][k];
        m[k][2] = corner[0][k];
    }
    m[2][0] = g;
    m[2][1] = h;
    m[2][2] = 1;
}

// Of the whole square, when the corners were those of a part inset by u and v.
static void widen(double m[3][3], double u, double v)
{
    double ku = 1 / (1 - 2 * u), kv = 1 / (1 - 2 * v);
    for (int i = 0; i < 3; i++) {
        m[i][2] -= m[i][0] * ku * u + m[i][1] * kv * v;
        m[i][0] *= ku;
        m[i][1] *= kv;
    }
}

static bool is_rectangle(const double m[3][3], const struct ceiling *c, struct error *err)
{
    struct vec3 across = {m[0][0], m[1][0], m[2][0]}, down = {m[0][1], m[1][1], m[2][1]};
    double width = vec3_length(across), depth = vec3_length(down);
    double ratio = width / depth, wanted = c->width_m / c->depth_m;
    double cosine = vec3_dot(across, down) / (width * depth);
    if (fabs(ratio / wanted - 1) <= NOT_RECTANGULAR && fabs(cosine) <= NOT_RECTANGULAR)
        return true;
    return fail(err, ERROR_DATA,
                "through this lens the corners show sides of %.2f to 1 at %.0f degrees, not a "
                "rectangle of %.2f to 1: is another side of the ceiling on top, or the lens "
                "another?",
                ratio, acos(fmin(fmax(cosine, -1), 1)) * 180 / M_PI, wanted);
}

bool ceiling_view_make(const struct still_camera *camera, int width, int height,
                       const double corner_px[4][2], const struct ceiling *ceiling,
                       struct ceiling_view *out, struct error *err)
{
    struct ceiling_view view = {.camera = *camera};
    double tangent[4][2], inset = camera->inset_m;
    double u = inset / ceiling->width_m, v = inset / ceiling->depth_m;
    if (!(inset >= 0 && u < 0.45 && v < 0.45))
        return fail(err, ERROR_RANGE, "an inset of %g m does not lie within %g x %g m", inset,
                    ceiling->width_m, ceiling->depth_m);
    if (!still_camera_fit(&view.camera, width, height, err) ||
        !check_corners(corner_px, width, height, err) ||
        !hdr_undistort(&view.camera.lens, corner_px, 4, tangent, err))
        return false;
    square_to((const double(*)[2])tangent, view.tangent_from_square);
    widen(view.tangent_from_square, u, v);
    if (camera->lens.fx_px > 0 && !is_rectangle(view.tangent_from_square, ceiling, err))
        return false;
    *out = view;
    return true;
}

static void tangents_of(const struct ceiling_view *view, const double (*uv)[2], int count,
                        double (*tangent)[2])
{
    const double(*m)[3] = view->tangent_from_square;
    for (int i = 0; i < count; i++) {
        double u = uv[i][0], v = uv[i][1], w = m[2][0] * u + m[2][1] * v + m[2][2];
        tangent[i][0] = (m[0][0] * u + m[0][1] * v + m[0][2]) / w;
        tangent[i][1] = (m[1][0] * u + m[1][1] * v + m[1][2]) / w;
    }
}

bool ceiling_view_pixels(const struct ceiling_view *view, const double (*uv)[2], int count,
                         double (*px)[2], struct error *err)
{
    double(*tangent)[2] = malloc((size_t)(count + 1) * sizeof *tangent);
    if (!tangent)
        return fail(err, ERROR_SYSTEM, "out of memory");
    tangents_of(view, uv, count, tangent);
    bool fine = hdr_distort(&view->camera.lens, (const double(*)[2])tangent, count, px, err);
    free(tangent);
    return fine;
}

// ---- the picture from below ------------------------------------------------

void ceiling_picture_fini(struct ceiling_picture *p)
{
    free(p->light);
    free(p->sigma);
    free(p->clipped);
    *p = (struct ceiling_picture){0};
}

// The camera's pixels along one of the map's, where they lie densest.
static bool measure_scale(const struct ceiling_view *view, int width, int height, double *least,
                          double *most, struct error *err)
{
    static const double AT[5][2] = {
        {0.02, 0.02}, {0.98, 0.02}, {0.5, 0.5}, {0.02, 0.98}, {0.98, 0.98}};
    double step_u = 1.0 / width, step_v = 1.0 / height;
    *least = INFINITY;
    *most = 0;
    for (int i = 0; i < 5; i++) {
        double uv[3][2] = {
            {AT[i][0], AT[i][1]}, {AT[i][0] + step_u, AT[i][1]}, {AT[i][0], AT[i][1] + step_v}};
        double px[3][2];
        if (!ceiling_view_pixels(view, (const double(*)[2])uv, 3, px, err))
            return false;
        for (int k = 1; k < 3; k++) {
            double length = hypot(px[k][0] - px[0][0], px[k][1] - px[0][1]);
            *least = fmin(*least, length);
            *most = fmax(*most, length);
        }
    }
    return true;
}

struct taking {
    const struct ceiling_view *view;
    const struct hdr *hdr;
    struct ceiling_picture *out;
    int across;                               // samples along a pixel's side
    double (*uv)[2], (*tangent)[2], (*px)[2]; // [width * across * across]
};

static int clamped(int v, int most)
{
    return v < 0 ? 0 : v > most ? most : v;
}

struct sample {
    double light, sigma, clipped;
};

static void sample_at(const struct taking *t, const double px[2], const double tangent[2],
                      struct sample *sum)
{
    const struct hdr *h = t->hdr;
    int x = (int)floor(px[0]), y = (int)floor(px[1]);
    double u = px[0] - x, v = px[1] - y;
    double falloff = still_camera_falloff(&t->view->camera, tangent);
    for (int k = 0; k < 4; k++) {
        size_t at = (size_t)clamped(y + k / 2, h->height - 1) * (size_t)h->width +
                    (size_t)clamped(x + k % 2, h->width - 1);
        double share = (k % 2 ? u : 1 - u) * (k / 2 ? v : 1 - v);
        sum->light += share * h->light[at] / falloff;
        sum->sigma += share * h->sigma[at] / falloff;
        sum->clipped += share * h->clipped[at];
    }
}

static bool take_row(struct taking *t, int row, double px_to_one, struct error *err)
{
    int n = t->across, width = t->out->width, each = n * n;
    for (int i = 0; i < width * each; i++) {
        int k = i % each;
        t->uv[i][0] = (i / each + (k % n + 0.5) / n) / width;
        t->uv[i][1] = (row + (k / n + 0.5) / n) / t->out->height;
    }
    tangents_of(t->view, (const double(*)[2])t->uv, width * each, t->tangent);
    if (!hdr_distort(&t->view->camera.lens, (const double(*)[2])t->tangent, width * each, t->px,
                     err))
        return false;
    for (int col = 0; col < width; col++) {
        struct sample sum = {0};
        size_t at = (size_t)row * (size_t)width + (size_t)col;
        for (int k = col * each; k < (col + 1) * each; k++)
            sample_at(t, t->px[k], t->tangent[k], &sum);
        t->out->light[at] = sum.light / each;
        t->out->sigma[at] = sum.sigma / each / fmax(1, px_to_one);
        t->out->clipped[at] = sum.clipped / each;
    }
    return true;
}

static bool take_rows(struct taking *t, double px_to_one, struct error *err)
{
    size_t row = (size_t)t->out->width * (size_t)t->across * (size_t)t->across;
    t->uv = malloc(row * sizeof *t->uv);
    t->tangent = malloc(row * sizeof *t->tangent);
    t->px = malloc(row * sizeof *t->px);
    bool fine = (t->uv && t->tangent && t->px) || fail(err, ERROR_SYSTEM, "out of memory");
    for (int y = 0; fine && y < t->out->height; y++)
        fine = take_row(t, y, px_to_one, err);
    free(t->uv);
    free(t->tangent);
    free(t->px);
    return fine;
}

bool ceiling_view_take(const struct ceiling_view *view, const struct hdr *hdr, int width,
                       int height, struct ceiling_picture *out, struct error *err)
{
    size_t count = (size_t)width * (size_t)height;
    double least, most;
    struct ceiling_picture p = {width,
                                height,
                                calloc(count, sizeof *p.light),
                                calloc(count, sizeof *p.sigma),
                                calloc(count, sizeof *p.clipped),
                                0};
    struct taking t = {.view = view, .hdr = hdr, .out = &p};
    bool fine = (p.light && p.sigma && p.clipped) ||
                fail(err, ERROR_SYSTEM, "no memory for %d x %d pixels", width, height);
    fine = fine && measure_scale(view, width, height, &least, &most, err);
    if (fine) {
        p.px_across = least;
        t.across = clamped((int)ceil(FINER * most), SAMPLES_MOST);
        t.across = t.across < SAMPLES_LEAST ? SAMPLES_LEAST : t.across;
        fine = take_rows(&t, sqrt(least * most), err);
    }
    if (fine)
        *out = p;
    else
        ceiling_picture_fini(&p);
    return fine;
}
