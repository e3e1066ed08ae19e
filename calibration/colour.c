// SPDX-License-Identifier: Apache-2.0
// boothcal colour: CIEDE2000 of pairs, colours of spectra.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/colour_spectrum.h"
#include "calibration/commands.h"
#include "colorimetry/colour.h"

enum { PAIR = 6 };

static bool is_gap(char c)
{
    return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r' || c == '\n';
}

static const char *skip_gap(const char *at)
{
    while (*at && is_gap(*at))
        at++;
    return at;
}

// Six finite numbers of a line, no more and no fewer.
static bool six_numbers(const char *line, double v[PAIR], struct error *err)
{
    const char *at = skip_gap(line);
    for (int i = 0; i < PAIR; i++) {
        char *end;
        v[i] = strtod(at, &end);
        int size = (int)strcspn(at, " \t,;\r\n");
        if (size == 0)
            return fail(err, ERROR_DATA, "%d number(s); it must be six: L1 a1 b1 L2 a2 b2", i);
        if (end != at + size || !isfinite(v[i]))
            return fail(err, ERROR_DATA, "\"%.*s\" is not a finite number; it must be six: "
                                         "L1 a1 b1 L2 a2 b2",
                        size > 40 ? 40 : size, at);
        at = skip_gap(end);
    }
    if (*at)
        return fail(err, ERROR_DATA, "more than six numbers; it must be six: L1 a1 b1 L2 a2 b2");
    return true;
}

// Names only, as in "L1,a1,b1,L2,a2,b2".
static bool is_header(const char *line)
{
    int names = 0;
    for (const char *at = skip_gap(line); *at; at = skip_gap(at), names++) {
        char *end;
        strtod(at, &end);
        if (end != at)
            return false;
        at += strcspn(at, " \t,;\r\n");
    }
    return names == PAIR;
}

static bool all_differences(FILE *in, const char *name, FILE *out, struct error *err)
{
    char *line = NULL;
    size_t room = 0;
    bool ok = true;
    for (int number = 1; ok && getline(&line, &room, in) >= 0; number++) {
        const char *text = skip_gap(line);
        double v[PAIR];
        if (!*text || *text == '#' || (number == 1 && is_header(text)))
            continue;
        ok = six_numbers(text, v, err) || while_doing(err, "%s:%d", name, number);
        if (ok)
            fprintf(out, "%.6f\n",
                    delta_e_2000((struct lab){v[0], v[1], v[2]}, (struct lab){v[3], v[4], v[5]}));
    }
    if (ok && ferror(in))
        ok = fail_errno(err, "%s", name);
    free(line);
    return ok;
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
    bool ok = all_differences(in, name, out, &err);
    ok = fclose(out) == 0 && ok;
    if (ok)
        fwrite(text, 1, size, stdout);
    free(text);
    return ok ? COMMAND_FINE : command_bad_input(&err);
}

static int command_deltae(int argc, char **argv)
{
    if (argc == 2 && !strcmp(argv[1], "--help")) {
        puts("usage: boothcal colour deltae [FILE]\n"
             "Reads L1 a1 b1 L2 a2 b2 a line from FILE or standard input; writes CIEDE2000.");
        return COMMAND_FINE;
    }
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
         "CIEDE2000 of pairs: reads \"L1 a1 b1 L2 a2 b2\" a line, writes one number a line."},
        {"spectrum", command_colour_spectrum,
         "--light FILE|NAME [--reflectance TABLE] [--observer NAME]\n"
         "      [--mode full|bands|product] [--bands FILE|COUNT] [--json]",
         "XYZ (Y = 100 for the perfect white), Lab, xy, CCT and Duv of spectra."},
        {NULL, NULL, NULL, NULL},
    };
    return command_run("boothcal colour", TABLE, argc, argv);
}
