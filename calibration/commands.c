// SPDX-License-Identifier: Apache-2.0
#include "calibration/commands.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static void print_help(const char *family, const struct command *table, FILE *out)
{
    fprintf(out, "usage:\n");
    for (const struct command *c = table; c->name; c++)
        fprintf(out, "  %s %s%s%s\n      %s\n", family, c->name, *c->arguments ? " " : "",
                c->arguments, c->help);
}

int command_run(const char *family, const struct command *table, int argc, char **argv)
{
    if (argc < 2) {
        print_help(family, table, stderr);
        return COMMAND_USAGE;
    }
    if (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help")) {
        print_help(family, table, stdout);
        return COMMAND_FINE;
    }
    for (const struct command *c = table; c->name; c++)
        if (!strcmp(argv[1], c->name))
            return c->run(argc - 1, argv + 1);
    return command_bad_usage("%s: there is no \"%s\"; see %s --help", family, argv[1], family);
}

int command_bad_usage(const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vfprintf(stderr, format, args);
    va_end(args);
    fputc('\n', stderr);
    return COMMAND_USAGE;
}

int command_bad_input(const struct error *err)
{
    fprintf(stderr, "boothcal: %s\n", err->text);
    return COMMAND_USAGE;
}

int command_failed(const struct error *err)
{
    fprintf(stderr, "boothcal: %s\n", err->text);
    return COMMAND_FAILED;
}
