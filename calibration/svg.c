// SPDX-License-Identifier: Apache-2.0
#include "calibration/svg.h"

#include <math.h>

static const int LEFT = 60, RIGHT = 12, TOP = 26, BOTTOM = 44;

struct axis {
    double low, high, step;
    int size; // of the whole plot along it, in units of the view box
};

static struct axis axis_over(double low, double high, int size)
{
    double span = high > low ? high - low : 1;
    double power = pow(10, floor(log10(span / 5)));
    double rest = span / 5 / power;
    double step = power * (rest <= 1 ? 1 : rest <= 2 ? 2 : rest <= 5 ? 5 : 10);
    return (struct axis){floor(low / step) * step, ceil(high / step) * step, step, size};
}

static double at_x(const struct axis *a, double v)
{
    return LEFT + (v - a->low) / (a->high - a->low) * (a->size - LEFT - RIGHT);
}

static double at_y(const struct axis *a, double v)
{
    return a->size - BOTTOM - (v - a->low) / (a->high - a->low) * (a->size - TOP - BOTTOM);
}

void svg_escaped(FILE *out, const char *text)
{
    for (; *text; text++) {
        const char *safe = *text == '<' ? "&lt;" : *text == '>' ? "&gt;" : *text == '&' ? "&amp;" : NULL;
        if (safe)
            fputs(safe, out);
        else
            fputc(*text, out);
    }
}

static void open_plot(FILE *out, const struct axis *x, const struct axis *y, const char *y_label)
{
    fprintf(out, "<svg viewBox=\"0 0 %d %d\" style=\"max-width:%dpx\" role=\"img\" class=\"plot\">\n",
            x->size, y->size, x->size);
    fprintf(out, "<text x=\"4\" y=\"14\">%s</text>\n", y_label);
}

static void y_ticks(FILE *out, const struct axis *a, int width)
{
    for (double v = a->low; v <= a->high + a->step / 2; v += a->step)
        fprintf(out,
                "<line class=\"grid\" x1=\"%d\" x2=\"%d\" y1=\"%.1f\" y2=\"%.1f\"/>"
                "<text x=\"%d\" y=\"%.1f\" text-anchor=\"end\">%.4g</text>\n",
                LEFT, width - RIGHT, at_y(a, v), at_y(a, v), LEFT - 5, at_y(a, v) + 4,
                fabs(v) < a->step / 1e6 ? 0 : v);
}

static void x_ticks(FILE *out, const struct axis *a, int height, const char *label)
{
    for (double v = a->low; v <= a->high + a->step / 2; v += a->step)
        fprintf(out, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%.4g</text>\n", at_x(a, v),
                height - BOTTOM + 16, fabs(v) < a->step / 1e6 ? 0 : v);
    fprintf(out, "<text x=\"%d\" y=\"%d\" text-anchor=\"end\">%s</text>\n", a->size - RIGHT, height - 6,
            label);
}

static void legend_entry(FILE *out, int index, const char *name, const char *colour)
{
    int x = 160 + 110 * index;
    fprintf(out,
            "<rect x=\"%d\" y=\"5\" width=\"10\" height=\"10\" fill=\"%s\"/><text x=\"%d\" y=\"14\">",
            x, colour, x + 14);
    svg_escaped(out, name);
    fprintf(out, "</text>\n");
}

static void range_of(const struct svg_series *s, int count, struct axis *x, struct axis *y)
{
    double x0 = INFINITY, x1 = -INFINITY, y1 = 0;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < s[i].count; k++) {
            x0 = fmin(x0, s[i].x[k]);
            x1 = fmax(x1, s[i].x[k]);
            y1 = fmax(y1, s[i].y[k]);
        }
    }
    *x = axis_over(x0, x1, 720);
    *y = axis_over(0, y1, 300);
}

void svg_lines(FILE *out, const char *x_label, const char *y_label, const struct svg_series *series,
               int count)
{
    struct axis x, y;
    range_of(series, count, &x, &y);
    open_plot(out, &x, &y, y_label);
    y_ticks(out, &y, x.size);
    x_ticks(out, &x, y.size, x_label);
    for (int i = 0; i < count; i++) {
        fprintf(out, "<polyline fill=\"none\" stroke=\"%s\" points=\"", series[i].colour);
        for (int k = 0; k < series[i].count; k++)
            fprintf(out, "%.1f,%.1f ", at_x(&x, series[i].x[k]), at_y(&y, series[i].y[k]));
        fprintf(out, "\"/>\n");
        legend_entry(out, i, series[i].name, series[i].colour);
    }
    fprintf(out, "</svg>\n");
}

static void locus(FILE *out, enum observer observer, const struct axis *x, const struct axis *y)
{
    const struct spectrum *cmf = observer_cmf(observer);
    fprintf(out, "<polygon class=\"locus\" points=\"");
    for (int i = 40; i <= 320; i += 2) {
        struct uv c = uv_of((struct xyz){cmf[0].v[i], cmf[1].v[i], cmf[2].v[i]});
        fprintf(out, "%.1f,%.1f ", at_x(x, c.u), at_y(y, c.v));
    }
    fprintf(out, "\"/>\n");
}

void svg_chromaticities(FILE *out, enum observer observer, const struct svg_series *series, int count)
{
    struct axis x = {0, 0.7, 0.1, 562}, y = {0, 0.6, 0.1, 490};
    open_plot(out, &x, &y, "v&#8242;");
    y_ticks(out, &y, x.size);
    x_ticks(out, &x, y.size, "u&#8242;");
    locus(out, observer, &x, &y);
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < series[i].count; k++)
            fprintf(out, "<circle r=\"2.5\" cx=\"%.1f\" cy=\"%.1f\" fill=\"%s\"/>\n",
                    at_x(&x, series[i].x[k]), at_y(&y, series[i].y[k]), series[i].colour);
        legend_entry(out, i, series[i].name, series[i].colour);
    }
    fprintf(out, "</svg>\n");
}

void svg_bars(FILE *out, const char *y_label, const char *const *names, const double *values,
              int count, int groups, const char *const *colours, const char *const *legend)
{
    double most = 0;
    for (int i = 0; i < count * groups; i++)
        most = fmax(most, values[i]);
    struct axis x_axis = {0, count, 1, 720}, y = axis_over(0, fmax(most, 0.1), 300);
    double bar = (at_x(&x_axis, 1) - at_x(&x_axis, 0)) * 0.8 / groups;
    open_plot(out, &x_axis, &y, y_label);
    y_ticks(out, &y, x_axis.size);
    for (int i = 0; i < count; i++) {
        double x = at_x(&x_axis, i + 0.1);
        for (int g = 0; g < groups; g++)
            fprintf(out,
                    "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\"/>\n",
                    x + g * bar, at_y(&y, values[i * groups + g]), bar,
                    at_y(&y, 0) - at_y(&y, values[i * groups + g]), colours[g]);
        fprintf(out,
                "<text class=\"small\" transform=\"translate(%.1f %d) rotate(-35)\" "
                "text-anchor=\"end\">",
                at_x(&x_axis, i + 0.6), y.size - BOTTOM + 12);
        svg_escaped(out, names[i]);
        fprintf(out, "</text>\n");
    }
    for (int g = 0; g < groups; g++)
        legend_entry(out, g, legend[g], colours[g]);
    fprintf(out, "</svg>\n");
}
