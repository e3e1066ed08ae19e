// SPDX-License-Identifier: Apache-2.0
#include "daemon/options.h"

#include <getopt.h>
#include <stdio.h>
#include <string.h>

const char boothd_help[] =
    "Usage: boothd [--config FILE] [--socket PATH] [--set SECTION.KEY=VALUE]... [--verbose]\n"
    "Shows on the proof screen what a surface would look like in the light booth,\n"
    "under the lamp that is on. Talk to it with boothctl.\n"
    "\n"
    "  --config FILE   settings (~/.config/boothd/boothd.conf)\n"
    "  --socket PATH   control socket, instead of the settings' one\n"
    "  --set S.K=V     one setting, instead of the file's\n"
    "  --verbose       log more\n"
    "  --check         load everything, say what is wrong or missing, and end\n"
    "  --describe      print every setting with its range and preset\n"
    "  --udev          print the udev rules of the instruments\n"
    "  --version, --help\n"
    "\n"
    "Ends with 0; 1 on failure; 2 on wrong usage, settings or files; --check ends\n"
    "with 3 when something is missing that a proof needs.\n";

enum { OPTION_CONFIG = 256, OPTION_SOCKET, OPTION_SET, OPTION_VERBOSE, OPTION_MODE };

static const struct option long_options[] = {
    {"config", required_argument, NULL, OPTION_CONFIG},
    {"socket", required_argument, NULL, OPTION_SOCKET},
    {"set", required_argument, NULL, OPTION_SET},
    {"verbose", no_argument, NULL, OPTION_VERBOSE},
    {"check", no_argument, NULL, OPTION_MODE + MODE_CHECK},
    {"describe", no_argument, NULL, OPTION_MODE + MODE_DESCRIBE},
    {"describe-man", no_argument, NULL, OPTION_MODE + MODE_DESCRIBE_MAN},
    {"udev", no_argument, NULL, OPTION_MODE + MODE_UDEV},
    {"version", no_argument, NULL, OPTION_MODE + MODE_VERSION},
    {"help", no_argument, NULL, OPTION_MODE + MODE_HELP},
    {0},
};

static bool take(int option, const char *value, struct boothd_options *o, struct error *err)
{
    switch (option) {
    case OPTION_CONFIG:
        if (snprintf(o->config, sizeof o->config, "%s", value) >= (int)sizeof o->config)
            return fail(err, ERROR_CONFIG, "--config: the path is too long");
        return true;
    case OPTION_SOCKET:
        if (snprintf(o->socket, sizeof o->socket, "%s", value) >= (int)sizeof o->socket)
            return fail(err, ERROR_CONFIG, "--socket: the path is longer than %zu characters",
                        sizeof o->socket - 1);
        return true;
    case OPTION_SET:
        if (o->source.override_count == OVERRIDES_MOST)
            return fail(err, ERROR_CONFIG, "--set: more than %d of them", OVERRIDES_MOST);
        o->source.overrides[o->source.override_count++] = value;
        return true;
    case OPTION_VERBOSE:
        o->verbose = true;
        return true;
    default:
        o->mode = option - OPTION_MODE;
        return true;
    }
}

static bool default_config(const char *config_home, const char *home, char *out, size_t size,
                           struct error *err)
{
    int length = config_home && *config_home == '/'
                     ? snprintf(out, size, "%s/boothd/boothd.conf", config_home)
                 : home ? snprintf(out, size, "%s/.config/boothd/boothd.conf", home)
                        : (int)size;
    return length < (int)size || fail(err, ERROR_CONFIG, "--config must name the settings file");
}

bool options_parse(int argc, char **argv, const char *config_home, const char *home,
                   struct boothd_options *o, struct error *err)
{
    int option;
    *o = (struct boothd_options){0};
    optind = 0; // getopt starts anew, so that tests may call this twice
    opterr = 0;
    while ((option = getopt_long(argc, argv, "", long_options, NULL)) != -1) {
        if (option == '?')
            return fail(err, ERROR_CONFIG,
                        "%s: unknown, or its value is missing; see boothd --help",
                        argv[optind - 1]);
        if (!take(option, optarg, o, err))
            return false;
    }
    if (optind < argc)
        return fail(err, ERROR_CONFIG, "\"%s\": no argument is expected; see boothd --help",
                    argv[optind]);
    o->source.path = o->config;
    bool needed = o->mode == MODE_RUN || o->mode == MODE_CHECK;
    return !needed || *o->config ||
           default_config(config_home, home, o->config, sizeof o->config, err);
}
