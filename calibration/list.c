// SPDX-License-Identifier: Apache-2.0
// boothcal list: the instruments found, and the udev rules that let them in.
#include "calibration/list.h"

#include <getopt.h>
#include <jansson.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/commands.h"
#include "config/booth.h"
#include "drivers/udev.h"

static const int64_t ASK_WITHIN_NS = 5 * NS_PER_S;

static const char USAGE[] =
    "usage: boothcal list [--config FILE] [--json]\n"
    "       boothcal list --udev\n"
    "Lists the instruments found on USB, Bluetooth and serial adapters, with serial number,\n"
    "firmware and whether you may open them.\n"
    "  --config FILE  also ask the instruments on the serial lines of this settings file\n"
    "  --json         one JSON array\n"
    "  --udev         print the udev rules of every known instrument instead";

static const char *or_dash(const char *text)
{
    return *text ? text : "-";
}

void list_text(const struct found_list *list, FILE *out)
{
    int wide[5] = {4, 5, 6, 8, 6}; // of the titles
    for (int i = 0; i < list->count; i++) {
        const struct found *f = &list->of[i];
        const char *const texts[] = {f->kind, f->model, f->serial, f->firmware, f->place};
        for (int k = 0; k < 5; k++)
            if ((int)strlen(texts[k]) > wide[k])
                wide[k] = (int)strlen(texts[k]);
    }
    if (!list->count)
        fprintf(out, "no instruments found\n");
    else
        fprintf(out, "%-*s  %-*s  %-*s  %-*s  %-*s  %s\n", wide[0], "KIND", wide[1], "MODEL",
                wide[2], "SERIAL", wide[3], "FIRMWARE", wide[4], "PLACE", "ACCESS");
    for (int i = 0; i < list->count; i++) {
        const struct found *f = &list->of[i];
        fprintf(out, "%-*s  %-*s  %-*s  %-*s  %-*s  %s%s\n", wide[0], f->kind, wide[1],
                or_dash(f->model), wide[2], or_dash(f->serial), wide[3], or_dash(f->firmware),
                wide[4], f->place, found_access_name(f->access), f->emulated ? " (emulated)" : "");
        if (*f->note)
            fprintf(out, "    %s\n", f->note);
    }
}

void list_json(const struct found_list *list, FILE *out)
{
    json_t *all = json_array();
    for (int i = 0; i < list->count; i++) {
        const struct found *f = &list->of[i];
        json_array_append_new(all,
                              json_pack("{ss ss ss ss ss ss sb ss ss}", "kind", f->kind, "driver",
                                        f->driver, "place", f->place, "model", f->model, "serial",
                                        f->serial, "firmware", f->firmware, "emulated", f->emulated,
                                        "access", found_access_name(f->access), "note", f->note));
    }
    json_dumpf(all, out, JSON_INDENT(2) | JSON_ENSURE_ASCII);
    fputc('\n', out);
    json_decref(all);
}

bool list_refused(const struct found_list *list)
{
    for (int i = 0; i < list->count; i++)
        if (list->of[i].access == FOUND_REFUSED)
            return true;
    return false;
}

// A line that answers is an instrument and no longer just a line.
static struct found *entry_for(struct found_list *list, const char *kind, const char *driver,
                               const char *port)
{
    for (int i = 0; i < list->count; i++)
        if (!strcmp(list->of[i].place, port)) {
            snprintf(list->of[i].kind, sizeof list->of[i].kind, "%s", kind);
            snprintf(list->of[i].driver, sizeof list->of[i].driver, "%s", driver);
            return &list->of[i];
        }
    return found_add(list, kind, driver, port);
}

static void name(struct found *f, const struct instrument_identity *who)
{
    found_text(f->model, sizeof f->model, who->model);
    found_text(f->serial, sizeof f->serial, who->serial);
    found_text(f->firmware, sizeof f->firmware, who->firmware);
    f->emulated = who->emulated;
}

// Opens the instrument that the settings say hangs on a line, and lets it tell
// its name. elsewhere is the place of one without a port; NULL: it was found already.
#define ASK(kind, elsewhere)                                                                       \
    static void ask_##kind(const struct booth_settings *booth, struct found_list *list)            \
    {                                                                                              \
        const struct kind##_driver *driver = booth_##kind(booth);                                  \
        struct error err = {0};                                                                    \
        struct instrument_identity who = {0};                                                      \
        const char *place = driver && driver->portless ? elsewhere : booth->kind.options.port;     \
        if (!driver || !place)                                                                     \
            return;                                                                                \
        struct found *f = entry_for(list, #kind, driver->name, place);                             \
        if (!f || f->access == FOUND_REFUSED)                                                      \
            return;                                                                                \
        struct kind *device =                                                                      \
            driver->open(&booth->kind.options, clock_now_ns() + ASK_WITHIN_NS, &err);              \
        if (!device) {                                                                             \
            found_blame(f, &err);                                                                  \
            return;                                                                                \
        }                                                                                          \
        driver->identify(device, &who);                                                            \
        name(f, &who);                                                                             \
        driver->close(device);                                                                     \
    }
ASK(accelerometer, NULL)
ASK(radiometer, booth->radiometer.options.program)

static int show(const char *config, bool json)
{
    struct found_list list = {0};
    struct booth_settings booth;
    struct error err;
    if (config && !booth_load(config, NULL, 0, &booth, &err))
        return command_bad_input(&err);
    found_all(&list, clock_now_ns() + ASK_WITHIN_NS);
    if (config) {
        ask_accelerometer(&booth, &list);
        ask_radiometer(&booth, &list);
    }
    if (json)
        list_json(&list, stdout);
    else
        list_text(&list, stdout);
    if (!list_refused(&list))
        return COMMAND_FINE;
    fprintf(stderr, "boothcal: some instruments may not be opened; as root: boothcal list --udev "
                    ">/etc/udev/rules.d/" UDEV_RULES_FILE ", udevadm control --reload, replug\n");
    return COMMAND_WARNED;
}

int command_list(int argc, char **argv)
{
    static const struct option OPTIONS[] = {{"config", required_argument, NULL, 'c'},
                                            {"json", no_argument, NULL, 'j'},
                                            {"udev", no_argument, NULL, 'u'},
                                            {"help", no_argument, NULL, 'h'},
                                            {0}};
    const char *config = NULL;
    bool json = false, udev = false;
    optind = 0;
    for (int c; (c = getopt_long(argc, argv, "h", OPTIONS, NULL)) != -1;)
        switch (c) {
        case 'c':
            config = optarg;
            break;
        case 'j':
            json = true;
            break;
        case 'u':
            udev = true;
            break;
        case 'h':
            puts(USAGE);
            return COMMAND_FINE;
        default:
            return COMMAND_USAGE;
        }
    if (optind < argc || (udev && (json || config)))
        return command_bad_usage("usage: boothcal list [--config FILE] [--json] | --udev");
    if (!udev)
        return show(config, json);
    udev_rules_print(stdout);
    return COMMAND_FINE;
}
