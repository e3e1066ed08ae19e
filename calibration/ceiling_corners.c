// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/ceiling_view.h"

enum { COARSE_WIDTH = 640, THRESHOLDS = 80, RUN_LEAST = 3, SIDE_SAMPLES = 200, ROUNDS = 3 };
static const double STEP = 0.1;                          // of thresholds, in decades
static const double FILL_LEAST = 0.90, FILL_MOST = 1.12; // distortion bends sides; a disc has 1.57
static const double SAME_AREA = 0.06;  // of quadrilaterals at successive thresholds
static const double AREA_LEAST = 0.02; // of the picture
static const double ENDS = 0.06;       // of a side, where corners are rounded
static const double REACH_PX = 9, PROFILE_STEP_PX = 0.25;
static const double LEVEL_FROM_PX = 1.5,
                    LEVEL_TO_PX = 4; // from the edge, what is inside and outside
static const double OUTLIER_PX = 0.5;

// ---- roughly: thresholds of a coarse picture -------------------------------

struct coarse {
    int by, width, height; // pixels of the picture to one, a side
    double *light;
    uint8_t *mask;
    int seed_x, seed_y;
    double most;
};

static bool make_coarse(const struct hdr *h, struct coarse *c, struct error *err)
{
    int by = (h->width + COARSE_WIDTH - 1) / COARSE_WIDTH;
    *c = (struct coarse){.by = by, .width = h->width / by, .height = h->height / by};
    size_t count = (size_t)c->width * (size_t)c->height;
    c->light = calloc(count + 1, sizeof *c->light);
    c->mask = calloc(count + 1, 1);
    if (!c->light || !c->mask)
        return fail(err, ERROR_SYSTEM, "out of memory");
    for (int y = 0; y < c->height * by; y++)
        for (int x = 0; x < c->width * by; x++)
            c->light[(size_t)(y / by) * (size_t)c->width + (size_t)(x / by)] +=
                h->light[(size_t)y * (size_t)h->width + (size_t)x] / (by * by);
    for (size_t i = 0; i < count; i++)
        if (c->light[i] > c->most) {
            c->most = c->light[i];
            c->seed_x = (int)(i % (size_t)c->width);
            c->seed_y = (int)(i / (size_t)c->width);
        }
    return true;
}

struct quad {
    double corner[4][2]; // pixels of the picture, clockwise as seen
    double area;         // of the picture's; 0 = none at this threshold
};

static double area_of(const double corner[4][2])
{
    double twice = 0;
    for (int i = 0; i < 4; i++) {
        const double *a = corner[i], *b = corner[(i + 1) % 4];
        twice += a[0] * b[1] - b[0] * a[1];
    }
    return twice / 2;
}

static struct quad quad_at(struct coarse *c, double threshold)
{
    struct quad q = {.area = 0};
    double fill = 0;
    size_t count = (size_t)c->width * (size_t)c->height;
    for (size_t i = 0; i < count; i++)
        c->mask[i] = c->light[i] > threshold;
    if (!hdr_quadrilateral(c->mask, c->width, c->height, c->seed_x, c->seed_y, q.corner, &fill) ||
        fill < FILL_LEAST || fill > FILL_MOST)
        return q;
    double share = fabs(area_of((const double(*)[2])q.corner)) / (double)count;
    q.area = share >= AREA_LEAST ? share : 0;
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 2; k++)
            q.corner[i][k] = (q.corner[i][k] + 0.5) * c->by - 0.5;
    return q;
}

// The largest one that hardly changes over RUN_LEAST thresholds and more.
static bool find_quad(struct coarse *c, struct quad *out, struct error *err)
{
    struct quad run = {.area = 0}, best = {.area = 0};
    int length = 0;
    for (int i = 1; i <= THRESHOLDS; i++) {
        struct quad q = quad_at(c, c->most * pow(10, -STEP * i));
        bool same = q.area > 0 && fabs(q.area / run.area - 1) < SAME_AREA;
        length = same ? length + 1 : q.area > 0;
        run = q;
        if (length >= RUN_LEAST && q.area > best.area)
            best = q;
    }
    *out = best;
    return best.area > 0 ||
           fail(err, ERROR_DATA, "no lit quadrilateral is found in the pictures: give the corners");
}

// ---- finely: lines along the sides -----------------------------------------

struct finding {
    const struct hdr *hdr;
    struct hdr_lens lens;
    double px; // a pixel in tangents
};

static double light_at(const struct hdr *h, double x, double y)
{
    double cx = fmin(fmax(x, 0), h->width - 1.001), cy = fmin(fmax(y, 0), h->height - 1.001);
    int i = (int)cx, j = (int)cy;
    double u = cx - i, v = cy - j;
    const double *a = h->light + (size_t)j * (size_t)h->width + i, *b = a + h->width;
    return (1 - v) * ((1 - u) * a[0] + u * a[1]) + v * ((1 - u) * b[0] + u * b[1]);
}

enum { PROFILE = 73 }; // 2 REACH_PX / PROFILE_STEP_PX + 1

static double mean_between(const double *profile, double from_px, double to_px)
{
    double sum = 0;
    int n = 0;
    for (int i = 0; i < PROFILE; i++) {
        double at = i * PROFILE_STEP_PX - REACH_PX;
        if (at < from_px || at > to_px)
            continue;
        sum += profile[i];
        n++;
    }
    return n > 0 ? sum / n : NAN;
}

// Where the light of a profile, from inside to outside, falls steepest.
static double steepest(const double *profile)
{
    double most = 0, at = NAN;
    int margin = (int)(LEVEL_FROM_PX / PROFILE_STEP_PX);
    for (int i = margin; i < PROFILE - margin; i++) {
        double fall = profile[i - margin / 2] - profile[i + margin / 2];
        if (fall > most) {
            most = fall;
            at = i * PROFILE_STEP_PX - REACH_PX;
        }
    }
    return at;
}

// Pixels from the middle of the profile to where light is halfway between
// inside and outside; NAN when there is no edge.
static double halfway(const double *profile)
{
    double edge = steepest(profile);
    double in = mean_between(profile, edge - LEVEL_TO_PX, edge - LEVEL_FROM_PX);
    double out = mean_between(profile, edge + LEVEL_FROM_PX, edge + LEVEL_TO_PX);
    double half = (in + out) / 2, found = NAN;
    if (!(in > 1.2 * out))
        return NAN;
    for (int i = 1; i < PROFILE; i++) {
        double at = i * PROFILE_STEP_PX - REACH_PX, before = profile[i - 1], here = profile[i];
        if (fabs(at - edge) > LEVEL_FROM_PX + PROFILE_STEP_PX || before < half || here >= half)
            continue;
        found = at - PROFILE_STEP_PX * (half - here) / (before - here);
    }
    return found;
}

struct line {
    double at[2], along[2]; // tangents; along is of unit length
};

// One place of the edge near a point of a line, in tangents.
static bool edge_near(const struct finding *f, const double at[2], const double outward[2],
                      double edge[2], struct error *err)
{
    double tangent[PROFILE][2], px[PROFILE][2], profile[PROFILE];
    for (int i = 0; i < PROFILE; i++)
        for (int k = 0; k < 2; k++)
            tangent[i][k] = at[k] + (i * PROFILE_STEP_PX - REACH_PX) * f->px * outward[k];
    if (!hdr_distort(&f->lens, (const double(*)[2])tangent, PROFILE, px, err))
        return false;
    for (int i = 0; i < PROFILE; i++)
        profile[i] = light_at(f->hdr, px[i][0], px[i][1]);
    double d = halfway(profile);
    for (int k = 0; k < 2; k++)
        edge[k] = at[k] + d * f->px * outward[k];
    return true;
}

// Total least squares, points with weight 0 left out.
static struct line line_of(const double (*points)[2], const double *weight, int n)
{
    double sum = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
    for (int i = 0; i < n; i++) {
        sum += weight[i];
        x += weight[i] * points[i][0];
        y += weight[i] * points[i][1];
    }
    x /= sum;
    y /= sum;
    for (int i = 0; i < n; i++) {
        double dx = points[i][0] - x, dy = points[i][1] - y;
        xx += weight[i] * dx * dx;
        xy += weight[i] * dx * dy;
        yy += weight[i] * dy * dy;
    }
    double turn = atan2(2 * xy, xx - yy) / 2;
    return (struct line){{x, y}, {cos(turn), sin(turn)}};
}

static double distance_from(const struct line *l, const double p[2])
{
    return fabs((p[0] - l->at[0]) * l->along[1] - (p[1] - l->at[1]) * l->along[0]);
}

// Points farther off than twice the median, or half a pixel, are let go.
static bool fit_line(const struct finding *f, const double (*points)[2], int n, struct line *out)
{
    double weight[SIDE_SAMPLES];
    for (int i = 0; i < n; i++)
        weight[i] = 1;
    if (n < SIDE_SAMPLES / 4)
        return false;
    for (int round = 0; round < 6; round++) {
        *out = line_of(points, weight, n);
        double mean = 0;
        for (int i = 0; i < n; i++)
            mean += distance_from(out, points[i]) / n;
        double limit = fmax(OUTLIER_PX * f->px, 2 * mean);
        int kept = 0;
        for (int i = 0; i < n; i++) {
            weight[i] = distance_from(out, points[i]) <= limit;
            kept += weight[i] > 0;
        }
        if (kept < SIDE_SAMPLES / 4)
            return false;
    }
    return true;
}

static bool refine_side(const struct finding *f, const double from[2], const double to[2],
                        struct line *out, struct error *err)
{
    double points[SIDE_SAMPLES][2], dx = to[0] - from[0], dy = to[1] - from[1];
    double length = hypot(dx, dy), outward[2] = {dy / length, -dx / length};
    int n = 0;
    for (int i = 0; i < SIDE_SAMPLES; i++) {
        double s = ENDS + (1 - 2 * ENDS) * (i + 0.5) / SIDE_SAMPLES;
        double at[2] = {from[0] + s * dx, from[1] + s * dy};
        if (!edge_near(f, at, outward, points[n], err))
            return false;
        n += isfinite(points[n][0]);
    }
    return fit_line(f, (const double(*)[2])points, n, out) ||
           fail(err, ERROR_DATA, "a side of the lit field has no straight edge: give the corners");
}

static void cross(const struct line *a, const struct line *b, double out[2])
{
    double det = a->along[0] * b->along[1] - a->along[1] * b->along[0];
    double dx = b->at[0] - a->at[0], dy = b->at[1] - a->at[1];
    double t = (dx * b->along[1] - dy * b->along[0]) / det;
    out[0] = a->at[0] + t * a->along[0];
    out[1] = a->at[1] + t * a->along[1];
}

// corner: tangents, clockwise as seen; outward of the side from a to b is then
// to its left.
static bool refine(const struct finding *f, double corner[4][2], struct error *err)
{
    for (int round = 0; round < ROUNDS; round++) {
        struct line side[4];
        for (int i = 0; i < 4; i++)
            if (!refine_side(f, corner[i], corner[(i + 1) % 4], &side[i], err))
                return false;
        for (int i = 0; i < 4; i++)
            cross(&side[(i + 3) % 4], &side[i], corner[i]);
    }
    return true;
}

// From clockwise anywhere to far left, far right, near right, near left.
static void order(double corner[4][2], enum ceiling_side top)
{
    static const int FROM_TOP_RIGHT[] = {
        [SIDE_NEAR] = 2, [SIDE_FAR] = 0, [SIDE_LEFT] = 1, [SIDE_RIGHT] = 3};
    double anticlockwise[4][2], height[4];
    int right = 0;
    for (int i = 0; i < 4; i++)
        memcpy(anticlockwise[i], corner[3 - i], sizeof anticlockwise[i]);
    for (int i = 0; i < 4; i++)
        height[i] = anticlockwise[i][1] + anticlockwise[(i + 1) % 4][1];
    for (int i = 1; i < 4; i++)
        if (height[i] < height[right])
            right = i; // the top side begins at the top right
    for (int i = 0; i < 4; i++)
        memcpy(corner[i], anticlockwise[(right + FROM_TOP_RIGHT[top] + i) % 4], sizeof corner[i]);
}

bool ceiling_corners_find(const struct still_camera *camera, const struct hdr *hdr,
                          double corner_px[4][2], struct error *err)
{
    struct still_camera c = *camera;
    struct coarse coarse = {0};
    struct quad quad;
    double tangent[4][2];
    bool fine = still_camera_fit(&c, hdr->width, hdr->height, err) &&
                make_coarse(hdr, &coarse, err) && find_quad(&coarse, &quad, err);
    free(coarse.light);
    free(coarse.mask);
    struct finding f = {hdr, c.lens, 1 / c.lens.fx_px};
    if (!fine || !hdr_undistort(&c.lens, (const double(*)[2])quad.corner, 4, tangent, err) ||
        !refine(&f, tangent, err) ||
        !hdr_distort(&c.lens, (const double(*)[2])tangent, 4, corner_px, err))
        return false;
    order(corner_px, (enum ceiling_side)camera->top);
    return true;
}
