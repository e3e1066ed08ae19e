// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_spotread.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "simulator/model_noise.h"
#include "simulator/spotread_file.h"
#include "simulator/spotread_options.h"

enum { OUT_SIZE = 32768, SAMPLES = 8, ESCAPE = 0x1b, CTRL_C = 0x03 };
enum { STATUS_ERROR = 1, STATUS_REFUSED = 255 };

#define CALIBRATE_S 2.0
#define OVERHEAD_S 0.5 // then as long again in the dark
#define STUCK_S 0.1

enum step {
    CONNECTING,
    AT_CALIBRATION,
    CALIBRATING,
    AT_PROMPT,
    EXPOSING,
    IN_THE_DARK,
    AT_STOPPED, // asked whether to give up
    AT_FAILED,
    AT_FILE_NAME,
    ENDED,
};

struct spotread {
    struct spotread_settings settings;
    struct spotread_options options;
    const struct spotread_meter *meter;
    struct noise noise;
    struct lapse lapse;
    FILE *log;
    char out[OUT_SIZE], told[OUT_SIZE], err[512], err_told[512];
    size_t size;
    int status;

    enum step step;
    int64_t until_ns;
    bool calibrated, asked; // asked: by key, not because it was needed
    bool fine;              // high resolution
    bool drops_keys;
    int trigger; // the key

    int samples;
    double exposure_s;
    struct spectrum sum;
    enum spotread_trouble trouble;
    int plug; // that it began with

    int readings;
    struct spotread_reading last;
};

// ---- words -------------------------------------------------------------------------

__attribute__((format(printf, 2, 3))) static void say(struct spotread *p, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    size_t room = sizeof(p->out) - p->size;
    int n = vsnprintf(p->out + p->size, room, format, args);
    va_end(args);
    if (n > 0 && (size_t)n < room)
        p->size += (size_t)n;
}

static void end(struct spotread *p, int status)
{
    p->step = ENDED;
    p->status = status;
}

static void die(struct spotread *p, const char *text)
{
    snprintf(p->err, sizeof(p->err), "spotread: Error - %s\n", text);
    end(p, STATUS_ERROR);
}

static void wait_for(struct spotread *p, enum step step, int64_t now_ns, double seconds)
{
    p->step = step;
    p->until_ns = now_ns + (int64_t)(seconds / p->settings.hurry * NS_PER_S);
}

static void ask_to_go_on(struct spotread *p, enum step step)
{
    say(p, "Hit Esc or Q to give up, any other key to retry:");
    p->drops_keys = step == AT_FAILED;
    p->step = step;
}

static bool gives_up(int key)
{
    return key == ESCAPE || key == CTRL_C || key == 'q' || key == 'Q';
}

// ---- prompts -----------------------------------------------------------------------

static void begin_exposure(struct spotread *p, int64_t now_ns, double in_s)
{
    p->samples = 0;
    memset(&p->sum, 0, sizeof(p->sum));
    wait_for(p, EXPOSING, now_ns, in_s);
}

static void begin_reading(struct spotread *p, int64_t now_ns, int key)
{
    p->trigger = key;
    if (key)
        say(p, "\n");
    begin_exposure(p, now_ns, 0);
}

static void prompt(struct spotread *p, int64_t now_ns)
{
    say(p, "\nPlace instrument on spot to be measured,\n"
           "(r reference, s save spectrum, h resolution, k calibration, f and F refresh rate)\n");
    if (p->meter->has_target)
        say(p, "'t' to toggle laser target\n");
    say(p, "Hit ESC or Q to exit, %sany other key to take a reading: ",
        p->meter->has_switch ? "instrument switch or " : "");
    p->step = AT_PROMPT;
    if (p->options.one)
        begin_reading(p, now_ns, 0);
}

static void calibrate(struct spotread *p, int64_t now_ns, bool asked)
{
    p->asked = asked;
    say(p, "\nPlace cap on the instrument, or place on a dark surface,\n"
           "or place on the calibration reference,\n and then hit any key to continue,\n"
           " or hit Esc or Q to abort: ");
    p->step = AT_CALIBRATION;
    if (p->options.one)
        wait_for(p, CALIBRATING, now_ns, CALIBRATE_S);
}

// What comes round again and again.
static void again(struct spotread *p, int64_t now_ns)
{
    if (p->meter->dark_first && !p->calibrated && !p->options.no_calibration) {
        say(p, "\nSpot read needs a calibration before continuing\n");
        calibrate(p, now_ns, false);
    } else {
        prompt(p, now_ns);
    }
}

static void calibration_key(struct spotread *p, int64_t now_ns, int key)
{
    say(p, "\n");
    if (!gives_up(key)) {
        wait_for(p, CALIBRATING, now_ns, CALIBRATE_S);
        return;
    }
    say(p, "\nSpot read got abort or error from %s\n", p->asked ? "calibrate" : "calibration");
    end(p, 0);
}

static void calibrated(struct spotread *p, int64_t now_ns)
{
    p->calibrated = true;
    say(p, "Calibration complete\n");
    if (p->options.one)
        end(p, 0);
    else
        again(p, now_ns);
}

// ---- start -------------------------------------------------------------------------

static void refuse(struct spotread *p, const char *text)
{
    say(p, "%s", text);
    end(p, STATUS_REFUSED);
}

static bool take_correction(struct spotread *p)
{
    const char *path = p->options.correction;
    FILE *file = path ? fopen(path, "r") : NULL;
    if (file)
        fclose(file);
    if (path && !file)
        refuse(p, "\nReading CCMX/CCSS File failed\n");
    else if (path && p->meter->bands)
        refuse(p, "\nInstrument doesn't have Colorimeter Correction Matrix capability\n");
    return p->step != ENDED;
}

static void set_up(struct spotread *p, int64_t now_ns)
{
    const struct spotread_options *o = &p->options;
    if (o->ambient)
        refuse(p, "Requested ambient light capability,\nand instrument doesn't support it.\n");
    else if (o->spectrum && !p->meter->bands)
        refuse(p, "Need spectral information for custom illuminant or observer\n"
                  "and instrument doesn't support it\n");
    if (p->step == ENDED || !take_correction(p))
        return;
    if (o->display_type && p->meter->bands)
        say(p, "Display/calibration type ignored - instrument doesn't support it\n");
    if (o->verbose)
        say(p, "Init instrument success !\n");
    p->fine = o->high_res && p->meter->fine_bands;
    again(p, now_ns);
}

static void connect_to(struct spotread *p, int64_t now_ns, const struct spotread_sight *sight)
{
    char text[64];
    snprintf(text, sizeof(text), "No instrument at port %d", p->options.port);
    if (sight->trouble == SPOTREAD_GONE || p->options.port != 1) {
        die(p, text);
        return;
    }
    p->plug = sight->plug;
    if (p->options.verbose)
        say(p, "Instrument Type:   %s\nSerial Number:     %s\n", p->meter->name,
            p->settings.serial);
    set_up(p, now_ns);
}

struct spotread *spotread_create(const struct spotread_settings *settings, int argc, char **argv)
{
    struct spotread *p = calloc(1, sizeof(*p));
    char why[128];
    if (!p)
        return NULL;
    p->settings = *settings;
    p->meter = spotread_meter(settings->kind);
    p->lapse.rates = settings->lapses;
    noise_init(&p->noise, settings->seed, 's');
    if (!spotread_options(&p->options, argc, argv, why)) {
        snprintf(p->err, sizeof(p->err), "Diagnostic: %s\nusage: spotread [-options] [logfile]\n",
                 why);
        end(p, STATUS_ERROR);
    } else if (p->options.log_path && !(p->log = fopen(p->options.log_path, "w"))) {
        die(p, "Unable to open logfile for writing");
    } else if (p->options.verbose) {
        say(p, "Connecting to the instrument ..\n");
    }
    return p;
}

void spotread_destroy(struct spotread *program)
{
    if (program && program->log)
        fclose(program->log);
    free(program);
}

// ---- readings ------------------------------------------------------------------------

static void expose(struct spotread *p, int64_t now_ns, const struct spotread_sight *sight)
{
    p->trouble = sight->plug == p->plug ? sight->trouble : SPOTREAD_GONE;
    lapse_set(&p->lapse, sight->lapse);
    if (p->samples == 0)
        p->exposure_s = spotread_exposure_s(&sight->radiance);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        p->sum.v[i] += sight->radiance.v[i];
    p->samples++;
    if (p->trouble == SPOTREAD_STUCK)
        begin_exposure(p, now_ns, STUCK_S);
    else if (p->samples == SAMPLES || p->trouble == SPOTREAD_GONE)
        wait_for(p, IN_THE_DARK, now_ns, p->exposure_s + OVERHEAD_S);
    else
        wait_for(p, EXPOSING, now_ns, p->exposure_s / (SAMPLES - 1));
}

static void say_spectrum(struct spotread *p)
{
    const struct spotread_bands *b = &p->last.bands;
    int peak = 0;
    say(p, "Spectrum from %.3f to %.3f nm in %d steps\n", b->first_nm, b->last_nm, b->count);
    for (int i = 0; i < b->count; i++) {
        say(p, "%s%g", i ? ", " : "", b->mw[i]);
        peak = b->mw[i] > b->mw[peak] ? i : peak;
    }
    say(p, "\nPeak value %f at (aprox.) %.1f nm\n", b->mw[peak], spotread_band_nm(b, peak));
}

static void say_result(struct spotread *p)
{
    const struct xyz *c = &p->last.xyz;
    struct xy xy = xy_of(*c);
    struct uv uv = uv_of(*c);
    struct lch lch = lch_of(p->last.lab);
    say(p, "\n Result is XYZ: %f %f %f, ", c->X, c->Y, c->Z);
    switch (p->options.form) {
    case SPOTREAD_LAB:
        say(p, "D50 Lab: %f %f %f\n", p->last.lab.L, p->last.lab.a, p->last.lab.b);
        break;
    case SPOTREAD_YXY:
        say(p, "Yxy: %f %f %f\n", c->Y, xy.x, xy.y);
        break;
    case SPOTREAD_LCH:
        say(p, "LCh: %f %f %f\n", lch.L, lch.C, lch.h);
        break;
    case SPOTREAD_YUV:
        say(p, "Yuv: %f %f %f\n", c->Y, uv.u, uv.v);
        break;
    }
    struct cct cct = cct_of(xy);
    if (p->options.cct && cct.valid)
        say(p, "                           CCT = %.0fK (Duv %.4f)\n", cct.kelvin, cct.duv);
    else if (p->options.cct)
        say(p, "                      (Bad CCT)\n");
}

static void succeed(struct spotread *p, int64_t now_ns)
{
    int key = p->trigger;
    if (key >= 'A' && key <= 'Z') {
        say(p, "\nMeasured media to setup FWA compensation slot '%c'\n", key);
        die(p, "Instrument doesn't have an FWA illuminent");
        return;
    }
    if (key >= 'a' && key <= 'z')
        say(p, "\nUnable to apply FWA compensation because it wasn't set up\n");
    if (p->options.spectrum)
        say_spectrum(p);
    say_result(p);
    p->readings++;
    if (p->log)
        spotread_log(p->log, p->readings, &p->last, p->options.spectrum);
    if (p->options.one_path && p->last.bands.count &&
        !spotread_save_spectrum(p->options.one_path, &p->last.bands, NULL))
        say(p, "\nWriting file '%s' failed\n", p->options.one_path);
    if (p->options.one)
        end(p, 0);
    else
        again(p, now_ns);
}

static void misread(struct spotread *p, const char *why)
{
    say(p, "\n\nSpot read failed due to misread (%s)\n", why);
    ask_to_go_on(p, AT_FAILED);
}

static void finish_reading(struct spotread *p, int64_t now_ns)
{
    const struct spotread_meter *m = p->meter;
    struct spectrum mean = p->sum;
    double factor = 1;
    spectrum_scale(&mean, 1.0 / p->samples);
    double Y = xyz_absolute(&mean, OBSERVER_1931_2).Y;
    if (p->trouble == SPOTREAD_GONE) {
        say(p, "\n\nSpot read failed due to communication problem.\n");
        ask_to_go_on(p, AT_FAILED);
    } else if (p->trouble == SPOTREAD_FATAL) {
        say(p, "\n\nGot fatal error 'Communication protocol breakdown' (Unknown error code)\n");
        end(p, 0);
    } else if (p->trouble == SPOTREAD_WEAK || Y < m->least_cdm2) {
        misread(p, m->too_weak);
    } else if (p->trouble == SPOTREAD_BRIGHT || Y > m->most_cdm2) {
        misread(p, m->too_bright);
    } else if (!lapse_next(&p->lapse, &factor)) {
        misread(p, m->misread);
    } else {
        spotread_measure(m, p->fine, p->options.observer, &p->noise, &mean, factor, &p->last);
        succeed(p, now_ns);
    }
}

// ---- keys ------------------------------------------------------------------------------

static void toggle_resolution(struct spotread *p)
{
    if (!p->meter->fine_bands) {
        say(p, "\n 'H' Command ignored - instrument doesn't support high res. mode\n");
        return;
    }
    p->fine = !p->fine;
    say(p, "\n Instrument set to %s resolution spectrum mode\n", p->fine ? "high" : "standard");
}

static void take_reference(struct spotread *p)
{
    const struct xyz *c = &p->last.xyz;
    if (!p->readings)
        say(p, "\n No previous reading to use as reference\n");
    else
        say(p, "\n Reference is now XYZ: %f %f %f Lab: %f %f %f\n", c->X, c->Y, c->Z, p->last.lab.L,
            p->last.lab.a, p->last.lab.b);
}

static void ask_file_name(struct spotread *p, int64_t now_ns)
{
    if (p->readings && p->last.bands.count) {
        say(p, "\nEnter filename (ie. xxxx.sp): ");
        p->step = AT_FILE_NAME;
    } else {
        say(p, "\nNo previous spectral reading to save to file (Use -s flag ?)\n");
        again(p, now_ns);
    }
}

static void command(struct spotread *p, int64_t now_ns, int key)
{
    say(p, "\n");
    if (key == 's' || key == 'S') {
        ask_file_name(p, now_ns);
        return;
    }
    if (key == 'k' || key == 'K')
        say(p, "\nDoing a calibration\n");
    if ((key == 'k' || key == 'K') && p->meter->dark_first) {
        calibrate(p, now_ns, true);
        return;
    }
    if (key == 'h' || key == 'H')
        toggle_resolution(p);
    if (key == 'r' || key == 'R')
        take_reference(p);
    if (key == 'F')
        say(p, "\nNo refresh detectable, or measurement failed\n");
    if (key == 'f')
        say(p, "\nInstrument isn't capable of refresh rate calibration\n");
    again(p, now_ns);
}

static void prompt_key(struct spotread *p, int64_t now_ns, int key)
{
    if (gives_up(key)) {
        say(p, "\n\nSpot read stopped at user request!\n");
        ask_to_go_on(p, AT_STOPPED);
    } else if (key && strchr("rRhHkKsSfF", key)) {
        command(p, now_ns, key);
    } else if (key == 't' && p->meter->has_target) {
        command(p, now_ns, key);
    } else {
        begin_reading(p, now_ns, key);
    }
}

static void retry_key(struct spotread *p, int64_t now_ns, int key)
{
    say(p, "\n");
    if (gives_up(key))
        end(p, 0);
    else
        again(p, now_ns);
}

// ---- what it wants -----------------------------------------------------------------------

enum spotread_want spotread_wants(const struct spotread *program, int64_t now_ns, int64_t *until_ns)
{
    const struct spotread *p = program;
    *until_ns = p->until_ns;
    switch (p->step) {
    case CONNECTING:
        return SPOTREAD_SIGHT;
    case EXPOSING:
        return now_ns < p->until_ns ? SPOTREAD_TIME : SPOTREAD_SIGHT;
    case CALIBRATING:
    case IN_THE_DARK:
        return SPOTREAD_TIME;
    case AT_PROMPT:
        return SPOTREAD_KEY;
    case AT_STOPPED:
    case AT_FAILED:
        return SPOTREAD_NEXT_KEY;
    case AT_CALIBRATION:
        return SPOTREAD_FRESH_KEY;
    case AT_FILE_NAME:
        return SPOTREAD_LINE;
    case ENDED:
        break;
    }
    return SPOTREAD_END;
}

void spotread_key(struct spotread *program, int64_t now_ns, int key)
{
    struct spotread *p = program;
    if (p->step == AT_PROMPT)
        prompt_key(p, now_ns, key);
    else if (p->step == AT_CALIBRATION)
        calibration_key(p, now_ns, key);
    else if (p->step == AT_STOPPED || p->step == AT_FAILED)
        retry_key(p, now_ns, key);
}

void spotread_line(struct spotread *program, int64_t now_ns, const char *line)
{
    struct spotread *p = program;
    bool saved = *line && spotread_save_spectrum(line, &p->last.bands, NULL);
    if (*line)
        say(p, "\nWriting file '%s' %s\n", line, saved ? "succeeded" : "failed");
    else
        say(p, "\nNo filename, nothing saved\n");
    again(p, now_ns);
}

void spotread_sight(struct spotread *program, int64_t now_ns, const struct spotread_sight *sight)
{
    if (program->step == CONNECTING)
        connect_to(program, now_ns, sight);
    else if (program->step == EXPOSING)
        expose(program, now_ns, sight);
}

void spotread_time(struct spotread *program, int64_t now_ns)
{
    if (now_ns < program->until_ns)
        return;
    if (program->step == CALIBRATING)
        calibrated(program, now_ns);
    else if (program->step == IN_THE_DARK)
        finish_reading(program, now_ns);
}

bool spotread_drops_keys(struct spotread *program)
{
    bool drops = program->drops_keys;
    program->drops_keys = false;
    return drops;
}

const char *spotread_out(struct spotread *program)
{
    memcpy(program->told, program->out, program->size);
    program->told[program->size] = '\0';
    program->size = 0;
    return program->told;
}

const char *spotread_err(struct spotread *program)
{
    strcpy(program->err_told, program->err);
    program->err[0] = '\0';
    return program->err_told;
}

int spotread_status(const struct spotread *program)
{
    return program->status;
}
