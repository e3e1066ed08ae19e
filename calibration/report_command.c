// SPDX-License-Identifier: Apache-2.0
// boothcal report: a session's facts made into a sealed report, and seals checked.
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/commands.h"
#include "calibration/facts_json.h"
#include "calibration/report.h"
#include "files/write.h"

enum { REPORT_BYTES = 1 << 28 };

static const char USAGE[] =
    "usage: boothcal report FOLDER [options]\n"
    "       boothcal report --check FILE...\n"
    "\n"
    "Makes FOLDER/report.json, .txt, .html and .pdf anew from FOLDER/session.json, which a\n"
    "session left there, with the uncertainty of every colour difference. Each is sealed: it\n"
    "lists the SHA-256 of every file it was made from, and ends with its own.\n"
    "\n"
    "  --uncertainty FILE   standard uncertainties of your instruments, section [uncertainty];\n"
    "                       without it presets (see --presets)\n"
    "  --draws N            of the Monte Carlo, 100..1000000 (default: 10000)\n"
    "  --environment TEXT   what is to be noted of it, such as \"23 C, 45 %\"\n"
    "  --check FILE...      whether sealed files are as they were, and the inputs of a\n"
    "                       report.json too\n"
    "  --presets            prints the uncertainties to begin with\n"
    "  --help\n"
    "\n"
    "Ends with 0; 1 when it failed or a seal is broken; 2 on wrong usage or input; 3 done, but\n"
    "an input has changed since or is no longer there.\n";

struct options {
    const char *uncertainty, *environment;
    char **files;
    int file_count, draws;
    bool check;
};

// ---- checking --------------------------------------------------------------------

static bool input_holds(const json_t *input)
{
    const char *path = json_string_value(json_object_get(input, "path"));
    const char *stated = json_string_value(json_object_get(input, "sha256"));
    struct sha256 now;
    struct error err = {0};
    if (!path || !stated)
        return true;
    if (!sha256_of_file(path, &now, &err)) {
        printf("  %s: no longer there\n", path);
        return false;
    }
    if (strcmp(now.hex, stated))
        printf("  %s: has changed\n", path);
    return !strcmp(now.hex, stated);
}

// Of a report in JSON; other forms list them for people only.
static bool inputs_hold(const char *text, size_t size)
{
    bool all = true;
    size_t i;
    json_t *input, *report = json_loadb(text, size, 0, NULL);
    json_array_foreach(json_object_get(report, "inputs"), i, input) all = input_holds(input) && all;
    json_decref(report);
    return all;
}

static int check_one(const char *path)
{
    struct error err = {0};
    struct sha256 seal;
    size_t size;
    char *text = file_read(path, REPORT_BYTES, &size, &err);
    if (!text)
        return command_bad_input(&err);
    int code = COMMAND_FINE;
    if (seal_check(text, size, &seal, &err)) {
        printf("%s: as it was sealed, %s\n", path, seal.hex);
        code = inputs_hold(text, size) ? COMMAND_FINE : COMMAND_WARNED;
    } else {
        fprintf(stderr, "boothcal: %s: %s\n", path, err.text);
        code = COMMAND_FAILED;
    }
    free(text);
    return code;
}

static int check_all(const struct options *o)
{
    int worst = COMMAND_FINE;
    for (int i = 0; i < o->file_count; i++) {
        int code = check_one(o->files[i]);
        if (worst == COMMAND_FINE || (worst == COMMAND_WARNED && code != COMMAND_FINE))
            worst = code;
    }
    return worst;
}

// ---- making ----------------------------------------------------------------------

static bool make(const struct options *o, const char *folder, struct session_facts *facts,
                 struct report *report, struct error *err)
{
    if (o->environment)
        snprintf(facts->environment, sizeof facts->environment, "%s", o->environment);
    return report_make(facts, folder, o->uncertainty, o->draws, report, err) &&
           report_save(report, folder, err);
}

static int make_report(const struct options *o)
{
    struct error err = {0};
    char path[1024];
    struct session_facts *facts = calloc(1, sizeof *facts);
    struct report *report = calloc(1, sizeof *report);
    snprintf(path, sizeof path, "%s/session.json", o->files[0]);
    bool fine = (facts && report) || fail(&err, ERROR_SYSTEM, "out of memory");
    fine = fine && facts_load(path, facts, &err);
    if (fine) {
        fine = make(o, o->files[0], facts, report, &err);
        if (fine)
            report_as_text(facts, stdout);
    }
    char missing[640] = "";
    if (fine && report->missing_count)
        snprintf(missing, sizeof missing, "no longer there: %s", report->missing[0]);
    if (report)
        report_fini(report);
    if (facts)
        facts_fini(facts);
    free(report);
    free(facts);
    return fine ? command_warned(missing) : command_failed(&err);
}

static int print_presets(void)
{
    struct uncertainties u;
    const struct settings_section section = {"uncertainty", uncertainty_settings, &u};
    settings_describe(&section, stdout);
    return COMMAND_FINE;
}

static bool take(struct options *o, int c)
{
    char *end;
    switch (c) {
    case 'u':
        o->uncertainty = optarg;
        return true;
    case 'e':
        o->environment = optarg;
        return true;
    case 'c':
        return o->check = true;
    case 'd':
        o->draws = (int)strtol(optarg, &end, 10);
        return !*end && o->draws >= 100 && o->draws <= 1000000;
    }
    return false;
}

int command_report(int argc, char **argv)
{
    static const struct option LONG[] = {
        {"uncertainty", required_argument, NULL, 'u'},
        {"draws", required_argument, NULL, 'd'},
        {"environment", required_argument, NULL, 'e'},
        {"check", no_argument, NULL, 'c'},
        {"presets", no_argument, NULL, 'p'},
        {"help", no_argument, NULL, 'h'},
        {0},
    };
    struct options o = {.draws = REPORT_DRAWS};
    optind = 0;
    for (int c; (c = getopt_long(argc, argv, "h", LONG, NULL)) != -1;) {
        if (c == 'h')
            return fputs(USAGE, stdout), COMMAND_FINE;
        if (c == 'p')
            return print_presets();
        if (!take(&o, c))
            return command_bad_usage("see boothcal report --help");
    }
    o.files = argv + optind;
    o.file_count = argc - optind;
    if (o.check ? !o.file_count : o.file_count != 1)
        return command_bad_usage("boothcal report: one FOLDER, or --check and files, are needed");
    return o.check ? check_all(&o) : make_report(&o);
}
