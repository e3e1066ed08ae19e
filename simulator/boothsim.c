// SPDX-License-Identifier: Apache-2.0
// boothsim: brings up an emulated booth and runs a command in it.
#include <getopt.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/log.h"
#include "simulator/boothsim_children.h"
#include "simulator/photograph.h"
#include "simulator/screen_xvfb.h"
#include "simulator/spotread_link.h"
#include "simulator/spotread_program.h"
#include "simulator/wire.h"
#include "simulator/world_control.h"

enum { EXIT_USAGE = 2, SERVE_MS = 20, LAMP_OPTIONS_MOST = 16 };
static const int64_t xvfb_patience_ns = 30 * NS_PER_S, stop_patience_ns = 30 * NS_PER_S;
static const char wrapped[] = "BOOTHSIM_WRAPPED"; // set once under umockdev-wrapper

static const char usage[] =
    "usage: boothsim --scenario FILE --run DIR [option]... [-- COMMAND...]\n"
    "\n"
    "Brings up an emulated light booth: three lamps, a tilting screen, an observer,\n"
    "and the four instruments below unmodified libusb, hidapi, libmodbus and a serial\n"
    "line. Runs COMMAND in it and ends with its exit status; without one, runs until\n"
    "it is told to stop.\n"
    "\n"
    "  --scenario FILE       what the booth is made of (INI)\n"
    "  --run DIR             where the instruments' lines, the lamps' luminance maps\n"
    "                        and the control socket boothsim.sock are left, and\n"
    "                        spotread, a program that measures with an emulated one\n"
    "  --lamp NAME=SPECTRUM  gives a lamp another spectrum, or adds a lamp; a CIE name\n"
    "                        or a file (CSV nm, power; or .sp); may be repeated\n"
    "  --script FILE         timed events, instead of the scenario's\n"
    "  --no-xvfb             no X server; the panel stays black\n"
    "  --help-scenario       prints every setting of a scenario\n"
    "  --help, --version\n"
    "\n"
    "Exit status: that of COMMAND; 1 failed, 2 usage or bad input.\n";

struct options {
    const char *scenario, *run, *script, *lamps[LAMP_OPTIONS_MOST];
    int lamp_count;
    bool xvfb;
    char **command; // NULL = none
};

struct booth {
    const struct options *options;
    struct scenario scenario;
    struct world *world;
    struct wire *wire;
    struct control_server *server;
    struct xvfb_screen screen;
    struct child xvfb, command;
    int display;
};

static volatile sig_atomic_t told_to_stop, from_terminal;

static void on_signal(int signal, siginfo_t *about, void *context)
{
    (void)context;
    told_to_stop = signal;
    from_terminal = about->si_code > 0;
}

static void catch_signals(void)
{
    struct sigaction action = {.sa_sigaction = on_signal, .sa_flags = SA_SIGINFO | SA_RESTART};
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
    signal(SIGPIPE, SIG_IGN);
}

enum { SCENARIO = 256, RUN, LAMP, SCRIPT, NO_XVFB, HELP_SCENARIO, HELP, VERSION };

static const struct option known_options[] = {
    {"scenario", required_argument, NULL, SCENARIO},
    {"run", required_argument, NULL, RUN},
    {"lamp", required_argument, NULL, LAMP},
    {"script", required_argument, NULL, SCRIPT},
    {"no-xvfb", no_argument, NULL, NO_XVFB},
    {"help-scenario", no_argument, NULL, HELP_SCENARIO},
    {"help", no_argument, NULL, HELP},
    {"version", no_argument, NULL, VERSION},
    {0},
};

// False when the program ends here: then *status says how.
static bool take_option(int name, struct options *o, int *status)
{
    switch (name) {
    case SCENARIO:
        o->scenario = optarg;
        return true;
    case RUN:
        o->run = optarg;
        return true;
    case LAMP:
        if (o->lamp_count < LAMP_OPTIONS_MOST) {
            o->lamps[o->lamp_count++] = optarg;
            return true;
        }
        fprintf(stderr, "boothsim: more than %d times --lamp\n", LAMP_OPTIONS_MOST);
        *status = EXIT_USAGE;
        return false;
    case SCRIPT:
        o->script = optarg;
        return true;
    case NO_XVFB:
        o->xvfb = false;
        return true;
    case HELP_SCENARIO:
        scenario_describe(stdout);
        return false;
    case HELP:
        fputs(usage, stdout);
        return false;
    case VERSION:
        puts("boothsim " BOOTHD_VERSION);
        return false;
    default:
        *status = EXIT_USAGE;
        return false;
    }
}

// Ends the program for --help and the like: then *status says how.
static bool parse_options(int argc, char **argv, struct options *o, int *status)
{
    *o = (struct options){.xvfb = true};
    *status = EXIT_SUCCESS;
    for (int c; (c = getopt_long(argc, argv, "+", known_options, NULL)) != -1;)
        if (!take_option(c, o, status))
            return false;
    if (optind < argc)
        o->command = argv + optind;
    if (o->scenario && o->run)
        return true;
    fputs("boothsim: --scenario and --run are needed; see boothsim --help\n", stderr);
    *status = EXIT_USAGE;
    return false;
}

static bool load_scenario(struct booth *b, struct error *err)
{
    const struct options *o = b->options;
    if (!scenario_load(o->scenario, &b->scenario, err))
        return false;
    for (int i = 0; i < o->lamp_count; i++)
        if (!scenario_set_lamp(&b->scenario, o->lamps[i], err))
            return false;
    return true;
}

static bool load_script(struct booth *b, struct error *err)
{
    char beside[SCENARIO_PATH_SIZE * 2];
    const char *path = b->options->script;
    if (!path && b->scenario.world.script[0]) {
        scenario_beside(&b->scenario, b->scenario.world.script, beside);
        path = beside;
    }
    if (!path)
        return true;
    struct event *events = NULL;
    int count = 0;
    if (!script_load(path, &b->scenario, &events, &count, err))
        return false;
    bool good = true;
    for (int i = 0; good && i < count; i++)
        good = world_add(b->world, &events[i], err);
    free(events);
    return good;
}

static bool write_maps(const struct booth *b, struct error *err)
{
    for (int i = 0; i < SCENARIO_LAMPS_MOST; i++) {
        const struct lamp *lamp = world_lamp(b->world, i);
        char path[1024];
        struct exr map = {0};
        if (!lamp)
            continue;
        snprintf(path, sizeof path, "%s/ceiling-%s.exr", b->options->run, lamp->name);
        bool good = ceiling_camera_map(&lamp->image, &b->scenario.ceiling, lamp->name,
                                       b->scenario.world.seed, &map, err) &&
                    exr_save(path, &map, err);
        exr_fini(&map);
        if (!good)
            return while_doing(err, "luminance map of lamp %s", lamp->name);
    }
    return true;
}

static void read_pixel(void *context, int x, int y, double code[3])
{
    const struct xvfb_screen *screen = context;
    if (x < screen->width && y < screen->height)
        xvfb_screen_pixel(screen, x, y, code);
}

static bool start_screen(struct booth *b, struct error *err)
{
    char path[1024];
    b->display = -1;
    if (!b->options->xvfb)
        return true;
    if (!child_start_xvfb(&b->scenario, b->options->run, clock_now_ns() + xvfb_patience_ns,
                          &b->xvfb, &b->display, err))
        return false;
    snprintf(path, sizeof path, "%s/Xvfb_screen0", b->options->run);
    if (!xvfb_screen_open(path, &b->screen, err))
        return false;
    world_set_pixels(b->world, read_pixel, &b->screen);
    return true;
}

static bool plug_in(struct booth *b, struct error *err)
{
    const struct scenario *s = &b->scenario;
    struct wire_options options = {
        .around = world_around(b->world),
        .run_dir = b->options->run,
        .serial = {[WIRE_SPECTROMETER] = s->spectrometer.serial,
                   [WIRE_INCLINOMETER] = s->inclinometer.serial,
                   [WIRE_CAMERA] = s->tracker.serial,
                   [WIRE_RADIOMETER] = s->radiometer.serial,
                   [WIRE_SPECTROMETER_2] = s->spectrometer_2.serial},
        .model = (enum ooi_name)s->spectrometer.model,
        .model_2 = (enum ooi_name)s->spectrometer_2.model,
        .inclinometer_map = (enum witmotion_map)s->inclinometer.model,
        .inclinometer_tcp = s->inclinometer.tcp,
        .inclinometer_port = s->inclinometer.port,
        .seed = (uint64_t)s->world.seed,
        .radiometer_hurry = s->radiometer.hurry,
        .radiometer_lapses = {s->radiometer.drift, s->radiometer.misread_every},
        .enumeration_s = s->world.enumeration_s,
        .line_enumeration_s = s->world.line_enumeration_s,
        .collector_mm2 = s->spectrometer.collector_mm2,
        .calibration_error = s->spectrometer.calibration_error,
        .camera_pitch_deg = s->camera.pitch_deg,
        .opentrack_port = s->opentrack.port,
        .opentrack_rate_hz = s->opentrack.rate_hz,
        .opentrack_zero = {s->opentrack.zero_m[0], s->opentrack.zero_m[1], s->opentrack.zero_m[2]},
        .opentrack_mirrored = s->opentrack.mirrored,
    };
    b->wire = wire_start(&options, err);
    return b->wire || while_doing(err, "plugging the instruments in");
}

static void on_fault(void *context, int instrument, int fault)
{
    struct booth *b = context;
    wire_set_fault(b->wire, (enum wire_instrument)instrument, (enum wire_fault)fault);
}

static void offer_spotread(struct booth *b, json_t *answer)
{
    const struct scenario *s = &b->scenario;
    struct spotread_settings settings = {
        .kind = (enum spotread_kind)s->spotread.model,
        .seed = (uint64_t)s->world.seed,
        .hurry = s->radiometer.hurry,
        .lapses = {s->radiometer.drift, s->radiometer.misread_every},
    };
    strcpy(settings.serial, s->spotread.serial);
    spotread_offer(answer, &settings, b->wire);
}

static json_t *on_request(void *context, const char *what, json_t *request, struct error *err)
{
    struct booth *b = context;
    int64_t now = clock_now_ns();
    const char *folder = json_string_value(json_object_get(request, "folder"));
    if (!strcmp(what, CONTROL_PHOTOGRAPH))
        return folder ? photograph(b->world, now, folder, err)
                      : (fail(err, ERROR_CONFIG, "folder: is missing or no text"), NULL);
    json_t *answer = world_answer(b->world, now, what, request, err);
    if (answer && !strcmp(what, CONTROL_RADIANCE))
        offer_spotread(b, answer);
    world_faults_due(b->world, now, on_fault, b);
    return answer;
}

static bool bring_up(struct booth *b, struct error *err)
{
    char path[1024];
    const char *run = b->options->run;
    struct stat about;
    if (mkdir(run, 0755) < 0 && (stat(run, &about) < 0 || !S_ISDIR(about.st_mode)))
        return fail(err, ERROR_CONFIG, "--run %s: is no folder and cannot be made", run);
    snprintf(path, sizeof path, "%s/boothsim.sock", run);
    if (!write_maps(b, err) || !start_screen(b, err) || !plug_in(b, err))
        return false;
    b->server = control_listen(path, err);
    return b->server && spotread_leave(run, err);
}

static void forward_signal(struct booth *b, int64_t *kill_at_ns)
{
    int signal = told_to_stop;
    told_to_stop = 0;
    if (!from_terminal)
        child_signal(&b->command, signal);
    if (!*kill_at_ns)
        *kill_at_ns = clock_now_ns() + stop_patience_ns;
}

// Until the command ends; without one, until told to stop.
static bool live(struct booth *b, int *status, struct error *err)
{
    int64_t kill_at_ns = 0;
    if (b->options->command &&
        !child_start_command(b->options->command, b->display, &b->command, err))
        return false;
    for (;;) {
        if (!control_serve(b->server, SERVE_MS, on_request, b, err))
            return false;
        world_faults_due(b->world, clock_now_ns(), on_fault, b);
        wire_enumerate(b->wire, clock_now_ns());
        if (b->options->command ? child_has_ended(&b->command) : told_to_stop)
            break;
        if (b->options->xvfb && child_has_ended(&b->xvfb))
            return fail(err, ERROR_GONE, "Xvfb ended with status %d", b->xvfb.status);
        if (told_to_stop)
            forward_signal(b, &kill_at_ns);
        if (kill_at_ns && clock_now_ns() > kill_at_ns)
            child_signal(&b->command, SIGKILL);
    }
    *status = b->command.status;
    return true;
}

// The command first, then the instruments: a device must be unplugged before
// the process that answers for it goes.
static void take_down(struct booth *b)
{
    child_stop(&b->command, clock_now_ns() + stop_patience_ns);
    if (b->server)
        spotread_take_away(b->options->run);
    control_unlisten(b->server);
    wire_stop(b->wire);
    xvfb_screen_close(&b->screen);
    child_stop(&b->xvfb, clock_now_ns() + stop_patience_ns);
    world_destroy(b->world);
}

static int run(const struct options *options)
{
    struct booth *b = calloc(1, sizeof *b);
    struct error err = {0};
    int status = EXIT_FAILURE;
    if (!b)
        return EXIT_FAILURE;
    b->options = options;
    bool good = load_scenario(b, &err) &&
                (b->world = world_create(&b->scenario, clock_now_ns(), &err)) &&
                load_script(b, &err);
    if (good) {
        catch_signals();
        good = bring_up(b, &err) && live(b, &status, &err);
    }
    if (!good) {
        log_line(LOG_LEVEL_ERROR, "%s", err.text);
        status = error_exit_code(&err);
    }
    take_down(b);
    free(b);
    return status;
}

// The instruments live in a tree of devices that only a process with
// umockdev's library loaded first can see.
static int wrap(char **argv)
{
    char self[1024];
    ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    int count = 0;
    while (argv[count])
        count++;
    char **wrapper = calloc((size_t)count + 2, sizeof *wrapper);
    if (!wrapper || length < 0) {
        free(wrapper);
        return EXIT_FAILURE;
    }
    self[length] = 0;
    wrapper[0] = "umockdev-wrapper";
    wrapper[1] = self;
    memcpy(wrapper + 2, argv + 1, (size_t)count * sizeof *wrapper);
    setenv(wrapped, "yes", 1);
    execvp(wrapper[0], wrapper);
    log_line(LOG_LEVEL_ERROR, "umockdev-wrapper cannot be run: is umockdev installed?");
    free(wrapper);
    return EXIT_FAILURE;
}

int main(int argc, char **argv)
{
    struct options options;
    int status;
    log_init("boothsim", LOG_LEVEL_INFO);
    if (argc > 2 && !strcmp(argv[1], "--spotread"))
        return spotread_run(argv[2], !getenv("ARGYLL_NOT_INTERACTIVE"), argc - 3, argv + 3);
    if (!parse_options(argc, argv, &options, &status))
        return status;
    if (!getenv(wrapped))
        return wrap(argv);
    unsetenv(wrapped); // a boothsim inside this one is to wrap itself
    return run(&options);
}
