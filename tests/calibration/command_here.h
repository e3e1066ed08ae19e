// SPDX-License-Identifier: Apache-2.0
// Runs a family of boothcal in the test's own process. Include after
// tests/fakes/support.h.
#ifndef TESTS_CALIBRATION_COMMAND_H
#define TESTS_CALIBRATION_COMMAND_H

#include <unistd.h>

struct command_here {
    int code;
    char said[1 << 20], complained[8192]; // standard output and error
};

static inline int command_divert(FILE *stream, FILE **into)
{
    *into = tmpfile();
    assert_non_null(*into);
    fflush(stream);
    int kept = dup(fileno(stream));
    dup2(fileno(*into), fileno(stream));
    return kept;
}

static inline void command_restore(FILE *stream, int kept, FILE *from, char *text, size_t size)
{
    fflush(stream);
    dup2(kept, fileno(stream));
    close(kept);
    rewind(from);
    text[fread(text, 1, size - 1, from)] = 0;
    fclose(from);
}

// words: the command line after the family's name, NULL-terminated.
static inline void command_here(struct command_here *c, int (*family)(int argc, char **argv),
                                const char *name, const char *const *words)
{
    char *argv[64] = {(char *)name};
    int argc = 1;
    for (; words[argc - 1] && argc < 63; argc++)
        argv[argc] = (char *)words[argc - 1];
    FILE *out, *err;
    int kept_out = command_divert(stdout, &out), kept_err = command_divert(stderr, &err);
    c->code = family(argc, argv);
    command_restore(stderr, kept_err, err, c->complained, sizeof c->complained);
    command_restore(stdout, kept_out, out, c->said, sizeof c->said);
}

#endif
