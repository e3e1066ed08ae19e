// SPDX-License-Identifier: Apache-2.0
// boothcal colour: CIEDE2000 of pairs, colours of spectra.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/colour_spectrum.h"
#include "calibration/commands.h"
#include "calibration/lines.h"
#include "colorimetry/colour.h"

static bool all_differences(struct lines *l, FILE *out, struct error *err)
{
    bool end = false, first = true, any = false;
    for (; lines_next(l, &end, err); first = false) {
        double v[6];
        if (first && line_is_header(l->text))
            continue;
        if (!line_numbers(l->text, 6, "six numbers, L1 a1 b1 L2 a2 b2", v, err))
            return while_doing(err, "%s:%d", l->name, l->number);
        double apart = delta_e_2000((struct lab){v[0], v[1], v[2]}, (struct lab){v[3], v[4], v[5]});
        fprintf(out, "%.6f\n", apart);
        any = true;
    }
    if (end && !any)
        return fail(err, ERROR_DATA, "%s: no line of numbers; allowed: L1 a1 b1 L2 a2 b2 a line",
                    l->name);
    return end;
}

// Nothing is printed before the last line was understood.
static int print_differences(FILE *in, const char *name)
{
    struct error err;
    char *text = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&text, &size);
    if (!out) {
        fail_errno(&err, "no memory for the answer");
        return command_failed(&err);
    }
    struct lines lines = {.in = in, .name = name};
    bool ok = all_differences(&lines, out, &err);
    lines_fini(&lines);
    if (fclose(out) && ok)
        ok = fail_errno(&err, "no memory for the answer");
    if (ok)
        fwrite(text, 1, size, stdout);
    free(text);
    return ok ? COMMAND_FINE : command_bad_input(&err);
}

static int command_deltae(int argc, char **argv)
{
    if (argc > 2 || (argc == 2 && argv[1][0] == '-' && argv[1][1]))
        return command_bad_usage("usage: boothcal colour deltae [FILE]");
    if (argc < 2 || !strcmp(argv[1], "-"))
        return print_differences(stdin, "stdin");
    FILE *in = fopen(argv[1], "r");
    if (!in) {
        struct error err;
        fail_errno(&err, "%s", argv[1]);
        return command_bad_input(&err);
    }
    int code = print_differences(in, argv[1]);
    fclose(in);
    return code;
}

int command_colour(int argc, char **argv)
{
    static const struct command TABLE[] = {
        {"deltae", command_deltae, "[FILE]",
         "CIEDE2000 of pairs: reads \"L1 a1 b1 L2 a2 b2\" a line, writes one number a line.\n"
         "\n"
         "  FILE    numbers with a decimal point, separated by blanks, commas or semicolons; a\n"
         "          first line of names is passed over. Without FILE, or with -, standard input.\n"
         "  --help"},
        {"spectrum", command_colour_spectrum,
         "--light FILE|NAME [--reflectance TABLE] [--observer NAME]\n"
         "      [--mode full|bands|product] [--bands FILE|COUNT] [--json]",
         "XYZ (Y = 100 for the perfect white), Lab, xy, CCT and Duv of spectra.\n"
         "\n" COLOUR_SPECTRUM_OPTIONS},
        {NULL, NULL, NULL, NULL},
    };
    return command_run("boothcal colour", TABLE, argc, argv);
}
