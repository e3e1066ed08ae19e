// SPDX-License-Identifier: Apache-2.0
#include "drivers/replay.h"

#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "drivers/deadline.h"
#include "drivers/jaz.h"

enum { LEAST_MS = 50, MOST_MS = 1000 };

struct spectrometer {
    struct spectrometer_options options;
    struct vendor_file file;
    struct jaz_light light;
    struct timespec changed;
    off_t size;
};

static double factor(enum file_unit unit)
{
    switch (unit) {
    case FILE_UW_CM2:
        return 1e-2;
    case FILE_MW_M2:
        return 1e-3;
    case FILE_W_M2:
        return 1;
    }
    return 0;
}

bool replay_irradiance(const struct vendor_file *file, enum file_unit unit, struct spectrum *out,
                       struct error *err)
{
    struct spectrum s;
    if (!spectrum_from_samples(file->nm, file->values, file->count, false, &s, err))
        return while_doing(err, "%s", file->path);
    spectrum_scale(&s, factor(unit));
    *out = s;
    return true;
}

static bool look(const struct spectrometer *s, struct stat *out, struct error *err)
{
    return stat(s->options.file, out) == 0 ||
           fail(err, ERROR_GONE, "%s: the file is not there", s->options.file);
}

static bool by_calibration(const struct spectrometer_options *o, const struct vendor_file *file,
                           struct jaz_light *out, struct error *err)
{
    struct table table = {0};
    const struct jaz_worth worth = {.calibration = &table, .collector_mm2 = o->collector_mm2};
    bool fine =
        csv_load(o->calibration, &table, err) && jaz_irradiance(file, &worth, o->boxcar, out, err);
    table_fini(&table);
    return fine;
}

static bool by_reference(const struct spectrometer_options *o, const struct vendor_file *file,
                         struct jaz_light *out, struct error *err)
{
    struct vendor_file reference;
    if (!vendor_file_load(o->reference, &reference, err))
        return false;
    const struct jaz_worth worth = {.reference = &reference,
                                    .reference_scale = factor((enum file_unit)o->file_unit)};
    bool fine = jaz_irradiance(file, &worth, o->boxcar, out, err);
    vendor_file_fini(&reference);
    return fine;
}

static bool process(const struct spectrometer_options *o, const struct vendor_file *file,
                    struct jaz_light *out, struct error *err)
{
    bool counts = file->format == VENDOR_JAZ;
    *out = (struct jaz_light){.peak = 0};
    if (counts && *o->calibration)
        return by_calibration(o, file, out, err);
    if (counts && *o->reference)
        return by_reference(o, file, out, err);
    if (counts && jaz_is_ratio(file))
        return fail(err, ERROR_CONFIG,
                    "%s: its processed column is per cent of its reference, no irradiance: say "
                    "whose light that was (reference), or give the unit's calibration",
                    file->path);
    return replay_irradiance(file, (enum file_unit)o->file_unit, &out->irradiance, err);
}

// What no longer reads leaves the last good one in place.
static bool load(struct spectrometer *s, struct error *err)
{
    struct stat now;
    struct vendor_file file;
    struct jaz_light light;
    if (!look(s, &now, err) || !vendor_file_load(s->options.file, &file, err))
        return false;
    if (!process(&s->options, &file, &light, err)) {
        vendor_file_fini(&file);
        return false;
    }
    vendor_file_fini(&s->file);
    s->file = file;
    s->light = light;
    s->changed = now.st_mtim;
    s->size = now.st_size;
    return true;
}

static void replay_close(struct spectrometer *s)
{
    if (!s)
        return;
    vendor_file_fini(&s->file);
    free(s);
}

static bool wanted(const struct spectrometer *s, struct error *err)
{
    return !*s->options.serial || !strcmp(s->options.serial, s->file.serial) ||
           fail(err, ERROR_GONE, "%s is of spectrometer \"%s\", not %s", s->file.path,
                s->file.serial, s->options.serial);
}

static struct spectrometer *replay_open(const struct spectrometer_options *options,
                                        int64_t deadline_ns, struct error *err)
{
    (void)deadline_ns;
    if (!*options->file) {
        fail(err, ERROR_CONFIG, "file: the replay spectrometer needs one, none is given");
        return NULL;
    }
    struct spectrometer *s = calloc(1, sizeof *s);
    if (!s) {
        fail_errno(err, "opening %s", options->file);
        return NULL;
    }
    s->options = *options;
    if (load(s, err) && wanted(s, err))
        return s;
    replay_close(s);
    return NULL;
}

static int64_t lasted_ns(const struct vendor_file *file)
{
    int64_t readings = file->averaged > 0 ? file->averaged : 1;
    return readings * file->integration_us * NS_PER_US;
}

static bool is_new(const struct spectrometer *s, const struct stat *now)
{
    return now->st_mtim.tv_sec != s->changed.tv_sec || now->st_mtim.tv_nsec != s->changed.tv_nsec ||
           now->st_size != s->size;
}

// As slow as the measurement was, within bounds.
static bool replay_read(struct spectrometer *s, int64_t deadline_ns, struct spectrum_sample *out,
                        struct error *err)
{
    struct stat now;
    int64_t lasted_ms = lasted_ns(&s->file) / NS_PER_MS;
    int wait_ms = lasted_ms < LEAST_MS ? LEAST_MS : lasted_ms < MOST_MS ? (int)lasted_ms : MOST_MS;
    poll(NULL, 0, deadline_ms(deadline_ns, wait_ms));
    if (!look(s, &now, err))
        return false;
    if (is_new(s, &now) && !load(s, err)) {
        if (err && err->code == ERROR_DATA) // half written: it may be whole next time
            err->code = ERROR_RETRY;
        return false;
    }
    int64_t now_ns = clock_now_ns();
    memset(out, 0, sizeof *out);
    out->taken = (struct interval){now_ns - lasted_ns(&s->file), now_ns};
    out->status = s->light.saturated ? SPECTROMETER_SATURATED : SPECTROMETER_GOOD;
    out->integration_us = s->file.integration_us;
    out->averaged = s->file.averaged > 0 ? s->file.averaged : 1;
    out->peak = s->light.peak;
    out->irradiance = s->light.irradiance;
    out->sigma = s->light.sigma;
    return true;
}

static void replay_identify(const struct spectrometer *s, struct instrument_identity *out)
{
    memset(out, 0, sizeof *out);
    snprintf(out->model, sizeof out->model, "replay of a %s file",
             vendor_format_name(s->file.format));
    snprintf(out->serial, sizeof out->serial, "%s", s->file.serial);
    snprintf(out->firmware, sizeof out->firmware, "%.63s", s->file.date);
    out->emulated = true;
}

const struct spectrometer_driver replay_driver = {"replay",        replay_open,  replay_read,
                                                  replay_identify, replay_close, NULL};
