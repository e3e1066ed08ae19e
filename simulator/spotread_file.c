// SPDX-License-Identifier: Apache-2.0
#include "simulator/spotread_file.h"

#include "files/cgats.h"

enum { NAME_SIZE = 16, KEYWORDS = 6 };

static void fill(struct cgats *file, const struct spotread_bands *b, char *words[KEYWORDS],
                 char (*names)[NAME_SIZE])
{
    static char *const keys[] = {"DESCRIPTOR",        "MEAS_TYPE",       "SPECTRAL_BANDS",
                                 "SPECTRAL_START_NM", "SPECTRAL_END_NM", "SPECTRAL_NORM"};
    for (int i = 0; i < KEYWORDS; i++)
        file->keywords[i] = (struct cgats_keyword){.name = keys[i], .value = words[i]};
    for (int i = 0; i < b->count; i++) {
        snprintf(names[i], NAME_SIZE, "SPEC_%03d", (int)(spotread_band_nm(b, i) + 0.5));
        file->table.names[i] = names[i];
        file->table.values[i] = b->mw[i];
    }
}

bool spotread_save_spectrum(const char *path, const struct spotread_bands *bands, struct error *err)
{
    const struct spotread_bands *b = bands;
    char names[SPOTREAD_BANDS_MOST][NAME_SIZE], count[NAME_SIZE], first[NAME_SIZE], last[NAME_SIZE];
    char *columns[SPOTREAD_BANDS_MOST];
    double values[SPOTREAD_BANDS_MOST];
    char *words[KEYWORDS] = {"emulated spectrum", "EMISSION", count, first, last, "1.000000"};
    struct cgats_keyword keywords[KEYWORDS];
    struct cgats file = {.identifier = "SPECT", .keyword_count = KEYWORDS, .keywords = keywords};
    file.table =
        (struct table){.columns = (size_t)b->count, .rows = 1, .names = columns, .values = values};
    snprintf(count, sizeof(count), "%d", b->count);
    snprintf(first, sizeof(first), "%.6f", b->first_nm);
    snprintf(last, sizeof(last), "%.6f", b->last_nm);
    fill(&file, b, words, names);
    return cgats_save(path, &file, err);
}

bool spotread_log(FILE *log, int number, const struct spotread_reading *reading, bool with_bands)
{
    const struct spotread_bands *b = &reading->bands;
    const struct xyz *c = &reading->xyz;
    const struct lab *lab = &reading->lab;
    int count = with_bands ? b->count : 0;
    if (number == 1) {
        fprintf(log, "Reading\tX\tY\tZ\tL*\ta*\tb*");
        for (int i = 0; i < count; i++)
            fprintf(log, "\t%.3f", spotread_band_nm(b, i));
        fprintf(log, "\n");
    }
    fprintf(log, "%d\t%f\t%f\t%f\t%f\t%f\t%f", number, c->X, c->Y, c->Z, lab->L, lab->a, lab->b);
    for (int i = 0; i < count; i++)
        fprintf(log, "\t%g", b->mw[i]);
    fprintf(log, "\n");
    return fflush(log) == 0;
}
