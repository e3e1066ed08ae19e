// SPDX-License-Identifier: Apache-2.0
#include "config/bands_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/number.h"
#include "files/ini.h"

// Cosine between two bands' sensitivities; half a nanometre apart at a width of
// 30 nm reaches it, no set that ships does.
static const double ALIKE = 0.9999;

enum { LIST_ROOM = 512 };

struct bands_text {
    int count;
    char centre_nm[LIST_ROOM], width_nm[LIST_ROOM];
};

#define LIST(field, help)                                                                          \
    {                                                                                              \
#field, SETTING_TEXT, SETTING_FIELD(struct bands_text, field), LIST_ROOM, 0, 0, "nm",      \
            NULL, NULL, help                                                                       \
    }

static const struct setting ROWS[] = {
    {"count", SETTING_INT, SETTING_FIELD(struct bands_text, count), 0, BANDS_LEAST, BANDS_MOST, "",
     NULL, NULL, "Number of bands."},
    LIST(centre_nm, "Centres of the bands, count numbers."),
    LIST(width_nm, "Standard deviations of the bands, count numbers."),
    {0},
};

// Exactly count finite numbers separated by blanks.
static bool numbers(const char *path, const char *key, const char *text, int count, double *values,
                    struct error *err)
{
    const char *at = text;
    for (int i = 0; i < count; i++) {
        const char *end = at += strspn(at, " \t");
        if (!number_parse(at, &end, &values[i]) || (*end && *end != ' ' && *end != '\t'))
            return fail(err, ERROR_CONFIG, "%s: [bands] %s = %.80s: it must be %d numbers (count)",
                        path, key, text, count);
        at = end;
    }
    if (at[strspn(at, " \t")])
        return fail(err, ERROR_CONFIG, "%s: [bands] %s = %.80s: more than %d numbers (count)", path,
                    key, text, count);
    return true;
}

static double product(const struct spectrum *a, const struct spectrum *b)
{
    double sum = 0;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        sum += a->v[i] * b->v[i];
    return sum;
}

// Bands that are all but one leave no matrix that could be solved for.
static bool bands_differ(const struct band_set *set, struct error *err)
{
    const struct spectrum *s = set->sensitivity;
    for (int i = 1; i < set->count; i++)
        for (int j = 0; j < i; j++)
            if (product(&s[i], &s[j]) > ALIKE * sqrt(product(&s[i], &s[i]) * product(&s[j], &s[j])))
                return fail(err, ERROR_CONFIG,
                            "[bands] centre_nm, width_nm: bands %d and %d (%g and %g nm, widths %g "
                            "and %g nm) are too much alike",
                            j + 1, i + 1, set->centre_nm[j], set->centre_nm[i], set->width_nm[j],
                            set->width_nm[i]);
    return true;
}

bool bands_load(const char *path, struct band_set *out, struct error *err)
{
    struct bands_text text;
    double centre[BANDS_MOST], width[BANDS_MOST];
    struct band_set set;
    struct settings_section sections[] = {{"bands", ROWS, &text}, {0}};
    if (!ini_load(path, sections, err) ||
        !numbers(path, "centre_nm", text.centre_nm, text.count, centre, err) ||
        !numbers(path, "width_nm", text.width_nm, text.count, width, err))
        return false;
    if (!band_set_make(text.count, centre, width, &set, err) || !bands_differ(&set, err))
        return while_doing(err, "%s", path);
    *out = set;
    return true;
}

static void list(char text[LIST_ROOM], const double *values, int count)
{
    size_t used = 0;
    for (int i = 0; i < count; i++)
        used += (size_t)snprintf(text + used, LIST_ROOM - used, "%s%.10g", i ? " " : "", values[i]);
}

bool bands_save(const char *path, const struct band_set *set, struct error *err)
{
    struct bands_text text = {.count = set->count};
    list(text.centre_nm, set->centre_nm, set->count);
    list(text.width_nm, set->width_nm, set->count);
    struct settings_section sections[] = {{"bands", ROWS, &text}, {0}};
    return ini_save(path, sections, err);
}

bool bands_named(const char *count_or_path, struct band_set *out, struct error *err)
{
    char *end;
    long count = strtol(count_or_path, &end, 10);
    if (*end || end == count_or_path)
        return bands_load(count_or_path, out, err);
    if (count < BANDS_LEAST || count > BANDS_MOST)
        return fail(err, ERROR_RANGE, "%ld bands: outside %d..%d", count, BANDS_LEAST, BANDS_MOST);
    return band_set_shipped((int)count, out, err);
}
