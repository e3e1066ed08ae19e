// SPDX-License-Identifier: Apache-2.0
// boothcal bands: derive what ships of the bands, and judge it on a chart.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "calibration/bands_optimise.h"
#include "calibration/commands.h"
#include "calibration/statistics.h"
#include "colorimetry/illuminant.h"
#include "config/bands_file.h"
#include "config/spectra.h"
#include "files/text.h"
#include "files/write.h"

static const char DATA_FOLDER[] =
    "/usr/share/psychtoolbox-3/PsychColorimetricData/PsychColorimetricMatFiles";

static const char TABLE_HEAD[] =
    "// SPDX-License-Identifier: Apache-2.0\n"
    "// Written by: boothcal bands optimise --basis reflectance_basis.c -o bands.c\n"
    "// clang-format off\n";

// ---- optimise --------------------------------------------------------------

struct task {
    const char *data, *out, *basis;
    int count; // 0: all
};

struct derived {
    struct band_training training;
    double samples[BASIS_VECTORS][BASIS_SAMPLES];
    struct band_set sets[BANDS_MOST + 1]; // by count
    double rms[BANDS_MOST + 1];
};

static void put_numbers(FILE *out, const char *format, const double *v, int count)
{
    int column = 100;
    for (int i = 0; i < count; i++) {
        char number[32];
        int size = snprintf(number, sizeof number, format, v[i]);
        column += size + 2;
        if (column > 90)
            column = fprintf(out, "\n       ") - 1 + size + 2;
        fprintf(out, " %s,", number);
    }
}

static void put_rows(FILE *out, const char *declaration, const char *format, const double *v,
                     int rows, int columns)
{
    fprintf(out, "\nconst double %s = {", declaration);
    for (int i = 0; i < rows; i++) {
        fprintf(out, "\n    {");
        put_numbers(out, format, v + i * columns, columns);
        fprintf(out, "\n    },");
    }
    fprintf(out, "\n};\n");
}

static bool write_basis(const char *path, const struct derived *d, struct error *err)
{
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    fputs(TABLE_HEAD, file.stream);
    fputs("// Reflectances of Munsell chips (Nickerson) and of natural and man-made objects\n"
          "// (Vrhel, Krinov, Koivisto), as Debian's psychtoolbox-3-common carries them: their\n"
          "// leading singular vectors at 390, 395 .. 730 nm, and the 128 that lie farthest\n"
          "// apart as coefficients. No sample of a Macbeth chart or ColorChecker is among them.\n"
          "#include \"colorimetry/tables/bands.h\"\n",
          file.stream);
    put_rows(file.stream, "REFLECTANCE_BASIS[BASIS_VECTORS][BASIS_SAMPLES]", "%.7f", d->samples[0],
             BASIS_VECTORS, BASIS_SAMPLES);
    put_rows(file.stream, "REFLECTANCE_ROWS[TRAINING_ROWS][BASIS_VECTORS]", "%.6f",
             d->training.coefficients[0], TRAINING_ROWS, BASIS_VECTORS);
    fprintf(file.stream, "\nconst double REFLECTANCE_WEIGHTS[TRAINING_ROWS] = {");
    put_numbers(file.stream, "%g", d->training.weights, TRAINING_ROWS);
    fprintf(file.stream, "\n};\n");
    return whole_file_commit(&file, err);
}

static bool write_shapes(const char *path, const struct derived *d, struct error *err)
{
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    fputs(TABLE_HEAD, file.stream);
    fputs("// Gaussian bands, centres and standard deviations in nm, that leave the least\n"
          "// CIEDE2000 over the training reflectances and nine lamps; rms is what they leave.\n"
          "#include \"colorimetry/tables/bands.h\"\n\n"
          "const struct band_shapes BAND_SHAPES[BANDS_MOST - BANDS_LEAST + 1] = {",
          file.stream);
    for (int n = BANDS_LEAST; n <= BANDS_MOST; n++) {
        fprintf(file.stream, "\n    // %d bands, rms %.3f\n    {{", n, d->rms[n]);
        put_numbers(file.stream, "%.2f", d->sets[n].centre_nm, n);
        fprintf(file.stream, "\n    }, {");
        put_numbers(file.stream, "%.2f", d->sets[n].width_nm, n);
        fprintf(file.stream, "\n    }},");
    }
    fprintf(file.stream, "\n};\n");
    return whole_file_commit(&file, err);
}

static bool derive(const struct task *task, struct derived *d, struct error *err)
{
    struct reflectances r = {0};
    bool ok = reflectances_load(task->data, &r, err) &&
              band_training_derive(&r, &d->training, d->samples, err);
    reflectances_fini(&r);
    for (int n = BANDS_LEAST; ok && n <= BANDS_MOST; n++) {
        if (task->count && n != task->count)
            continue;
        ok = band_set_optimise(&d->training, n, &d->sets[n], &d->rms[n], err) ||
             while_doing(err, "%d bands", n);
        if (ok)
            printf("%d bands: rms CIEDE2000 %.3f over rows and lamps of the training\n", n,
                   d->rms[n]);
        fflush(stdout);
    }
    return ok;
}

static bool write_all(const struct task *task, const struct derived *d, struct error *err)
{
    if (task->basis && !write_basis(task->basis, d, err))
        return false;
    return task->count ? bands_save(task->out, &d->sets[task->count], err)
                       : write_shapes(task->out, d, err);
}

// Before a minute of work.
static bool can_write(const char *path, struct error *err)
{
    struct whole_file file;
    struct stat s;
    if (path && !stat(path, &s) && S_ISDIR(s.st_mode))
        return fail(err, ERROR_CONFIG, "%s: is a directory", path);
    if (path && !whole_file_begin(&file, path, err))
        return false;
    if (path)
        whole_file_abandon(&file);
    return true;
}

static bool parse_optimise(int argc, char **argv, struct task *task)
{
    *task = (struct task){.data = DATA_FOLDER};
    char *end = "";
    for (int i = 1; i < argc; i += 2) {
        if (i + 1 == argc)
            return false;
        if (!strcmp(argv[i], "--count"))
            task->count = (int)strtol(argv[i + 1], &end, 10);
        else if (!strcmp(argv[i], "--data"))
            task->data = argv[i + 1];
        else if (!strcmp(argv[i], "--basis"))
            task->basis = argv[i + 1];
        else if (!strcmp(argv[i], "-o"))
            task->out = argv[i + 1];
        else
            return false;
        if (*end || (end != argv[i + 1] && !strcmp(argv[i], "--count") &&
                     (task->count < BANDS_LEAST || task->count > BANDS_MOST)))
            return false;
    }
    if (!task->out || (task->count && text_ends_with(task->out, ".c")) ||
        (task->basis && !strcmp(task->basis, task->out)))
        return false;
    if (!task->count && !text_ends_with(task->out, ".c"))
        task->count = BANDS_SHIPPED;
    return true;
}

static int command_optimise(int argc, char **argv)
{
    struct task task;
    struct error err;
    if (!parse_optimise(argc, argv, &task))
        return command_bad_usage("usage: boothcal bands optimise [--count 3..16] [--data FOLDER] "
                                 "[--basis BASIS.c] -o BANDS.ini|BANDS.c\n"
                                 "(a .c holds all counts: without --count)");
    struct derived *d = calloc(1, sizeof *d);
    int code = COMMAND_FINE;
    if (!d) {
        fail(&err, ERROR_SYSTEM, "out of memory");
        code = command_failed(&err);
    } else if (!can_write(task.out, &err) || !can_write(task.basis, &err))
        code = command_bad_input(&err);
    else if (!derive(&task, d, &err))
        code = command_failed(&err);
    else if (!write_all(&task, d, &err))
        code = command_failed(&err);
    free(d);
    return code;
}

// ---- check -----------------------------------------------------------------

static const char *const CHECK_LAMPS[] = {"A",    "D50",  "D65",  "FL2",    "FL8",   "FL3.15",
                                          "FL10", "FL11", "FL12", "LED-B3", "LED-V1"};
enum { CHECK_LAMP_COUNT = sizeof CHECK_LAMPS / sizeof *CHECK_LAMPS };

static bool check_lamp(const struct band_set *set, bool product, const struct spectrum *lamp,
                       const struct spectra *chart, double *de00, struct error *err)
{
    struct band_matrix m;
    struct xyz white = xyz_relative(lamp, NULL, OBSERVER_1931_2);
    if (!(product ? band_matrix_product(set, lamp, OBSERVER_1931_2, &m, err)
                  : band_matrix_adapted(set, lamp, OBSERVER_1931_2, &m, err)))
        return false;
    for (int i = 0; i < chart->count; i++) {
        struct lab exact, banded;
        struct bands c = bands_of(set, &chart->spectra[i]);
        if (!lab_of(xyz_relative(lamp, &chart->spectra[i], OBSERVER_1931_2), white, &exact, err) ||
            !lab_of(band_xyz(&m, &c), white, &banded, err))
            return false;
        de00[i] = delta_e_2000(exact, banded);
    }
    return true;
}

static bool check_set(const struct band_set *set, bool product, const struct spectra *chart,
                      double *de00, FILE *out, struct error *err)
{
    fprintf(out, "%2d %-8s", set->count, product ? "product" : "adapted");
    for (int n = 0; n < CHECK_LAMP_COUNT; n++) {
        struct spectrum lamp;
        if (!illuminant(CHECK_LAMPS[n], &lamp, err) ||
            !check_lamp(set, product, &lamp, chart, de00, err))
            return false;
        struct summary s = summarise(de00, chart->count);
        fprintf(out, " %5.2f/%5.2f", s.mean, s.max);
    }
    fputc('\n', out);
    return true;
}

static bool check_named(int argc, char **argv, const struct spectra *chart, double *de00, FILE *out,
                        struct error *err)
{
    static char *usual[] = {"6", "3", "4", "8", "12", "16", NULL};
    char **names = argc > 2 ? argv + 2 : usual;
    struct band_set set;
    fprintf(out, "CIEDE2000 mean/max of %d spectra against 1 nm\n           ", chart->count);
    for (int n = 0; n < CHECK_LAMP_COUNT; n++)
        fprintf(out, " %11s", CHECK_LAMPS[n]);
    fputc('\n', out);
    for (int i = 0; names[i]; i++)
        if (!bands_named(names[i], &set, err) || !check_set(&set, false, chart, de00, out, err) ||
            (set.count == BANDS_SHIPPED && !check_set(&set, true, chart, de00, out, err)))
            return false;
    return true;
}

// Nothing is printed before the last set was checked.
static bool print_check(int argc, char **argv, const struct spectra *chart, struct error *err)
{
    char *text = NULL;
    size_t size = 0;
    double *de00 = malloc((size_t)chart->count * sizeof *de00);
    FILE *out = open_memstream(&text, &size);
    bool ok = (de00 && out) || fail(err, ERROR_SYSTEM, "out of memory");
    ok = ok && check_named(argc, argv, chart, de00, out, err);
    if (out && fclose(out) && ok)
        ok = fail_errno(err, "no memory for the answer");
    if (ok)
        fwrite(text, 1, size, stdout);
    free(text);
    free(de00);
    return ok;
}

static int command_bands_check(int argc, char **argv)
{
    struct spectra chart = {0};
    struct error err;
    if (argc < 2 || argv[1][0] == '-')
        return command_bad_usage("usage: boothcal bands check CHART.csv [COUNT|BANDS.ini]...");
    if (!spectra_load(argv[1], true, &chart, &err))
        return command_bad_input(&err);
    bool ok = print_check(argc, argv, &chart, &err);
    int code = ok ? command_warned(chart.warning) : command_bad_input(&err);
    spectra_fini(&chart);
    return code;
}

int command_bands(int argc, char **argv)
{
    static const struct command TABLE[] = {
        {"optimise", command_optimise,
         "[--count 3..16] [--data FOLDER] [--basis BASIS.c] -o BANDS.ini|BANDS.c",
         "Derives the reflectance basis and the band shapes again (a minute; the same numbers\n"
         "      every time).\n"
         "\n"
         "  --count 3..16    bands of the set (default: 6); not with BANDS.c\n"
         "  --data FOLDER    of sur_nickerson, sur_vrhel, sur_krinov and sur_koivisto .mat\n"
         "                   (default: Debian's psychtoolbox-3-common)\n"
         "  --basis BASIS.c  also the basis, as in colorimetry/tables/reflectance_basis.c\n"
         "  -o BANDS.ini     one set, for --bands and [quality] bands\n"
         "  -o BANDS.c       all counts, as in colorimetry/tables/bands.c\n"
         "  --help"},
        {"check", command_bands_check, "CHART.csv [COUNT|BANDS.ini]...",
         "Prints how far band coefficients are from full spectra, lamp by lamp.\n"
         "\n"
         "  CHART.csv   reflectances, 0..1: nm, v1, v2, ... (or CGATS .sp)\n"
         "  COUNT       a shipped set, 3..16 bands (default: 6 3 4 8 12 16)\n"
         "  BANDS.ini   a set of your own\n"
         "  --help"},
        {NULL, NULL, NULL, NULL},
    };
    return command_run("boothcal bands", TABLE, argc, argv);
}
