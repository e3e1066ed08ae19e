// SPDX-License-Identifier: Apache-2.0
#include "calibration/commands.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

// From the empty line on, or NULL.
static const char *options_of(const struct command *c)
{
    return strstr(c->help, "\n\n");
}

static void print_help(const char *family, const struct command *table, FILE *out)
{
    fprintf(out, "usage:\n");
    for (const struct command *c = table; c->name; c++) {
        const char *options = options_of(c);
        int size = options ? (int)(options - c->help) : (int)strlen(c->help);
        fprintf(out, "  %s %s%s%s\n      %.*s\n", family, c->name, *c->arguments ? " " : "",
                c->arguments, size, c->help);
    }
}

static bool is_help(const char *text)
{
    return !strcmp(text, "--help") || !strcmp(text, "-h");
}

static int run_row(const char *family, const struct command *c, int argc, char **argv)
{
    for (int i = 1; options_of(c) && i < argc; i++)
        if (is_help(argv[i])) {
            printf("usage: %s %s%s%s\n%s\n", family, c->name, *c->arguments ? " " : "",
                   c->arguments, c->help);
            return COMMAND_FINE;
        }
    return c->run(argc, argv);
}

int command_run(const char *family, const struct command *table, int argc, char **argv)
{
    if (argc < 2) {
        print_help(family, table, stderr);
        return COMMAND_USAGE;
    }
    if (is_help(argv[1]) || !strcmp(argv[1], "help")) {
        print_help(family, table, stdout);
        return COMMAND_FINE;
    }
    for (const struct command *c = table; c->name; c++)
        if (!strcmp(argv[1], c->name))
            return run_row(family, c, argc - 1, argv + 1);
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
    return error_exit_code(err);
}

int command_warned(const char *warning)
{
    if (!*warning)
        return COMMAND_FINE;
    fprintf(stderr, "boothcal: warning: %s\n", warning);
    return COMMAND_WARNED;
}
