// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration/spectrometer.h"
#include "files/write.h"

enum { READINGS = 20, LONGEST_US = 2000000 };

static const double ASK_BELOW_NM = 380, ASK_ABOVE_NM = 780; // where eyes and lamps are
static const double UNSURE_NM = 0.3, POOR_RMS_NM = 0.2;     // a pixel is 0.3..0.4 nm wide

// Lines in use: mercury and argon, or those of a file; 0 at the end.
static bool take_lines(const char *path, double lines[REFIT_LINES_MOST + 1], struct error *err)
{
    struct table table = {0};
    if (!path) {
        int i = 0;
        for (; refit_mercury_argon[i] > 0; i++)
            lines[i] = refit_mercury_argon[i];
        lines[i] = 0;
        return true;
    }
    bool fine = csv_load(path, &table, err) &&
                ((table.rows >= REFIT_LINES_LEAST && table.rows <= REFIT_LINES_MOST) ||
                 fail(err, ERROR_DATA, "%s: %zu lines; allowed: %d..%d", path, table.rows,
                      REFIT_LINES_LEAST, REFIT_LINES_MOST));
    for (size_t i = 0; fine && i < table.rows; i++) {
        lines[i] = table_at(&table, i, 0);
        lines[i + 1] = 0;
        if (!(lines[i] > (i ? lines[i - 1] : 0)))
            fine = fail(err, ERROR_DATA, "%s:%d: %g nm does not ascend", path, table.lines[i],
                        lines[i]);
    }
    table_fini(&table);
    return fine;
}

static bool see(struct spectrometer_command *c, struct raw_counts *light, struct raw_counts *dark,
                struct error *err)
{
    int us = c->exposures[0], readings = c->readings ? c->readings : READINGS;
    struct error later = {0};
    if (!bench_light(&c->bench, c->lamp, "the mercury-argon lamp", err) ||
        (!us && !spectrometer_expose(c, LONGEST_US, &us, err)) ||
        !bench_raw(&c->bench, us, readings, light, err))
        return false;
    if (light->saturated)
        return fail(err, ERROR_DATA, "%d pixels are saturated at %d us: take a shorter --exposure",
                    light->saturated, us);
    bool fine = bench_lid(&c->bench, true, err) && bench_raw(&c->bench, us, readings, dark, err);
    return bench_lid(&c->bench, false, fine ? err : &later) && fine;
}

static bool take_spectrum(struct spectrometer_command *c, struct raw_spectrum *out,
                          struct error *err)
{
    if (c->counts)
        return raw_spectrum_load(c->counts, out, err);
    if (c->bench.booth && !c->lamp)
        return fail(err, ERROR_CONFIG, "--lamp names the line lamp of an emulated booth");
    struct raw_counts *r = calloc(2, sizeof *r);
    bool fine = (r || fail(err, ERROR_SYSTEM, "no memory for counts")) && see(c, r, r + 1, err);
    if (fine)
        raw_spectrum_of(r, r + 1, out);
    free(r);
    return fine;
}

// The setting's own text, which reads back to the same numbers.
static void setting_text(const struct refit *r, char *text, size_t size)
{
    struct spectrometer_options options;
    memset(&options, 0, sizeof options);
    memcpy(options.wavelength_nm, r->wavelength, sizeof options.wavelength_nm);
    settings_get(settings_find(spectrometer_settings, "wavelength_nm"), &options, text, size);
}

static double pixel_at(const struct refit *r, double nm)
{
    int low = 0;
    while (low + 1 < r->pixels && refit_nm(r->wavelength, low + 1) < nm)
        low++;
    return low;
}

static void doubt(const struct refit *r, char warning[WARNING_SIZE])
{
    double low = refit_sigma(r, pixel_at(r, ASK_BELOW_NM));
    double high = refit_sigma(r, pixel_at(r, ASK_ABOVE_NM));
    if (r->rms_nm > POOR_RMS_NM)
        snprintf(warning, WARNING_SIZE,
                 "lines are left %.2f nm off (rms): are they those of this lamp?", r->rms_nm);
    else if (fmax(low, high) > UNSURE_NM)
        snprintf(warning, WARNING_SIZE,
                 "the lines lie badly: the axis is uncertain by %.2f nm at %g nm", fmax(low, high),
                 low > high ? ASK_BELOW_NM : ASK_ABOVE_NM);
}

static void print_text(const struct raw_spectrum *s, const struct refit *r, const char *setting)
{
    printf("%s: %d lines\n%10s %9s %10s %8s\n", s->source, r->lines, "nm", "pixel", "was off",
           "left off");
    for (int i = 0; i < r->lines; i++) {
        const struct refit_line *l = &r->line[i];
        printf("%10.3f %9.3f %+10.3f %+8.3f\n", l->nm, l->pixel, l->was_nm - l->nm, l->left_nm);
    }
    printf("rms %.3f nm; standard uncertainty %.3f nm at %g, %.3f at 550, %.3f at %g nm\n"
           "\nFor boothd's settings; they count from its next start on:\n[spectrometer]\n"
           "wavelength_nm = %s\n",
           r->rms_nm, refit_sigma(r, pixel_at(r, ASK_BELOW_NM)), ASK_BELOW_NM,
           refit_sigma(r, pixel_at(r, 550)), refit_sigma(r, pixel_at(r, ASK_ABOVE_NM)),
           ASK_ABOVE_NM, setting);
}

static void print_json(const struct raw_spectrum *s, const struct refit *r, const char *setting,
                       const char *warning)
{
    json_t *lines = json_array();
    for (int i = 0; i < r->lines; i++) {
        const struct refit_line *l = &r->line[i];
        json_array_append_new(lines,
                              json_pack("{s:f, s:f, s:f, s:f}", "nm", l->nm, "pixel", l->pixel,
                                        "was_nm", l->was_nm, "left_nm", l->left_nm));
    }
    json_t *all = json_pack(
        "{s:s, s:[f,f,f,f], s:s, s:f, s:o, s:[{s:f,s:f},{s:f,s:f},{s:f,s:f}], "
        "s:s}",
        "source", s->source, "wavelength_nm", r->wavelength[0], r->wavelength[1], r->wavelength[2],
        r->wavelength[3], "setting", setting, "rms_nm", r->rms_nm, "lines", lines, "uncertainty",
        "nm", ASK_BELOW_NM, "sigma_nm", refit_sigma(r, pixel_at(r, ASK_BELOW_NM)), "nm", 550.0,
        "sigma_nm", refit_sigma(r, pixel_at(r, 550)), "nm", ASK_ABOVE_NM, "sigma_nm",
        refit_sigma(r, pixel_at(r, ASK_ABOVE_NM)), "warning", warning);
    json_dumpf(all, stdout, JSON_INDENT(2));
    putchar('\n');
    json_decref(all);
}

static bool save(const char *path, const struct raw_spectrum *s, const struct refit *r,
                 const char *setting, struct error *err)
{
    struct whole_file file;
    if (!whole_file_begin(&file, path, err))
        return false;
    fprintf(file.stream,
            "# wavelengths of %s: %d lines, rms %.3f nm\n[spectrometer]\nwavelength_nm = %s\n",
            s->source, r->lines, r->rms_nm, setting);
    return whole_file_commit(&file, err);
}

bool spectrometer_wavelength(struct spectrometer_command *c, char *warning, struct error *err)
{
    double lines[REFIT_LINES_MOST + 1];
    char setting[256];
    struct refit r;
    struct raw_spectrum *s = calloc(1, sizeof *s);
    bool fine = (s || fail(err, ERROR_SYSTEM, "no memory for counts")) &&
                take_lines(c->lines, lines, err) && take_spectrum(c, s, err) &&
                (refit_wavelengths(s->counts, s->pixels, s->wavelength, lines, &r, err) ||
                 while_doing(err, "%s", s->source));
    if (fine) {
        setting_text(&r, setting, sizeof setting);
        doubt(&r, warning);
        fine = !c->out || save(c->out, s, &r, setting, err);
    }
    if (fine && c->json)
        print_json(s, &r, setting, warning);
    else if (fine)
        print_text(s, &r, setting);
    free(s);
    return fine;
}
