// SPDX-License-Identifier: Apache-2.0
#include "calibration/settle.h"

#include <math.h>

#include "calibration/statistics.h"

enum { REPEATS = 5 };

static const double SHORTER_S[] = {0.8, 0.4, 0.2, 0.1, 0.05, 0.025, 0};
static const double WHITE_RESOLVED = 1e-3, BLACK_RESOLVED = 1e-5; // of white's luminance
static const double SIGMAS = 3;

static bool repeat(settle_reader *read, void *context, bool white, double *mean, double *u,
                   struct error *err)
{
    double values[REPEATS];
    for (int i = 0; i < REPEATS; i++)
        if (!read(context, white, SETTLE_LONGEST_S, &values[i], err))
            return false;
    struct summary s = summarise(values, REPEATS);
    *mean = s.mean;
    *u = s.std;
    return true;
}

static bool stands(const struct settle *s, bool white, double luminance)
{
    double reference = white ? s->white : s->black, u = white ? s->white_u : s->black_u;
    double resolved = s->white * (white ? WHITE_RESOLVED : BLACK_RESOLVED);
    double spread = SIGMAS * u * sqrt(1 + 1.0 / REPEATS);
    return fabs(luminance - reference) <= fmax(spread, resolved);
}

bool settle_find(settle_reader *read, void *context, struct settle *out, struct error *err)
{
    struct settle s = {.seconds = SETTLE_LONGEST_S, .readings = 2 * REPEATS};
    if (!repeat(read, context, true, &s.white, &s.white_u, err) ||
        !repeat(read, context, false, &s.black, &s.black_u, err))
        return while_doing(err, "finding how long the display settles");
    for (unsigned i = 0; i < sizeof SHORTER_S / sizeof *SHORTER_S; i++) {
        double white, black;
        if (!read(context, true, SHORTER_S[i], &white, err) ||
            !read(context, false, SHORTER_S[i], &black, err))
            return while_doing(err, "finding how long the display settles");
        s.readings += 2;
        if (!stands(&s, true, white) || !stands(&s, false, black))
            break;
        s.seconds = SHORTER_S[i];
        s.settled = true;
    }
    *out = s;
    return true;
}
