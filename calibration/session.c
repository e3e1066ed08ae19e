// SPDX-License-Identifier: Apache-2.0
#include "calibration/session.h"

#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/number.h"
#include "calibration/commands.h"
#include "calibration/facts_json.h"
#include "calibration/report.h"
#include "calibration/store_keep.h"
#include "config/paths.h"

static const char USAGE[] =
    "usage: boothcal session --config FILE --maps FOLDER -o FOLDER [options]\n"
    "       boothcal session --config FILE --photographs FOLDER -o FOLDER [options]\n"
    "\n"
    "From bare settings to an accuracy report, through the running boothd: teaches the\n"
    "lamps, characterises the display in the dark booth, proofs a chart under each lamp,\n"
    "tilts the screen and moves the head. Without --booth it asks you to turn the knobs.\n"
    "\n"
    "  --config FILE        boothd's settings\n"
    "  --socket PATH        boothd's control socket (default: the settings', else the user's)\n"
    "  --booth PATH         control socket of an emulated booth\n"
    "  --maps FOLDER        luminance maps ceiling-LAMP.exr (cd/m2, channel Y)\n"
    "  --photographs FOLDER the maps are made here: the ceiling is photographed into\n"
    "                       FOLDER/LAMP, see boothcal light map --help\n"
    "  --lamp NAME[=TEXT]   a lamp of the booth, in order; TEXT is noted in the report\n"
    "                       (default: A, D50, D65)\n"
    "  --lamp-drift PERCENT a lamp stands still when it changes by less a minute\n"
    "                       (default: 0.5; 20 in a rehearsal)\n"
    "  --material NAME      chart to proof (default: colorchecker24)\n"
    "  --rehearse           few patches: shows that the chain works, proves nothing\n"
    "  -o, --out FOLDER     where report.html, report.json, display.ti3 and pictures go\n"
    "  --help\n"
    "\n"
    "Ends with 0; 1 when it failed; 2 on wrong usage or input; 3 when it is done, but\n"
    "not every target was reached.\n";

struct options {
    const char *config, *socket, *booth, *maps, *photographs, *out, *material;
    const char *lamps[FACTS_LAMPS];
    int lamp_count;
    double lamp_drift;
    bool rehearse;
};

static int misused(const char *text)
{
    fprintf(stderr, "boothcal session: %s\n", text);
    return COMMAND_USAGE;
}

static int parse(int argc, char **argv, struct options *o)
{
    static const struct option LONG[] = {
        {"config", required_argument, NULL, 'c'}, {"socket", required_argument, NULL, 's'},
        {"booth", required_argument, NULL, 'b'},  {"maps", required_argument, NULL, 'm'},
        {"lamp", required_argument, NULL, 'l'},   {"material", required_argument, NULL, 'k'},
        {"rehearse", no_argument, NULL, 'r'},     {"out", required_argument, NULL, 'o'},
        {"photographs", required_argument, NULL, 'p'},
        {"help", no_argument, NULL, 'h'},         {"lamp-drift", required_argument, NULL, 'd'},
        {0},
    };
    const char *end;
    *o = (struct options){.material = "colorchecker24"};
    for (int c; (c = getopt_long(argc, argv, "o:h", LONG, NULL)) != -1;) {
        switch (c) {
        case 'c': o->config = optarg; break;
        case 's': o->socket = optarg; break;
        case 'b': o->booth = optarg; break;
        case 'm': o->maps = optarg; break;
        case 'p': o->photographs = optarg; break;
        case 'k': o->material = optarg; break;
        case 'r': o->rehearse = true; break;
        case 'o': o->out = optarg; break;
        case 'l':
            if (o->lamp_count == FACTS_LAMPS)
                return misused("more than 8 lamps");
            o->lamps[o->lamp_count++] = optarg;
            break;
        case 'd':
            if (!number_parse(optarg, &end, &o->lamp_drift) || *end || !(o->lamp_drift > 0))
                return misused("--lamp-drift wants a number above 0");
            break;
        case 'h': fputs(USAGE, stdout); return -1;
        default: return COMMAND_USAGE;
        }
    }
    if (optind != argc || !o->config || !o->maps == !o->photographs || !o->out)
        return misused("--config, --out and either --maps or --photographs are needed; see "
                       "--help");
    return 0;
}

static void take_lamps(const struct options *o, struct session_facts *f)
{
    static const char *const PRESET[] = {"A", "D50", "D65"};
    f->lamp_count = o->lamp_count ? o->lamp_count : 3;
    for (int i = 0; i < f->lamp_count; i++) {
        const char *text = o->lamp_count ? o->lamps[i] : PRESET[i];
        size_t length = strcspn(text, "=");
        snprintf(f->lamps[i].name, sizeof f->lamps[i].name, "%.*s", (int)length, text);
        snprintf(f->lamps[i].asked, sizeof f->lamps[i].asked, "%s",
                 text[length] ? text + length + 1 : "");
    }
}

// What would otherwise be missed only after an hour of readings.
static bool check_paths(struct session *s, const struct options *o, struct error *err)
{
    if (mkdir(o->out, 0777) && errno != EEXIST)
        return fail_errno(err, "%s", o->out);
    if (o->photographs && mkdir(o->photographs, 0777) && errno != EEXIST)
        return fail_errno(err, "%s", o->photographs);
    if (!path_absolute(o->out, s->out, sizeof s->out, err) ||
        !path_absolute(o->maps ? o->maps : o->out, s->maps, sizeof s->maps, err) ||
        (o->photographs &&
         !path_absolute(o->photographs, s->photographs, sizeof s->photographs, err)))
        return false;
    if (access(s->out, W_OK))
        return fail_errno(err, "%s", s->out);
    if (!session_store_begin(s, err))
        return false;
    if (!*s->settings.display.model)
        return fail(err, ERROR_CONFIG, "%s: [display] model: names no file to fit into", o->config);
    for (int i = 0; i < s->facts->lamp_count; i++) {
        char map[512];
        session_map(s, i, map, sizeof map);
        if (!*s->photographs && access(map, R_OK))
            return fail(err, ERROR_CONFIG, "%s: cannot be read: the luminance map of lamp %s", map,
                        s->facts->lamps[i].name);
    }
    return true;
}

static bool begin(struct session *s, const struct options *o, struct error *err)
{
    struct session_facts *f = s->facts;
    take_lamps(o, f);
    if (!check_paths(s, o, err) ||
        !bench_open(&s->bench, &s->settings, o->socket, o->booth, err))
        return false;
    f->readings = json_incref(s->bench.readings);
    if (!path_absolute(o->config, f->config, sizeof f->config, err))
        return false;
    snprintf(f->booth, sizeof f->booth, "%s", s->settings.booth.name);
    snprintf(f->software, sizeof f->software, "boothd %s", BOOTHD_VERSION);
    snprintf(f->observer, sizeof f->observer, "%s",
             observer_name((enum observer)s->settings.quality.observer));
    f->truth_emulated = s->bench.booth;
    clock_utc(f->started);
    return true;
}

static void say(const struct session *s, const char *text)
{
    if (s->bench.terminal)
        fprintf(stderr, "%s\n", text);
}

// Wherever screen and head were left.
static bool rest(struct session *s, struct error *err)
{
    return bench_tilt(&s->bench, s->settings.stand.default_tilt_deg, err) &&
           bench_head(&s->bench, session_eye(s), err);
}

static bool steps(struct session *s, struct error *err)
{
    struct session_facts *f = s->facts;
    if (!rest(s, err))
        return false;
    say(s, "Teaching the lamps");
    for (int i = 0; i < f->lamp_count; i++) {
        if (!session_teach(s, i, err))
            return false;
        bench_progress(&s->bench, "lamps", i + 1, f->lamp_count);
    }
    if (!session_store(s, STAGE_TAUGHT, err) || !bench_reload(&s->bench, err))
        return false;
    say(s, "Characterising the display in the dark booth");
    if (!session_characterise(s, err))
        return false;
    if (!session_view(s, err))
        return false;
    say(s, "Proofing the chart");
    for (int i = 0; i < f->lamp_count; i++)
        if (!session_proof(s, i, err))
            return false;
    say(s, "Tilting the screen, moving the head");
    return session_poses(s, err) && (f->settings = bench_status(&s->bench, err));
}

static bool reached(const struct session_facts *f)
{
    bool all = true;
    for (int i = 0; i < f->lamp_count; i++)
        all = all && f->lamps[i].reached;
    return all;
}

static bool write_report(const struct session *s, struct error *err)
{
    char path[512];
    struct report *report = calloc(1, sizeof *report);
    if (!report)
        return fail(err, ERROR_SYSTEM, "out of memory for the report");
    snprintf(path, sizeof path, "%s/session.json", s->out);
    bool fine = facts_save(s->facts, path, err) &&
                report_make(s->facts, s->out, NULL, REPORT_DRAWS, report, err) &&
                report_save(report, s->out, err);
    report_fini(report);
    free(report);
    return fine;
}

static bool run(struct session *s, const struct options *o, struct error *err)
{
    int64_t began = clock_now_ns();
    bool placed;
    if (!store_settings(o->config, &s->settings, &placed, err) || !begin(s, o, err) || !steps(s, err))
        return false;
    s->facts->emulated = bench_emulated(&s->bench) ||
                         json_is_true(json_object_get(s->facts->settings, "emulated"));
    clock_utc(s->facts->finished);
    s->facts->seconds = (double)(clock_now_ns() - began) / 1e9;
    if (!write_report(s, err) || !session_store(s, STAGE_REPORTED, err))
        return false;
    report_as_text(s->facts, stdout);
    printf("\n%s/report.html\n", s->out);
    return true;
}

int command_session(int argc, char **argv)
{
    struct options o;
    int misuse = parse(argc, argv, &o);
    if (misuse)
        return misuse < 0 ? COMMAND_FINE : misuse;
    struct session_facts *facts = calloc(1, sizeof *facts);
    struct session *s = calloc(1, sizeof *s);
    struct error err = {0};
    bool fine = false, all_reached = false;
    if (facts && s) {
        *s = (struct session){.facts = facts, .material = o.material,
                              .rehearse = o.rehearse, .lamp_drift = o.lamp_drift / 100};
        fine = run(s, &o, &err);
        all_reached = reached(facts);
        bench_close(&s->bench);
        json_decref(facts->settings);
        json_decref(facts->readings);
    }
    if (!fine)
        fprintf(stderr, "boothcal session: %s\n", err.text);
    free(s);
    free(facts);
    if (fine)
        return all_reached ? COMMAND_FINE : COMMAND_WARNED;
    return error_exit_code(&err);
}
