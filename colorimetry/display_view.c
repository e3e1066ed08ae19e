// SPDX-License-Identifier: Apache-2.0
#include "colorimetry/display_view.h"

#include <math.h>
#include <string.h>

#define real double
#define view_root sqrt
#define view_exp exp
struct dense_handle {
    const double (*nodes)[VIEW_DENSE];
};
#define view_handle struct dense_handle
#define view_node(channel, column, row) ((channel).nodes[row][column])
#include "colorimetry/display_view.glsl"

const double VIEW_PLACES[VIEW_GRID] = {0.05, 0.275, 0.5, 0.725, 0.95};

static const char *const CHANNELS[VIEW_CHANNELS] = {"red", "green", "blue", "black"};
static const double GAIN_LEAST = 0.05, GAIN_MOST = 20, SINE_MOST = 0.99;
static const double CENTRE_OFF_MOST = 1e-9;
enum { DIRECTIONS = 72, RINGS = 20 };

void display_view_none(struct display_view *view)
{
    *view = (struct display_view){.sine_most = 0};
    for (int c = 0; c < VIEW_CHANNELS; c++) {
        for (int i = 0; i < VIEW_GRID * VIEW_GRID; i++)
            view->place[c][i / VIEW_GRID][i % VIEW_GRID] = 1;
        for (int i = 0; i < VIEW_DENSE * VIEW_DENSE; i++)
            view->dense[c][i / VIEW_DENSE][i % VIEW_DENSE] = 1;
    }
}

// Lagrange's weights of the measured places at t.
static void weights_at(double t, double w[VIEW_GRID])
{
    for (int i = 0; i < VIEW_GRID; i++) {
        w[i] = 1;
        for (int j = 0; j < VIEW_GRID; j++)
            if (j != i)
                w[i] *= (t - VIEW_PLACES[j]) / (VIEW_PLACES[i] - VIEW_PLACES[j]);
    }
}

static void fill_dense(const double place[VIEW_GRID][VIEW_GRID],
                       double dense[VIEW_DENSE][VIEW_DENSE])
{
    for (int row = 0; row < VIEW_DENSE; row++)
        for (int column = 0; column < VIEW_DENSE; column++) {
            double down[VIEW_GRID], across[VIEW_GRID], sum = 0;
            weights_at((double)row / (VIEW_DENSE - 1), down);
            weights_at((double)column / (VIEW_DENSE - 1), across);
            for (int i = 0; i < VIEW_GRID; i++)
                for (int j = 0; j < VIEW_GRID; j++)
                    sum += down[i] * across[j] * place[i][j];
            dense[row][column] = sum;
        }
}

static bool sound(double gain)
{
    return gain >= GAIN_LEAST && gain <= GAIN_MOST;
}

static double angle_gain(const double a[VIEW_TERMS], double u, double v)
{
    return view_angle(a[0], a[1], a[2], a[3], a[4], a[5], a[6], u, v);
}

static bool check_angles(const struct display_view *view, int c, struct error *err)
{
    for (int ring = 1; ring <= RINGS; ring++)
        for (int d = 0; d < DIRECTIONS; d++) {
            double s = view->sine_most * ring / RINGS, turn = 2 * M_PI * d / DIRECTIONS;
            double gain = angle_gain(view->angle[c], s * cos(turn), s * sin(turn));
            if (!sound(gain))
                return fail(err, ERROR_DATA,
                            "%s: gain %g at %.0f degrees to the normal is outside %g..%g",
                            CHANNELS[c], gain, asin(s) * 180 / M_PI, GAIN_LEAST, GAIN_MOST);
        }
    return true;
}

static bool check_places(const struct display_view *view, int c, struct error *err)
{
    const double centre = view->place[c][VIEW_GRID / 2][VIEW_GRID / 2];
    if (!(fabs(centre - 1) <= CENTRE_OFF_MOST))
        return fail(err, ERROR_DATA, "%s: gain %g at the centre; it is 1 there", CHANNELS[c],
                    centre);
    for (int i = 0; i < VIEW_DENSE * VIEW_DENSE; i++)
        if (!sound(view->dense[c][i / VIEW_DENSE][i % VIEW_DENSE]))
            return fail(err, ERROR_DATA,
                        "%s: gain %g at %.2f, %.2f of the screen is outside %g..%g", CHANNELS[c],
                        view->dense[c][i / VIEW_DENSE][i % VIEW_DENSE],
                        (double)(i % VIEW_DENSE) / (VIEW_DENSE - 1),
                        (double)(i / VIEW_DENSE) / (VIEW_DENSE - 1), GAIN_LEAST, GAIN_MOST);
    return true;
}

bool display_view_prepare(struct display_view *view, struct error *err)
{
    if (!(view->sine_most >= 0 && view->sine_most <= SINE_MOST))
        return fail(err, ERROR_DATA, "sine of the outermost angle %g is outside 0..%g",
                    view->sine_most, SINE_MOST);
    for (int c = 0; c < VIEW_CHANNELS; c++) {
        fill_dense(view->place[c], view->dense[c]);
        if (!check_angles(view, c, err) || !check_places(view, c, err))
            return false;
    }
    return true;
}

struct view_gains display_view_gains(const struct display_view *view, double u, double v, double x,
                                     double y)
{
    double held = view_held(u, v, view->sine_most);
    struct view_gains out;
    for (int c = 0; c < VIEW_CHANNELS; c++)
        out.c[c] = angle_gain(view->angle[c], u * held, v * held) *
                   view_place((struct dense_handle){view->dense[c]}, x, y);
    return out;
}

static struct xyz black_times(const struct display_model *model, double k)
{
    return (struct xyz){k * model->matrix[0][3], k * model->matrix[1][3], k * model->matrix[2][3]};
}

// Linear light of XYZ less black, each times its factor, as XYZ again.
static struct xyz scaled(const struct display_model *m, struct xyz light, const double factor[3],
                         struct xyz black)
{
    double in[3] = {light.X, light.Y, light.Z}, out[3] = {black.X, black.Y, black.Z};
    for (int c = 0; c < 3; c++) {
        double linear = 0;
        for (int k = 0; k < 3; k++)
            linear += m->inverse[c][k] * in[k];
        for (int k = 0; k < 3; k++)
            out[k] += m->matrix[k][c] * linear * factor[c];
    }
    return (struct xyz){out[0], out[1], out[2]};
}

struct xyz display_view_ask(const struct display_model *model, struct view_gains g,
                            struct xyz target)
{
    struct xyz black = black_times(model, g.c[3]);
    struct xyz light = {target.X - black.X, target.Y - black.Y, target.Z - black.Z};
    return scaled(model, light, (double[]){1 / g.c[0], 1 / g.c[1], 1 / g.c[2]},
                  black_times(model, 1));
}

struct xyz display_view_leaves(const struct display_model *model, struct view_gains g,
                               struct xyz at_centre)
{
    struct xyz black = black_times(model, 1);
    struct xyz light = {at_centre.X - black.X, at_centre.Y - black.Y, at_centre.Z - black.Z};
    return scaled(model, light, g.c, black_times(model, g.c[3]));
}
