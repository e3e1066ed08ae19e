// SPDX-License-Identifier: Apache-2.0
// boothcal keep: single results, taken by hand, made a new version of the store.
#include <getopt.h>
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "calibration/commands.h"
#include "calibration/store_keep.h"
#include "config/booth_store.h"

enum { ITEMS_MOST = 64 };

static const char USAGE[] =
    "usage: boothcal keep --config FILE [OPTION]...\n"
    "Makes single results a new version of the store of calibrations, based on the one in\n"
    "force, and puts it in force. Each is looked through first.\n"
    "\n"
    "  --config FILE      boothd's settings: [calibration] store, [booth] name, [display] serial\n"
    "  --display D.ini    a display model, as display fit writes it\n"
    "  --lamp NAME.ini    a taught lamp, with its spectrum and map; may be repeated\n"
    "  --geometry G.ini   stand and tracker, as tilt and tracker write them\n"
    "  --file FILE        any other file, under its own name; may be repeated\n"
    "  --note TEXT        what it is\n"
    "  --json             one JSON object\n"
    "  --help\n"
    "\n"
    "With a display model the calibration is valid anew, else as long as the one that it is\n"
    "based on.";

struct item {
    bool (*keep)(struct store_draft *draft, const char *path, struct error *err);
    const char *path;
};

struct options {
    const char *config, *note;
    bool json, renews;
    struct item items[ITEMS_MOST];
    int count;
};

static bool take_item(struct options *o, int c, const char *path, struct error *err)
{
    if (o->count == ITEMS_MOST)
        return fail(err, ERROR_CONFIG, "more than %d files", ITEMS_MOST);
    struct item *item = &o->items[o->count++];
    item->path = path;
    item->keep = c == 'd'   ? store_keep_display
                 : c == 'l' ? store_keep_lamp
                 : c == 'g' ? store_keep_geometry
                            : store_keep_file;
    o->renews = o->renews || c == 'd';
    return true;
}

static bool take_options(int argc, char **argv, struct options *o, struct error *err)
{
    static const struct option LONG[] = {
        {"config", required_argument, NULL, 'c'}, {"display", required_argument, NULL, 'd'},
        {"lamp", required_argument, NULL, 'l'},   {"geometry", required_argument, NULL, 'g'},
        {"file", required_argument, NULL, 'f'},   {"note", required_argument, NULL, 'n'},
        {"json", no_argument, NULL, 'j'},         {0}};
    *o = (struct options){.note = "kept by hand"};
    optind = 0; // getopt starts anew
    opterr = 0;
    for (int c; (c = getopt_long(argc, argv, "", LONG, NULL)) != -1;)
        if (c == '?')
            return fail(err, ERROR_CONFIG, "an option is unknown, or its value is missing");
        else if (c == 'c')
            o->config = optarg;
        else if (c == 'n')
            o->note = optarg;
        else if (c == 'j')
            o->json = true;
        else if (!take_item(o, c, optarg, err))
            return false;
    return (optind == argc && o->config && o->count) ||
           fail(err, ERROR_CONFIG, "--config and something to keep are needed; see --help");
}

static bool keep(const struct options *o, const struct booth_settings *booth, int *number,
                 struct error *err)
{
    struct store_place place;
    struct store_draft d;
    if (!booth_store_place(booth, &place, err) || !store_begin(&place, true, &d, err))
        return false;
    struct store_manifest facts = store_facts(booth, &d, o->renews, o->note);
    for (int i = 0; i < o->count; i++)
        if (!o->items[i].keep(&d, o->items[i].path, err)) {
            store_abandon(&d);
            return false;
        }
    return store_commit(&d, &facts, number, err);
}

int command_keep(int argc, char **argv)
{
    struct options o;
    struct booth_settings booth;
    struct error err = {0};
    int number = 0;
    for (int i = 1; i < argc; i++)
        if (!strcmp(argv[i], "--help") || !strcmp(argv[i], "-h"))
            return puts(USAGE), COMMAND_FINE;
    if (!take_options(argc, argv, &o, &err) || !booth_load(o.config, NULL, 0, &booth, &err) ||
        !keep(&o, &booth, &number, &err))
        return command_failed(&err);
    if (o.json)
        printf("{\"version\": %d}\n", number);
    else
        printf("calibration %04d is in force: %s\n", number, o.note);
    return COMMAND_FINE;
}
