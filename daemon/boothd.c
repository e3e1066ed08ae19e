// SPDX-License-Identifier: Apache-2.0
// The daemon: takes everything into service, runs the frame loop, ends cleanly.
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "config/paths.h"
#include "daemon/notify.h"
#include "daemon/options.h"
#include "daemon/renew.h"
#include "daemon/serve.h"
#include "drivers/udev.h"

enum { EXIT_FINE = 0, EXIT_FAILED = 1, EXIT_MISSING = 3 };
enum { TICK_MS = 20 };

static const int64_t STOP_WITHIN_NS = 1500 * NS_PER_MS;

// Everything in service. Fields are NULL or -1 until taken into service.
struct service {
    struct boothd_options options;
    struct booth booth;
    struct desk *desk;
    struct serve *serve;
    struct jobs *jobs;
    struct renewal *renewal;
    struct mailbox snapshots;
    struct notifier notifier;
    int signals;
    char since[21];
    char complaint[512]; // last frame error logged
    bool stop;
    int code; // to end with
};

static int exit_code(const struct error *err)
{
    log_line(LOG_LEVEL_ERROR, "%s", err->text);
    return error_exit_code(err);
}

static bool catch_signals(struct service *s, struct error *err)
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGHUP);
    pthread_sigmask(SIG_BLOCK, &set, NULL); // before any thread, so that all inherit it
    signal(SIGPIPE, SIG_IGN);
    s->signals = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
    return s->signals >= 0 || fail_errno(err, "no signals");
}

static bool wants_window(const struct booth_settings *b)
{
    const char *x = getenv("DISPLAY"), *wayland = getenv("WAYLAND_DISPLAY");
    switch ((enum booth_output)b->display.output) {
    case OUTPUT_WINDOW:
        return true;
    case OUTPUT_OFFSCREEN:
        return false;
    case OUTPUT_AUTO:
        return (x && *x) || (wayland && *wayland);
    }
    return false;
}

static bool open_renderer(struct booth *b, struct error *err)
{
    const struct booth_settings *settings = &b->setup->settings;
    struct renderer_options options = {
        .window = wants_window(settings),
        .fullscreen = settings->display.fullscreen,
        .width = settings->screen.width_px,
        .height = settings->screen.height_px,
        .bits = booth_bits(settings),
    };
    memcpy(options.monitor, settings->display.monitor, sizeof options.monitor);
    b->renderer = renderer_create(&options, err);
    if (b->renderer)
        log_line(LOG_LEVEL_INFO, "drawing %s with %s",
                 options.window ? "in a window" : "off screen", renderer_name(b->renderer));
    return b->renderer;
}

static bool socket_path(const struct service *s, char *out, size_t size, struct error *err)
{
    const struct booth_settings *b = &s->booth.setup->settings;
    const char *given = *s->options.socket ? s->options.socket : b->control.socket;
    if (*given)
        return path_absolute(given, out, size, err);
    if (!booth_socket_default(getenv("XDG_RUNTIME_DIR"), out, size, err))
        return false;
    char *slash = strrchr(out, '/');
    *slash = 0;
    bool fine = !mkdir(out, 0700) || errno == EEXIST || fail_errno(err, "making %s", out);
    *slash = '/';
    return fine;
}

static bool start_instruments(struct service *s, struct error *err)
{
    struct booth *b = &s->booth;
    struct classifier taught;
    struct acquire_from from = acquire_from(&b->setup->settings);
    lamps_teach(&b->setup->lamps, &taught);
    estimator_init(&b->estimator, &b->setup->settings, &taught);
    b->instruments = acquire_start(&from, err);
    s->desk = b->instruments ? desk_open(&b->setup->settings, b->instruments, err) : NULL;
    return s->desk;
}

static bool draw(struct service *s, bool force, struct error *err)
{
    struct snapshot now;
    char line[256];
    bool fine = frame(&s->booth, clock_now_ns(), force, err);
    snapshot_take(&s->booth, &now);
    mailbox_post(&s->snapshots, &now);
    snapshot_line(&now, line, sizeof line);
    notify_line(&s->notifier, line);
    return fine;
}

static bool start(struct service *s, struct error *err)
{
    char path[108], text[256];
    clock_utc(s->since);
    notify_init(&s->notifier);
    if (!catch_signals(s, err) ||
        !setup_load(&s->options.source, clock_utc_s(), &s->booth.setup, err) ||
        !socket_path(s, path, sizeof path, err) || !open_renderer(&s->booth, err))
        return false;
    s->jobs = jobs_create(err);
    s->renewal = s->jobs ? renewal_begin(&s->booth, &s->options.source, err) : NULL;
    if (!s->renewal || !start_instruments(s, err))
        return false;
    if (!mailbox_init(&s->snapshots, sizeof(struct snapshot)))
        return fail(err, ERROR_SYSTEM, "no memory for the status");
    struct estimator *e = &s->booth.estimator;
    s->booth.shown = s->booth.state = e->state;
    if (!draw(s, true, err))
        return false;
    struct serve_with with = {&s->snapshots, s->booth.instruments, s->desk, s->jobs, s->since};
    s->serve = serve_start(path, &with, err);
    if (!s->serve)
        return false;
    for (int i = 0; setup_warning(s->booth.setup, i, text, sizeof text); i++)
        log_line(LOG_LEVEL_WARNING, "%s", text);
    log_line(LOG_LEVEL_NOTICE, "ready, listening at %s", path);
    notify_ready();
    return true;
}

// Ends what runs in the order in which it leans on each other. What hangs in a
// driver is left behind: the program ends in any case.
static bool stop(struct service *s)
{
    int64_t deadline_ns = clock_now_ns() + STOP_WITHIN_NS;
    notify_stopping();
    serve_stop(s->serve);
    renewal_end(s->renewal);
    bool clean = desk_close(s->desk, deadline_ns);
    if (!clean || !acquire_stop(s->booth.instruments, deadline_ns)) {
        log_line(LOG_LEVEL_WARNING, "an instrument did not answer in time and is left as it is");
        clean = false;
    }
    renderer_destroy(s->booth.renderer);
    if (!clean)
        return false;
    mailbox_fini(&s->snapshots);
    jobs_destroy(s->jobs);
    setup_free(s->booth.setup);
    if (s->signals >= 0)
        close(s->signals);
    return true;
}

static void complain(struct service *s, bool fine, const struct error *err)
{
    const char *text = fine ? "" : err->text;
    if (strcmp(s->complaint, text) && !fine)
        log_line(LOG_LEVEL_ERROR, "%s", text);
    snprintf(s->complaint, sizeof s->complaint, "%s", text);
}

static void do_jobs(struct service *s)
{
    struct job job;
    struct snapshot now;
    while (!s->stop && jobs_take(s->jobs, &job)) {
        request_do(&s->booth, &s->options.source, &job, clock_now_ns());
        s->stop = job.kind == JOB_QUIT;
        snapshot_take(&s->booth, &now);
        mailbox_post(&s->snapshots, &now);
        jobs_finish(s->jobs, &job);
    }
}

static void take_signals(struct service *s)
{
    struct signalfd_siginfo got;
    struct error err;
    while (read(s->signals, &got, sizeof got) == sizeof got)
        if (got.ssi_signo != SIGHUP)
            s->stop = true;
        else if (!booth_reload(&s->booth, &s->options.source, clock_now_ns(), NULL, &err))
            log_line(LOG_LEVEL_ERROR, "%s", err.text);
        else
            log_line(LOG_LEVEL_NOTICE, "reloaded %s", s->options.config);
}

static void loop(struct service *s)
{
    struct pollfd waiting[] = {{s->signals, POLLIN, 0}, {jobs_fd(s->jobs), POLLIN, 0}};
    while (!s->stop) {
        struct error err = {0};
        poll(waiting, 2, TICK_MS);
        take_signals(s);
        do_jobs(s);
        renewal_step(s->renewal, clock_now_ns(), clock_utc_s());
        complain(s, draw(s, false, &err), &err);
        notify_alive(&s->notifier, clock_now_ns(), !s->booth.blind);
        if (!renderer_events(s->booth.renderer, 0))
            s->stop = true;
        if (serve_ended(s->serve)) {
            s->stop = true;
            s->code = EXIT_FAILED;
        }
    }
}

static int run(struct boothd_options *options)
{
    static struct service s; // too large for a stack, and one per program
    struct error err = {0};
    s = (struct service){.options = *options, .signals = -1};
    s.options.source.path = s.options.config;
    if (start(&s, &err))
        loop(&s);
    else
        s.code = exit_code(&err);
    if (!stop(&s))
        _exit(s.code);
    return s.code;
}

static bool check_calibration(const struct booth_settings *b, struct error *err)
{
    const char *calibration = b->spectrometer.options.calibration;
    return !booth_spectrometer(b) || !*calibration || path_exists(calibration) ||
           fail(err, ERROR_CONFIG, "[spectrometer] calibration = %s: is not there", calibration);
}

// A socket that no --socket replaces; without one the session decides.
static bool check_socket(const struct boothd_options *o, const struct booth_settings *b,
                         struct error *err)
{
    char folder[sizeof b->control.socket];
    snprintf(folder, sizeof folder, "%s", *o->socket ? "" : b->control.socket);
    char *slash = strrchr(folder, '/');
    if (!slash)
        return true;
    slash[slash == folder] = 0;
    return !access(folder, W_OK | X_OK) || fail(err, ERROR_CONFIG, "[control] socket = %s: %s: %s",
                                                b->control.socket, folder, strerror(errno));
}

static int check(const struct boothd_options *options)
{
    const struct setup_source *source = &options->source;
    struct error err = {0};
    struct setup *setup;
    char text[256];
    int missing = 0;
    if (!setup_load(source, clock_utc_s(), &setup, &err))
        return exit_code(&err);
    bool fine = (check_calibration(&setup->settings, &err) &&
                 check_socket(options, &setup->settings, &err)) ||
                while_doing(&err, "%s", source->path);
    for (; setup_warning(setup, missing, text, sizeof text); missing++)
        printf("%s\n", text);
    printf("%s: %d lamps, %s\n", source->path, setup->lamps.count,
           setup->has_display ? setup->display.name : "no display model");
    setup_free(setup);
    return !fine ? exit_code(&err) : missing ? EXIT_MISSING : EXIT_FINE;
}

static int perform(struct boothd_options *options)
{
    switch (options->mode) {
    case MODE_RUN:
        return run(options);
    case MODE_CHECK:
        return check(options);
    case MODE_DESCRIBE:
        booth_describe(stdout);
        return EXIT_FINE;
    case MODE_DESCRIBE_MAN:
        booth_describe_man(stdout);
        return EXIT_FINE;
    case MODE_UDEV:
        udev_rules_print(stdout);
        return EXIT_FINE;
    case MODE_VERSION:
        printf("boothd %s\n", BOOTHD_VERSION);
        return EXIT_FINE;
    case MODE_HELP:
        fputs(boothd_help, stdout);
        return EXIT_FINE;
    }
    return EXIT_FAILED;
}

int main(int argc, char **argv)
{
    struct boothd_options options;
    struct error err = {0};
    log_init("boothd", LOG_LEVEL_INFO);
    if (!options_parse(argc, argv, getenv("XDG_CONFIG_HOME"), getenv("HOME"), &options, &err))
        return exit_code(&err);
    log_init("boothd", options.verbose ? LOG_LEVEL_DEBUG : LOG_LEVEL_INFO);
    options.source.path = options.config;
    int code = perform(&options);
    if (!fflush(stdout) && !ferror(stdout))
        return code;
    log_line(LOG_LEVEL_ERROR, "standard output cannot be written");
    return EXIT_FAILED;
}
