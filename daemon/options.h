// SPDX-License-Identifier: Apache-2.0
// boothd's command line.
#ifndef DAEMON_OPTIONS_H
#define DAEMON_OPTIONS_H

#include "daemon/setup.h"

enum boothd_mode {
    MODE_RUN,
    MODE_CHECK,        // load everything, say what is missing
    MODE_DESCRIBE,     // commented default settings
    MODE_DESCRIBE_MAN, // the same for boothd.conf(5)
    MODE_UDEV,         // rules of the instruments' devices
    MODE_VERSION,
    MODE_HELP,
};

struct boothd_options {
    enum boothd_mode mode;
    bool verbose;
    char config[512];
    char socket[108];           // "" = as the settings say
    struct setup_source source; // path points to config
};

// Errors: CONFIG, with the option. The home folders come from the environment
// variables given (may be NULL).
bool options_parse(int argc, char **argv, const char *config_home, const char *home,
                   struct boothd_options *out, struct error *err);

extern const char boothd_help[];

#endif
