// SPDX-License-Identifier: Apache-2.0
// An exposure series made up for tests: a scene as a formula, a camera whose
// counts follow a logarithm. Include after tests/fakes/support.h.
#ifndef TESTS_CALIBRATION_SERIES_H
#define TESTS_CALIBRATION_SERIES_H

#include "files/png.h"
#include "tests/fakes/folder.h"

enum { SERIES_MOST = 16 };

struct series {
    struct folder *folder;
    int width, height, channels, bits;
    double (*light)(double x, double y); // full exposures a second; pixel centres are whole
    bool linear;
    double electrons; // of full exposure; 0 = no noise
    int count;
    double seconds[SERIES_MOST];
    FILE *list;
};

static inline double series_chance(void)
{
    static uint64_t state = 88172645463325252u;
    double sum = 0;
    for (int i = 0; i < 12; i++) { // nearly normal, standard deviation 1
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        sum += (double)(state >> 11) / 9007199254740992.0;
    }
    return sum - 6;
}

// A steep logarithm and its inverse: share of full exposure, share of full counts.
static inline double series_count(double exposure)
{
    return log1p(60 * exposure) / log1p(60);
}

static inline double series_exposure(double count)
{
    return expm1(count * log1p(60)) / 60;
}

static inline void series_begin(struct series *s, const char *list)
{
    s->list = fopen(folder_at(s->folder, list), "w");
    assert_non_null(s->list);
}

static inline uint16_t series_code(const struct series *s, double exposure)
{
    double full = s->bits == 8 ? 255 : 65535;
    if (s->electrons > 0)
        exposure += sqrt(fmax(exposure, 0) / s->electrons) * series_chance();
    exposure = fmin(fmax(exposure, 0), 1);
    return (uint16_t)lround(full * (s->linear ? exposure : series_count(exposure)));
}

// One picture of any light, listed with those words.
static inline void series_picture(struct series *s, const char *name, const char *words,
                                  double seconds, double (*light)(double x, double y))
{
    struct picture p;
    struct error err;
    assert_true(picture_init(&p, s->width, s->height, s->channels, s->bits, &err));
    for (int i = 0; i < s->width * s->height; i++)
        for (int c = 0; c < s->channels; c++)
            p.samples[i * s->channels + c] =
                series_code(s, light(i % s->width, i / s->width) * seconds * (c == 2 ? 0.5 : 1));
    assert_true(png_save(folder_at(s->folder, name), &p, &err));
    picture_fini(&p);
    if (s->list)
        fprintf(s->list, "%s, %.9g%s\n", name, seconds, words);
}

static inline void series_lights(struct series *s)
{
    for (int i = 0; i < s->count; i++) {
        char name[32];
        snprintf(name, sizeof name, "light-%d.png", i);
        series_picture(s, name, "", s->seconds[i], s->light);
    }
}

static inline void series_end(struct series *s)
{
    fclose(s->list);
    s->list = NULL;
}

#endif
