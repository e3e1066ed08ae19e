// SPDX-License-Identifier: Apache-2.0
#include "drivers/ocean.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "drivers/deadline.h"
#include "drivers/exposure.h"
#include "drivers/irradiance.h"
#include "drivers/ocean_usb.h"

enum {
    COMMAND_INITIALISE = 0x01,
    COMMAND_SLOT = 0x05,
    COMMAND_SPECTRUM = 0x09,
    COMMAND_TRIGGER = 0x0a,
    COMMAND_READ_FPGA = 0x6b,
    COMMAND_STATUS = 0xfe,
    STATUS_BYTES = 16,
    FPGA_VERSION = 0x04,
    FPGA_ECHO_FLAME = 0xfe,
    SPEED_FULL = 0x00,
    SPEED_HIGH = 0x80,
    READOUT_US = 2000,
    MARGIN_US = 20000,
    STALE_READINGS = 2, // acquisitions a unit makes on its own, ocean.md
    MOST_FAILURES = 4,
};

static const double weak_counts = 500; // ten times the read noise

struct spectrometer {
    struct spectrometer_options options;
    struct ocean_usb *usb;
    struct ocean_unit unit;
    struct ocean_axis axis;
    struct ocean_darks darks;
    struct exposure exposure;
    bool high_speed;
    char firmware[16];
    bool flame;
    int integration_us;
    int lent_us;       // exposure of read's own while counts are asked for, 0 = not
    int slowest_us;    // of the exposures that may still be under way
    int stale;         // spectra to throw away before the next one counts
    bool adrift;       // bytes were lost: drain before the next request
    int failures;      // readings without a spectrum, one after the other
    int64_t active_ns; // when the last spectrum came
};

static bool query(struct spectrometer *s, const uint8_t *command, size_t count, uint8_t *reply,
                  size_t size, int64_t deadline_ns, struct error *err)
{
    return ocean_usb_send(s->usb, command, count, deadline_ns, err) &&
           ocean_usb_reply(s->usb, reply, size, deadline_ns, err);
}

struct status {
    int pixels, integration_us, trigger, speed;
};

static bool query_status(struct spectrometer *s, int64_t deadline_ns, struct status *out,
                         struct error *err)
{
    uint8_t r[STATUS_BYTES];
    if (!query(s, (const uint8_t[]){COMMAND_STATUS}, 1, r, sizeof r, deadline_ns, err))
        return while_doing(err, "asking for the status");
    uint32_t us = r[2] | (uint32_t)r[3] << 8 | (uint32_t)r[4] << 16 | (uint32_t)r[5] << 24;
    *out = (struct status){r[0] | r[1] << 8, us > INT32_MAX ? INT32_MAX : (int)us, r[7], r[14]};
    const struct ocean_model *m = ocean_usb_model(s->usb);
    if (out->pixels != m->raw_pixels && out->pixels != m->pixels)
        return fail(err, ERROR_DATA, "status tells %d pixels instead of %d", out->pixels,
                    m->raw_pixels);
    if (out->speed != SPEED_FULL && out->speed != SPEED_HIGH)
        return fail(err, ERROR_DATA, "status tells USB speed %02x", (unsigned)out->speed);
    return true;
}

// Whether a unit whose command counts milliseconds tells them or microseconds,
// no source says; what is too short for it must be the former.
static int status_us(const struct ocean_model *m, int told)
{
    return told < m->least_us && told <= INT32_MAX / m->base_us ? told * m->base_us : told;
}

// The unit ignores a value it does not like without a word: read it back.
static bool set_integration(struct spectrometer *s, int us, int64_t deadline_ns, struct error *err)
{
    const struct ocean_model *m = ocean_usb_model(s->usb);
    const int slack = us > 655000 || m->base_us > 1 ? 1000 : 10;
    uint8_t command[5];
    struct status status = {0};
    ocean_integration_command(m, us, command);
    s->stale = STALE_READINGS;
    if (s->slowest_us < s->integration_us)
        s->slowest_us = s->integration_us;
    if (!ocean_usb_send(s->usb, command, sizeof command, deadline_ns, err) ||
        !query_status(s, deadline_ns, &status, err))
        return while_doing(err, "setting the integration time");
    int told = status_us(m, status.integration_us);
    if (abs(told - us) > slack)
        return fail(err, ERROR_RETRY, "integration time is %d us after setting %d us", told, us);
    s->integration_us = us;
    return true;
}

static bool set_trigger_normal(struct spectrometer *s, int64_t deadline_ns, struct error *err)
{
    struct status status;
    if (!ocean_usb_send(s->usb, (const uint8_t[]){COMMAND_TRIGGER, 0, 0}, 3, deadline_ns, err) ||
        !query_status(s, deadline_ns, &status, err))
        return while_doing(err, "setting the trigger mode");
    return status.trigger == 0 ||
           fail(err, ERROR_DATA, "trigger mode is %d after setting 0", status.trigger);
}

static bool read_unit(struct spectrometer *s, int64_t deadline_ns, struct error *err)
{
    uint8_t slots[OCEAN_SLOTS][OCEAN_SLOT_BYTES];
    for (int i = 0; i < OCEAN_SLOTS; i++)
        if (!query(s, (const uint8_t[]){COMMAND_SLOT, (uint8_t)i}, 2, slots[i], OCEAN_SLOT_BYTES,
                   deadline_ns, err))
            return while_doing(err, "reading information slot %d", i);
    return ocean_unit_parse(ocean_usb_model(s->usb), slots, &s->unit, err);
}

// Only a label hangs on it, so a unit that does not tell is opened all the same.
static bool read_firmware(struct spectrometer *s, int64_t deadline_ns, struct error *err)
{
    uint8_t r[3];
    snprintf(s->firmware, sizeof s->firmware, "unknown");
    if (!query(s, (const uint8_t[]){COMMAND_READ_FPGA, FPGA_VERSION}, 2, r, sizeof r, deadline_ns,
               err))
        return (err->code != ERROR_GONE && ocean_usb_drain(s->usb, deadline_ns, err)) ||
               while_doing(err, "reading the FPGA version");
    if (r[0] != FPGA_VERSION && r[0] != FPGA_ECHO_FLAME)
        return true;
    int version = r[1] | r[2] << 8;
    s->flame = version >> 12 >= 3;
    snprintf(s->firmware, sizeof s->firmware, "%d.%02d.%d", version >> 12, version >> 4 & 255,
             version & 15);
    return true;
}

static bool wake(struct spectrometer *s, int64_t deadline_ns, struct error *err)
{
    struct status status;
    if (!ocean_usb_drain(s->usb, deadline_ns, err) ||
        !ocean_usb_send(s->usb, (const uint8_t[]){COMMAND_INITIALISE}, 1, deadline_ns, err) ||
        !query_status(s, deadline_ns, &status, err))
        return while_doing(err, "waking the spectrometer");
    s->slowest_us = status_us(ocean_usb_model(s->usb), status.integration_us);
    s->high_speed = status.speed == SPEED_HIGH;
    s->active_ns = clock_now_ns();
    return read_unit(s, deadline_ns, err);
}

static bool wanted(const struct spectrometer *s)
{
    return !*s->options.serial || !strcmp(s->options.serial, s->unit.serial);
}

// Opens unit after unit until the serial number is the wanted one.
static bool find_unit(struct spectrometer *s, int64_t deadline_ns, struct error *err)
{
    struct error skipped = {0};
    for (int index = 0;; index++) {
        struct error why = {0};
        s->usb = ocean_usb_open(index, &why);
        if (s->usb && wake(s, deadline_ns, &why) && wanted(s))
            return true;
        bool over = !s->usb && why.code == ERROR_GONE;
        ocean_usb_close(s->usb);
        s->usb = NULL;
        if (why.code != ERROR_NONE && !(over && index > 0))
            skipped = why;
        if (over)
            break;
    }
    if (skipped.code != ERROR_NONE)
        return fail(err, skipped.code, "%s", skipped.text);
    return fail(err, ERROR_GONE, "no spectrometer with serial number %s", s->options.serial);
}

static bool load_calibration(struct spectrometer *s, struct error *err)
{
    struct table table = {0};
    if (!*s->options.calibration)
        return fail(err, ERROR_CONFIG,
                    "calibration: the spectrometer needs a file of uJ per count, none is given");
    bool ok = csv_load(s->options.calibration, &table, err) &&
              ocean_axis_make(&s->unit, &table, s->options.collector_mm2, &s->axis, err);
    table_fini(&table);
    return ok;
}

static bool load_darks(struct spectrometer *s, struct error *err)
{
    struct table table = {0};
    if (!*s->options.darks)
        return true;
    bool ok = csv_load(s->options.darks, &table, err) &&
              ocean_darks_make(&s->unit, &table, &s->darks, err);
    table_fini(&table);
    return ok;
}

static bool set_wavelengths(struct spectrometer *s, struct error *err)
{
    const double *c = s->options.wavelength_nm;
    if (c[0] == 0 && c[1] == 0 && c[2] == 0 && c[3] == 0)
        return true;
    return ocean_unit_rewave(&s->unit, c) ||
           fail(err, ERROR_CONFIG,
                "wavelength_nm: %g %g %g %g do not ascend through the visible on %s", c[0], c[1],
                c[2], c[3], s->unit.serial);
}

static struct exposure_limits limits_of(const struct spectrometer *s, int longest_us)
{
    const struct ocean_model *m = s->unit.model;
    longest_us = longest_us > m->most_us ? m->most_us : longest_us;
    return (struct exposure_limits){s->options.mains_hz, m->least_us,
                                    longest_us < m->least_us ? m->least_us : longest_us,
                                    m->base_us};
}

static bool set_up(struct spectrometer *s, int64_t deadline_ns, struct error *err)
{
    struct exposure_limits limits = limits_of(s, s->options.longest_us);
    return set_wavelengths(s, err) && load_calibration(s, err) && load_darks(s, err) &&
           read_firmware(s, deadline_ns, err) && set_trigger_normal(s, deadline_ns, err) &&
           set_integration(s, exposure_round(s->options.integration_us, &limits), deadline_ns, err);
}

static void ocean_close(struct spectrometer *s)
{
    if (!s)
        return;
    ocean_usb_close(s->usb);
    ocean_darks_fini(&s->darks);
    free(s);
}

static struct spectrometer *ocean_open(const struct spectrometer_options *options,
                                       int64_t deadline_ns, struct error *err)
{
    struct error own;
    err = err ? err : &own;
    struct spectrometer *s = calloc(1, sizeof *s);
    if (!s) {
        fail_errno(err, "opening the spectrometer");
        return NULL;
    }
    s->options = *options;
    if (find_unit(s, deadline_ns, err) && set_up(s, deadline_ns, err))
        return s;
    ocean_close(s);
    return NULL;
}

static int64_t cycle_us(const struct spectrometer *s, int exposure_us)
{
    int64_t us = (int64_t)exposure_us + READOUT_US, least = s->unit.model->least_cycle_us;
    return us > least ? us : least;
}

static int64_t time_for(const struct spectrometer *s, int readings)
{
    int64_t us = s->slowest_us > s->integration_us ? s->slowest_us : s->integration_us;
    return (readings * cycle_us(s, (int)us) + us + MARGIN_US) * NS_PER_US;
}

static bool fits(const struct spectrometer *s, int readings, int64_t deadline_ns)
{
    return clock_now_ns() + time_for(s, readings) <= deadline_ns;
}

// Whatever went wrong, the next reading begins with a clean pipe.
static bool lost(struct spectrometer *s, struct error *err)
{
    s->adrift = true;
    s->stale = STALE_READINGS;
    if (err->code == ERROR_DATA)
        err->code = ERROR_RETRY;
    if (++s->failures < MOST_FAILURES || err->code == ERROR_GONE)
        return false;
    err->code = ERROR_GONE;
    return while_doing(err, "%d readings failed in a row", s->failures);
}

// Whether the acquisitions that the unit makes on its own are over for sure.
static bool is_idle(const struct spectrometer *s)
{
    int64_t over_us = (1 + STALE_READINGS) * cycle_us(s, s->slowest_us) + MARGIN_US;
    return s->unit.model->least_cycle_us == 0 &&
           clock_now_ns() - s->active_ns > over_us * NS_PER_US;
}

static bool acquire_once(struct spectrometer *s, int64_t deadline_ns,
                         uint16_t raw[OCEAN_PIXELS_MOST], struct interval *taken, struct error *err)
{
    uint8_t bytes[OCEAN_BYTES_MOST + 1];
    size_t count;
    int64_t cycle_ns = cycle_us(s, s->slowest_us) * NS_PER_US;
    int64_t request_ns = clock_now_ns();
    bool idle = is_idle(s);
    int timeout = deadline_ms(deadline_ns, 3 * s->slowest_us / 1000 + 1000);
    if (!ocean_usb_send(s->usb, (const uint8_t[]){COMMAND_SPECTRUM}, 1, deadline_ns, err) ||
        !ocean_usb_spectrum(s->usb, s->high_speed, bytes, sizeof bytes, timeout, &count, err) ||
        !ocean_unpack(s->unit.model, bytes, count, raw, err))
        return false;
    s->active_ns = clock_now_ns();
    *taken = (struct interval){idle ? request_ns : request_ns - cycle_ns, s->active_ns};
    return true;
}

// One spectrum that began after the last change of exposure.
static bool acquire(struct spectrometer *s, int64_t deadline_ns, uint16_t raw[OCEAN_PIXELS_MOST],
                    struct interval *taken, struct error *err)
{
    if (s->slowest_us < s->integration_us || is_idle(s))
        s->slowest_us = s->integration_us;
    if (!fits(s, s->stale + 1, deadline_ns))
        return fail(err, ERROR_RETRY, "exposures of %d us do not fit into the time given",
                    s->slowest_us);
    if (s->adrift && !ocean_usb_drain(s->usb, deadline_ns, err))
        return lost(s, err);
    s->adrift = false;
    for (; s->stale > 0; s->stale--)
        if (!acquire_once(s, deadline_ns, raw, taken, err))
            return lost(s, err);
    s->slowest_us = s->integration_us;
    if (!acquire_once(s, deadline_ns, raw, taken, err))
        return lost(s, err);
    s->failures = 0;
    return true;
}

// One failed reading is repeated.
static bool acquire_twice(struct spectrometer *s, int64_t deadline_ns,
                          uint16_t raw[OCEAN_PIXELS_MOST], struct interval *taken,
                          struct error *err)
{
    return acquire(s, deadline_ns, raw, taken, err) ||
           (err->code == ERROR_RETRY && fits(s, s->stale + 1, deadline_ns) &&
            acquire(s, deadline_ns, raw, taken, err));
}

static bool add_reading(struct spectrometer *s, int64_t deadline_ns, struct ocean_reading *reading,
                        struct interval *taken, struct error *err)
{
    uint16_t raw[OCEAN_PIXELS_MOST];
    struct interval one;
    if (!acquire_twice(s, deadline_ns, raw, &one, err))
        return false;
    if (reading->averaged == 0)
        *taken = one;
    taken->latest_ns = one.latest_ns;
    ocean_reading_add(&s->unit, s->axis.used, raw, reading);
    return true;
}

static void fill(const struct spectrometer *s, const struct ocean_reading *reading,
                 struct interval taken, enum spectrometer_status status,
                 struct spectrum_sample *out)
{
    out->taken = taken;
    out->status = status;
    out->integration_us = reading->integration_us;
    out->averaged = reading->averaged;
    out->peak = reading->peak;
    struct ocean_dark dark;
    bool known = ocean_dark_at(&s->darks, &s->unit, reading->integration_us, &dark);
    out->dark_missing = *s->options.darks && !known; // the black pixels alone served
    const struct ocean_process process = {(enum bend)s->options.nonlinearity, s->options.boxcar,
                                          known ? &dark : NULL};
    ocean_irradiance(&s->unit, &s->axis, &process, reading, &out->irradiance, &out->sigma, NULL);
}

static int next_exposure(struct spectrometer *s, const struct ocean_reading *reading,
                         int longest_us)
{
    const struct exposure_limits limits = limits_of(s, longest_us);
    const struct exposure_seen seen = {s->integration_us, reading->peak,
                                       ocean_black(&s->unit, reading) / s->unit.saturation,
                                       reading->saturated};
    return exposure_next(&s->exposure, &seen, &limits);
}

static enum spectrometer_status judge(const struct spectrometer *s,
                                      const struct ocean_reading *reading, bool settling)
{
    if (reading->saturated)
        return SPECTROMETER_SATURATED;
    if (settling)
        return SPECTROMETER_SETTLING;
    return ocean_signal(&s->unit, s->axis.used, reading) < weak_counts ? SPECTROMETER_WEAK
                                                                       : SPECTROMETER_GOOD;
}

static bool take_back(struct spectrometer *s, int64_t deadline_ns, struct error *err)
{
    if (s->lent_us && s->lent_us != s->integration_us &&
        !set_integration(s, s->lent_us, deadline_ns, err))
        return lost(s, err);
    s->lent_us = 0;
    return true;
}

static bool ocean_counts(struct spectrometer *s, int integration_us, int64_t deadline_ns,
                         struct spectrum_counts *out, struct error *err)
{
    struct error own;
    err = err ? err : &own;
    const struct exposure_limits limits = limits_of(s, s->unit.model->most_us);
    int read_us = s->lent_us ? s->lent_us : s->integration_us;
    int us = integration_us ? exposure_hold(integration_us, &limits) : read_us;
    uint16_t raw[OCEAN_PIXELS_MOST];
    struct interval taken;
    s->lent_us = read_us;
    if (us != s->integration_us && !set_integration(s, us, deadline_ns, err))
        return lost(s, err);
    if (!acquire_twice(s, deadline_ns, raw, &taken, err))
        return false;
    *out = (struct spectrum_counts){taken, us, ocean_detector(&s->unit), {0}};
    memcpy(out->raw, raw, sizeof *raw * (size_t)s->unit.model->pixels);
    return true;
}

static bool ocean_read(struct spectrometer *s, int64_t deadline_ns, struct spectrum_sample *out,
                       struct error *err)
{
    struct error own;
    err = err ? err : &own;
    if (!take_back(s, deadline_ns, err))
        return false;
    int64_t fair_us = (deadline_ns - clock_now_ns()) / NS_PER_US / (2 + STALE_READINGS);
    const struct exposure_limits limits = limits_of(s, s->options.longest_us);
    int longest = exposure_round((double)fair_us - MARGIN_US, &limits);
    if (s->integration_us > longest && !fits(s, s->stale + 1, deadline_ns) &&
        !set_integration(s, longest, deadline_ns, err))
        return lost(s, err);
    for (;;) {
        struct ocean_reading reading = {.integration_us = s->integration_us};
        struct interval taken = {0};
        if (!add_reading(s, deadline_ns, &reading, &taken, err))
            return false;
        int next = next_exposure(s, &reading, longest);
        bool settling = next != s->integration_us;
        while (!settling && !reading.saturated && reading.averaged < s->options.average &&
               fits(s, 1, deadline_ns))
            if (!add_reading(s, deadline_ns, &reading, &taken, err))
                return false;
        if (settling && !set_integration(s, next, deadline_ns, err))
            return lost(s, err);
        if (settling && fits(s, 1 + STALE_READINGS, deadline_ns))
            continue;
        fill(s, &reading, taken, judge(s, &reading, settling), out);
        return true;
    }
}

static void ocean_identify(const struct spectrometer *s, struct instrument_identity *out)
{
    memset(out, 0, sizeof *out);
    const char *name = s->unit.model->name, * or = strstr(name, " or ");
    if (or)
        snprintf(out->model, sizeof out->model, "%.*s", s->flame ? 63 : (int)(or -name),
                 s->flame ? or +4 : name);
    else
        snprintf(out->model, sizeof out->model, "%s", name);
    snprintf(out->serial, sizeof out->serial, "%s", s->unit.serial);
    snprintf(out->firmware, sizeof out->firmware, "FPGA %s%s", s->firmware,
             s->unit.order < 0 ? ", non-linearity not corrected" : "");
    out->emulated = !strncmp(s->unit.serial, "EMU", 3);
}

const struct spectrometer_driver ocean_driver = {"ocean",        ocean_open,  ocean_read,
                                                 ocean_identify, ocean_close, ocean_counts};
