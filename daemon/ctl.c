// SPDX-License-Identifier: Apache-2.0
#include "daemon/ctl.h"

#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/control.h"
#include "base/number.h"
#include "config/paths.h"

const char ctl_help[] =
    "Usage: boothctl [--socket PATH] [--json] [--timeout S] COMMAND\n"
    "Talks to boothd.\n"
    "\n"
    "  status                      what is believed now, and what is on the screen\n"
    "  show MATERIAL [--patch NAME] a material by name or .ini file, or one patch of it\n"
    "  patch R G B                 uniform counts, each 0..1 of full code, undithered\n"
    "  capture FILE.png|.exr       the screen as counts, or as XYZ in cd/m2\n"
    "  probe X Y                   what that pixel should be, in double precision\n"
    "  measure                     a reading of the radiometer\n"
    "  teach LAMP [--readings N]   mean spectrum of the lamp now on (20 readings)\n"
    "  raw [--readings N] [--integration US]\n"
    "                              raw counts of the spectrometer (20 readings)\n"
    "  reload                      load settings, display model and lamps again\n"
    "  quit                        end boothd\n"
    "\n"
    "  --socket PATH  control socket (boothd/boothd.sock in XDG_RUNTIME_DIR)\n"
    "  --json         the reply as it came\n"
    "  --timeout S    longest wait for the answer\n"
    "  --version, --help\n"
    "\n"
    "Ends with 0; 1 when it failed; 2 on wrong usage or input; 3 when done, with\n"
    "a warning.\n";

enum {
    OPTION_SOCKET = 256,
    OPTION_JSON,
    OPTION_TIMEOUT,
    OPTION_PATCH,
    OPTION_READINGS,
    OPTION_INTEGRATION,
    OPTION_VERSION,
    OPTION_HELP
};

static const struct option long_options[] = {
    {"socket", required_argument, NULL, OPTION_SOCKET},
    {"json", no_argument, NULL, OPTION_JSON},
    {"timeout", required_argument, NULL, OPTION_TIMEOUT},
    {"patch", required_argument, NULL, OPTION_PATCH},
    {"readings", required_argument, NULL, OPTION_READINGS},
    {"integration", required_argument, NULL, OPTION_INTEGRATION},
    {"version", no_argument, NULL, OPTION_VERSION},
    {"help", no_argument, NULL, OPTION_HELP},
    {0},
};

// What stands on the command line, before it is a request.
struct words {
    const char *of[8];
    int count;
    const char *patch, *readings, *integration;
};

static bool number(const char *name, const char *text, double least, double most, double *out,
                   struct error *err)
{
    const char *end;
    if (!number_parse(text, &end, out) || *end || !(*out >= least && *out <= most))
        return fail(err, ERROR_RANGE, "%s: \"%s\" is not a number in %g..%g", name, text, least,
                    most);
    return true;
}

static json_t *simple(const struct words *w, struct error *err)
{
    (void)err;
    return json_pack("{s:s}", "do", w->of[0]);
}

static json_t *show(const struct words *w, struct error *err)
{
    char path[512];
    const char *material = w->of[1];
    if (strchr(material, '/')) {
        if (!path_absolute(material, path, sizeof path, err))
            return NULL;
        material = path;
    }
    json_t *request = json_pack("{s:s, s:s}", "do", w->of[0], "material", material);
    if (request && w->patch)
        json_object_set_new(request, "patch", json_string(w->patch));
    return request;
}

static json_t *patch(const struct words *w, struct error *err)
{
    static const char *const names[] = {"R", "G", "B"};
    double v[3];
    for (int i = 0; i < 3; i++)
        if (!number(names[i], w->of[1 + i], 0, 1, &v[i], err))
            return NULL;
    return json_pack("{s:s, s:[f,f,f]}", "do", w->of[0], "rgb", v[0], v[1], v[2]);
}

static json_t *capture(const struct words *w, struct error *err)
{
    char path[512];
    if (!path_absolute(w->of[1], path, sizeof path, err))
        return NULL;
    return json_pack("{s:s, s:s}", "do", w->of[0], "file", path);
}

static json_t *probe(const struct words *w, struct error *err)
{
    double x, y;
    if (!number("X", w->of[1], 0, 16383, &x, err) || !number("Y", w->of[2], 0, 16383, &y, err))
        return NULL;
    return json_pack("{s:s, s:f, s:f}", "do", w->of[0], "x_px", x, "y_px", y);
}

static json_t *teach(const struct words *w, struct error *err)
{
    double readings = 20;
    if (w->readings && !number("--readings", w->readings, 1, 1000, &readings, err))
        return NULL;
    return json_pack("{s:s, s:s, s:f}", "do", w->of[0], "lamp", w->of[1], "readings", readings);
}

static json_t *raw(const struct words *w, struct error *err)
{
    double readings = 20, us = 0;
    if (w->readings && !number("--readings", w->readings, 1, 1000, &readings, err))
        return NULL;
    if (w->integration && !number("--integration", w->integration, 10, 65535000, &us, err))
        return NULL;
    return json_pack("{s:s, s:f, s:f}", "do", w->of[0], "readings", readings, "integration_us", us);
}

static const struct command {
    const char *name;
    int arguments;
    int timeout_s;
    json_t *(*request)(const struct words *words, struct error *err);
} commands[] = {
    {CONTROL_STATUS, 0, 10, simple}, {CONTROL_SHOW, 1, 60, show},
    {CONTROL_PATCH, 3, 60, patch},   {CONTROL_CAPTURE, 1, 60, capture},
    {CONTROL_PROBE, 2, 60, probe},   {CONTROL_MEASURE, 0, 90, simple},
    {CONTROL_TEACH, 1, 90, teach},   {CONTROL_RAW, 0, 90, raw},
    {CONTROL_RELOAD, 0, 60, simple}, {CONTROL_QUIT, 0, 10, simple},
};

static const struct command *find(const char *name)
{
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        if (!strcmp(commands[i].name, name))
            return &commands[i];
    return NULL;
}

static bool take_option(int option, const char *value, struct words *words, struct ctl *c,
                        struct error *err)
{
    switch (option) {
    case OPTION_SOCKET:
        return path_beside(NULL, value, c->socket, sizeof c->socket, err) ||
               while_doing(err, "--socket");
    case OPTION_TIMEOUT:
        return number("--timeout", value, 0.1, 3600, &c->timeout_s, err);
    case OPTION_PATCH:
        words->patch = value;
        return true;
    case OPTION_READINGS:
        words->readings = value;
        return true;
    case OPTION_INTEGRATION:
        words->integration = value;
        return true;
    case OPTION_JSON:
        return c->json = true;
    case OPTION_VERSION:
        return c->version = true;
    case OPTION_HELP:
        return c->help = true;
    default:
        return fail(err, ERROR_CONFIG,
                    "an option is unknown or its value is missing; see "
                    "boothctl --help");
    }
}

static bool make_request(const struct words *w, struct ctl *c, struct error *err)
{
    if (!w->count)
        return fail(err, ERROR_CONFIG, "a command is missing; see boothctl --help");
    const struct command *command = find(w->of[0]);
    if (!command)
        return fail(err, ERROR_CONFIG, "\"%s\" is no command; see boothctl --help", w->of[0]);
    if (w->count - 1 != command->arguments)
        return fail(err, ERROR_CONFIG, "%s takes %d arguments, not %d; see boothctl --help",
                    command->name, command->arguments, w->count - 1);
    if (w->patch && strcmp(command->name, CONTROL_SHOW))
        return fail(err, ERROR_CONFIG, "--patch belongs to show");
    bool is_raw = !strcmp(command->name, CONTROL_RAW);
    if (w->readings && !is_raw && strcmp(command->name, CONTROL_TEACH))
        return fail(err, ERROR_CONFIG, "--readings belongs to teach and raw");
    if (w->integration && !is_raw)
        return fail(err, ERROR_CONFIG, "--integration belongs to raw");
    struct error why = {0};
    c->what = command->name;
    c->request = command->request(w, &why);
    if (c->request)
        return true;
    return why.code ? fail(err, why.code, "%s", why.text)
                    : fail(err, ERROR_RANGE, "%s: not valid UTF-8", command->name);
}

// "-0.1" is a number, though getopt would look for options in it: it is shown
// the text behind the sign, and what it gives back is looked up again.
static bool is_negative(const char *text)
{
    const char *end;
    double value;
    return *text == '-' && number_parse(text, &end, &value) && !*end;
}

static const char *with_sign(char **given, int count, const char *text)
{
    for (int i = 0; text && i < count; i++)
        if (text == given[i] + 1 && is_negative(given[i]))
            return given[i];
    return text;
}

static bool take_all(int argc, char **given, char **argv, struct words *words, struct ctl *c,
                     struct error *err)
{
    int option;
    optind = 0; // getopt starts anew, so that tests may call this twice
    opterr = 0;
    while ((option = getopt_long(argc, argv, "", long_options, NULL)) != -1)
        if (!take_option(option, with_sign(given, argc, optarg), words, c, err))
            return false;
    for (; optind < argc; optind++) {
        if (words->count == 8)
            return fail(err, ERROR_CONFIG, "too many arguments; see boothctl --help");
        words->of[words->count++] = with_sign(given, argc, argv[optind]);
    }
    return true;
}

bool ctl_parse(int argc, char **argv, struct ctl *c, struct error *err)
{
    struct words words = {0};
    char **shown = calloc((size_t)argc + 1, sizeof *shown);
    *c = (struct ctl){0};
    if (!shown)
        return fail(err, ERROR_SYSTEM, "no memory for the arguments");
    for (int i = 0; i < argc; i++)
        shown[i] = argv[i] + is_negative(argv[i]);
    bool fine = take_all(argc, argv, shown, &words, c, err);
    free(shown);
    if (!fine)
        return false;
    return c->help || c->version || make_request(&words, c, err);
}

int ctl_timeout_ms(const struct ctl *c)
{
    return 1000 * (c->timeout_s > 0 ? c->timeout_s : find(c->what)->timeout_s);
}

static double real(const json_t *object, const char *key)
{
    return json_number_value(json_object_get(object, key));
}

static const char *text(const json_t *object, const char *key)
{
    const char *value = json_string_value(json_object_get(object, key));
    return value ? value : "";
}

static void triple(const json_t *object, const char *key, const char *format, FILE *out)
{
    const json_t *v = json_object_get(object, key);
    for (size_t i = 0; i < json_array_size(v); i++) {
        fputs(i ? " " : "", out);
        fprintf(out, format, json_number_value(json_array_get(v, i)));
    }
}

static void print_instrument(const char *name, const json_t *i, FILE *out)
{
    fprintf(out, "%-14s %s", name, text(i, "state"));
    if (*text(i, "model"))
        fprintf(out, ", %s %s%s", text(i, "model"), text(i, "serial"),
                json_is_true(json_object_get(i, "emulated")) ? " (emulated)" : "");
    if (json_is_number(json_object_get(i, "age_ms")))
        fprintf(out, ", %s %.1f s ago", *text(i, "note") ? text(i, "note") : "read",
                real(i, "age_ms") / 1000);
    if (*text(i, "last_error"))
        fprintf(out, ": %s", text(i, "last_error"));
    fputc('\n', out);
}

static void print_lamp(const json_t *lamp, FILE *out)
{
    const char *verdict = text(lamp, "verdict"), *name = text(lamp, "name");
    fprintf(out, "lamp           %s", *name ? name : verdict);
    if (*name && strcmp(verdict, "known"))
        fprintf(out, " (%s)", verdict);
    fprintf(out, ", %s, confidence %.2f, level %.3f, %.0f lx, distance %.3f\n",
            text(lamp, "standing"), real(lamp, "confidence"), real(lamp, "level"),
            real(lamp, "lux"), real(lamp, "distance"));
}

static void print_screen(const json_t *s, FILE *out)
{
    fprintf(out, "screen         %s", text(s, "scene"));
    if (*text(s, "material"))
        fprintf(out, ", %s%s%s", text(s, "material"), *text(s, "patch") ? ": " : "",
                text(s, "patch"));
    if (json_is_array(json_object_get(s, "rgb"))) {
        fputs(", counts ", out);
        triple(s, "rgb", "%.4f", out);
    }
    fprintf(out, ", %.2f %% out of gamut, %lld frames, %s\n", 100 * real(s, "out_of_gamut"),
            (long long)json_integer_value(json_object_get(s, "frames")), text(s, "renderer"));
}

static void print_status(const json_t *s, FILE *out)
{
    const char *name;
    json_t *i;
    fprintf(out, "%s, boothd %s since %s%s\n", text(s, "booth"), text(s, "version"),
            text(s, "since"), json_is_true(json_object_get(s, "emulated")) ? ", EMULATED" : "");
    json_object_foreach(json_object_get(s, "instruments"), name, i) print_instrument(name, i, out);
    print_lamp(json_object_get(s, "lamp"), out);
    const json_t *tilt = json_object_get(s, "tilt"), *eye = json_object_get(s, "eye");
    fprintf(out, "tilt           %.2f degrees, %s\n", real(tilt, "tilt_deg"),
            text(tilt, "standing"));
    fprintf(out, "eye            ");
    triple(eye, "eye_m", "%.3f", out);
    fprintf(out, " m, %s\n", text(eye, "standing"));
    print_screen(s, out);
    const json_t *display = json_object_get(s, "display");
    if (json_is_object(display))
        fprintf(out, "display        %s, condition %.1f\n", text(display, "model"),
                real(display, "condition"));
    const json_t *calibration = json_object_get(s, "calibration");
    if (json_is_integer(json_object_get(calibration, "version")))
        fprintf(out, "calibration    %04d of %s: %s\n",
                (int)json_integer_value(json_object_get(calibration, "version")),
                text(calibration, "created"), text(calibration, "note"));
    fprintf(out, "proof          %s\n",
            json_is_true(json_object_get(s, "valid")) ? "valid" : "not valid now");
}

static void print_measure(const json_t *r, FILE *out)
{
    fputs("XYZ ", out);
    triple(r, "XYZ", "%.4f", out);
    fprintf(out, " cd/m2, %s %s%s, %s\n", text(r, "instrument"), text(r, "serial"),
            json_is_true(json_object_get(r, "emulated")) ? " (emulated)" : "", text(r, "taken_at"));
}

static double largest(const json_t *values)
{
    double most = 0;
    for (size_t i = 0; i < json_array_size(values); i++)
        most = fmax(most, json_number_value(json_array_get(values, i)));
    return most;
}

static void print_raw(const json_t *r, FILE *out)
{
    const json_t *counts = json_object_get(r, "counts");
    fprintf(out, "%s %s%s: %zu pixels, %.0f readings of %.0f us, highest %.0f of %.0f counts%s\n",
            text(r, "instrument"), text(r, "serial"),
            json_is_true(json_object_get(r, "emulated")) ? " (emulated)" : "",
            json_array_size(counts), real(r, "readings"), real(r, "integration_us"),
            largest(counts), real(r, "saturation"), real(r, "saturated") > 0 ? ", saturated" : "");
}

static void print_probe(const json_t *r, FILE *out)
{
    fprintf(out, "%.2f lx\nsurface ", real(r, "lux"));
    triple(r, "surface", "%.4f", out);
    fputs(" cd/m2\nemitted ", out);
    triple(r, "emitted", "%.4f", out);
    fputs(" cd/m2\ncounts  ", out);
    triple(r, "rgb", "%.6f", out);
    fprintf(out, "%s\n",
            json_is_true(json_object_get(r, "in_gamut")) ? "" : ", out of the display's gamut");
}

static void print_done(const char *what, const json_t *reply, FILE *out)
{
    if (!strcmp(what, CONTROL_STATUS))
        print_status(reply, out);
    else if (!strcmp(what, CONTROL_MEASURE))
        print_measure(reply, out);
    else if (!strcmp(what, CONTROL_PROBE))
        print_probe(reply, out);
    else if (!strcmp(what, CONTROL_TEACH))
        fprintf(out, "%s: %.1f lx, spread %.4f over %.0f readings\n", text(reply, "lamp"),
                real(reply, "lux"), real(reply, "spread"), real(reply, "readings"));
    else if (!strcmp(what, CONTROL_RAW))
        print_raw(reply, out);
    else if (!strcmp(what, CONTROL_CAPTURE))
        fprintf(out, "%s\n", text(reply, "file"));
}

void ctl_print(const char *what, const json_t *reply, FILE *out)
{
    const json_t *warnings = json_object_get(reply, "warnings");
    const json_t *restart = json_object_get(reply, "restart");
    print_done(what, reply, out);
    for (size_t i = 0; i < json_array_size(warnings); i++)
        fprintf(out, "warning: %s\n", json_string_value(json_array_get(warnings, i)));
    for (size_t i = 0; i < json_array_size(restart); i++)
        fprintf(out, "warning: %s changed and counts after a restart only\n",
                json_string_value(json_array_get(restart, i)));
}

bool ctl_warned(const json_t *reply)
{
    return json_array_size(json_object_get(reply, "warnings")) ||
           json_array_size(json_object_get(reply, "restart"));
}
