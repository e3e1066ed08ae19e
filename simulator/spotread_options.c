// SPDX-License-Identifier: Apache-2.0
#include "simulator/spotread_options.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PORTS_MOST = 40 };

static bool refuse(char why[128], const char *text, const char *word)
{
    snprintf(why, 128, "%s '%s'", text, word);
    return false;
}

static bool take_observer(const char *name, struct spotread_options *o, char why[128])
{
    static const struct {
        const char *name;
        enum observer observer;
    } known[] = {{"1931_2", OBSERVER_1931_2},
                 {"1964_10", OBSERVER_1964_10},
                 {"2012_2", OBSERVER_2015_2}, // as the CIE then called its proposal
                 {"2012_10", OBSERVER_2015_10}};
    for (size_t i = 0; i < sizeof(known) / sizeof(known[0]); i++)
        if (!strcmp(name, known[i].name)) {
            o->observer = known[i].observer;
            return true;
        }
    return refuse(why, "Failed to read custom observer", name);
}

static bool take_value(char option, const char *value, struct spotread_options *o, char why[128])
{
    switch (option) {
    case 'c':
        o->port = atoi(value);
        return (o->port >= 1 && o->port <= PORTS_MOST) ||
               refuse(why, "-c parameter out of range", value);
    case 'y':
        o->display_type = value[0];
        return true;
    case 'X':
        o->correction = value;
        return true;
    case 'Q':
        return take_observer(value, o, why);
    default: // -Y and -W change nothing that is emulated
        return true;
    }
}

static bool take_flag(const char *word, struct spotread_options *o, char why[128])
{
    switch (word[1]) {
    case 'v':
        o->verbose = true;
        return true;
    case 's':
        o->spectrum = true;
        return true;
    case 'T':
        o->cct = true;
        return true;
    case 'N':
        o->no_calibration = true;
        return true;
    case 'H':
        o->high_res = true;
        return true;
    case 'a':
        o->ambient = true;
        return true;
    case 'x':
        o->form = SPOTREAD_YXY;
        return true;
    case 'h':
        o->form = SPOTREAD_LCH;
        return true;
    case 'u':
        o->form = SPOTREAD_YUV;
        return true;
    case 'e':
    case 'p':
        return !word[2] || refuse(why, "not emulated:", word);
    default:
        if (strchr("tfrSdViIFEAwRK", word[1]))
            return refuse(why, "not emulated:", word);
        return refuse(why, "Flag not recognised:", word);
    }
}

bool spotread_options(struct spotread_options *options, int argc, char **argv, char why[128])
{
    struct spotread_options *o = options;
    *o = (struct spotread_options){.port = 1};
    int i = 0;
    for (; i < argc && argv[i][0] == '-'; i++) {
        const char *word = argv[i];
        bool apart = word[1] && !word[2] && i + 1 < argc && argv[i + 1][0] != '-';
        const char *value = word[1] && word[2] ? word + 2 : apart ? argv[i + 1] : NULL;
        if (word[1] && strchr("cyXQYW", word[1])) {
            if (!value)
                return refuse(why, "Parameter expected following", word);
            if (!take_value(word[1], value, o, why))
                return false;
            i += apart;
        } else if (word[1] == 'O') {
            o->one = true;
            o->one_path = value;
            i += apart;
        } else if (word[1] == 'D') {
            i += apart && strchr("0123456789", *value);
        } else if (!take_flag(word, o, why)) {
            return false;
        }
    }
    o->log_path = i < argc ? argv[i] : NULL;
    return true;
}
