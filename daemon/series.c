// SPDX-License-Identifier: Apache-2.0
#include "daemon/series.h"

#include <math.h>

static double mean_of(const uint16_t *raw, const struct pixel_range *ranges, int count)
{
    double sum = 0;
    int pixels = 0;
    for (int r = 0; r < count; r++)
        for (int i = ranges[r].first; i <= ranges[r].last; i++, pixels++)
            sum += raw[i];
    return pixels ? sum / pixels : 0;
}

static int saturated(const struct spectrum_counts *c)
{
    int count = 0;
    for (int i = c->detector.active.first; i <= c->detector.active.last; i++)
        count += c->raw[i] >= c->detector.saturation;
    return count;
}

static bool begin(struct series *s, const struct spectrum_counts *c)
{
    s->detector = c->detector;
    s->integration_us = c->integration_us;
    s->taken = c->taken;
    return true;
}

// Welford 1962: the running mean, and squares about it, without cancellation.
bool series_add(struct series *s, const struct spectrum_counts *c, struct error *err)
{
    bool alike = s->readings ? c->integration_us == s->integration_us &&
                                   c->detector.pixels == s->detector.pixels
                             : begin(s, c);
    if (!alike || s->readings == SERIES_MOST)
        return fail(err, ERROR_RETRY, "%s",
                    alike ? "a series has no room for more readings"
                          : "the spectrometer changed within a series");
    int n = ++s->readings, now = saturated(c);
    s->taken.latest_ns = c->taken.latest_ns;
    s->saturated = now > s->saturated ? now : s->saturated;
    s->active[n - 1] = mean_of(c->raw, &c->detector.active, 1);
    s->black[n - 1] = mean_of(c->raw, c->detector.black, DETECTOR_BLACK_RANGES);
    for (int i = 0; i < c->detector.pixels; i++) {
        double off = c->raw[i] - s->mean[i];
        s->mean[i] += off / n;
        s->squares[i] += off * (c->raw[i] - s->mean[i]);
        s->deviation[i] = n > 1 ? sqrt(fmax(s->squares[i], 0) / (n - 1)) : 0;
    }
    return true;
}
