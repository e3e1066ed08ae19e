// SPDX-License-Identifier: Apache-2.0
// boothctl without its process: command line to request, reply to words.
#ifndef DAEMON_CTL_H
#define DAEMON_CTL_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

#include "base/error.h"

struct ctl {
    char socket[108]; // "" = the default one
    bool json, help, version;
    double timeout_s; // 0 = as long as the command may take
    json_t *request;  // owned
    const char *what; // "status", …
};

// Errors: CONFIG (usage) and RANGE (a value), one line.
bool ctl_parse(int argc, char **argv, struct ctl *out, struct error *err);

// How long the answer may take.
int ctl_timeout_ms(const struct ctl *ctl);

// Writes a reply as a person reads it.
void ctl_print(const char *what, const json_t *reply, FILE *out);

// Whether it was done with a warning.
bool ctl_warned(const json_t *reply);

extern const char ctl_help[];

#endif
