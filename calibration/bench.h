// SPDX-License-Identifier: Apache-2.0
// The technician's bench: boothd for showing and reading, and whoever turns
// the knobs of the booth: the emulated booth, or a person who is asked.
#ifndef CALIBRATION_BENCH_H
#define CALIBRATION_BENCH_H

#include "base/control.h"
#include "base/linear.h"
#include "colorimetry/colour.h"
#include "colorimetry/display.h"
#include "config/booth.h"

struct raw_counts;

struct bench {
    struct control_client *daemon;
    struct control_client *booth; // NULL: a person turns the knobs
    json_t *readings;             // every reading is appended as it came
    bool terminal;                // progress is shown
    const char *step;             // of bench_progress, with its start: time and how far
    int64_t step_ns;
    int step_at;
    json_t *lit;                  // lamps that bench_lid switched off, or NULL
};

// Connects to the boothd that runs with these settings, and to the emulated
// booth whose control socket is booth (NULL: a person turns the knobs). socket:
// boothd's control socket; NULL takes the settings', else the user's. readings
// starts empty, terminal is whether standard error is one.
bool bench_open(struct bench *b, const struct booth_settings *settings, const char *socket,
                const char *booth, struct error *err);

// Accepts a zeroed bench.
void bench_close(struct bench *b);

// Whether anything here is emulated: the booth, or an instrument that was read.
bool bench_emulated(const struct bench *b);

// ---- boothd ----------------------------------------------------------------

// The daemon's status, a new reference; NULL on failure.
json_t *bench_status(struct bench *b, struct error *err);

// Shows uniform counts, undithered.
bool bench_patch(struct bench *b, struct counts counts, struct error *err);

// Shows a material, or one patch of it over the whole screen when patch is not NULL.
bool bench_show(struct bench *b, const char *material, const char *patch, struct error *err);

// One reading of the radiometer: cd/m2. what names it among the readings;
// *index (may be NULL) receives its number there. RETRY is tried three times.
bool bench_measure(struct bench *b, const char *what, struct xyz *xyz, int *index,
                   struct error *err);

// What a pixel of the material on show should be, by the double reference; see
// struct pixel of render/scene.h.
struct proofed_pixel {
    double lux;
    struct xyz surface, emitted, sent; // cd/m2
    struct counts counts, linear;
    double gains[4]; // of red, green, blue and black, towards the eye
    bool in_gamut;
};
bool bench_pixel(struct bench *b, int x_px, int y_px, struct proofed_pixel *out, struct error *err);

bool bench_capture(struct bench *b, const char *path, struct error *err);
bool bench_reload(struct bench *b, struct error *err);

// "model serial" of the instrument that a reading came from.
void bench_instrument(const json_t *reply, char *name, size_t size);

// A lamp as its spectrometer saw it.
struct taught {
    struct spectrum irradiance; // W m-2 nm-1
    struct spectrum sigma;      // its standard uncertainty, 0 where none is known
    double spread, lux;         // relative rms of the readings; illuminance
    char instrument[128];       // model and serial
};

// Average of `readings` fresh readings of the lamp now on.
bool bench_teach(struct bench *b, const char *lamp, int readings, struct taught *out,
                 struct error *err);

// Illuminance of the lamp now on from `readings` fresh readings; the spectrum is not kept.
bool bench_probe(struct bench *b, const char *lamp, int readings, double *lux, struct error *err);

// Waits until the daemon is sure of lamp ("" = dark), at most timeout_s.
bool bench_await_lamp(struct bench *b, const char *lamp, double timeout_s, struct error *err);

// Raw counts of the spectrometer: so many readings of one exposure, 0 us: the
// one it has come to.
bool bench_raw(struct bench *b, int integration_us, int readings, struct raw_counts *out,
               struct error *err);

// ---- the booth -------------------------------------------------------------

bool bench_lamp(struct bench *b, const char *lamp, struct error *err); // "none" = off

// Keeps all light from the spectrometer, and lets it in again. Opening waits
// for nobody.
bool bench_lid(struct bench *b, bool closed, struct error *err);

// Lights the spectrometer with a lamp for calibrating it. what is how a person
// is asked for it; lamp is its name in an emulated booth.
bool bench_light(struct bench *b, const char *lamp, const char *what, struct error *err);
bool bench_tilt(struct bench *b, double deg, struct error *err);
bool bench_head(struct bench *b, struct vec3 eye, struct error *err);
bool bench_aim_screen(struct bench *b, double x_px, double y_px, struct error *err);
// The same from a place in the booth's frame: an instrument where the eye is.
bool bench_aim_screen_from(struct bench *b, double x_px, double y_px, struct vec3 from,
                           struct error *err);
bool bench_aim_ceiling(struct bench *b, double x_m, double z_m, struct error *err);

// Asks for the spectrometer at a place, such as "the far left of the booth's
// floor". Error CONFIG with an emulated booth, where it stands still.
bool bench_place_spectrometer(struct bench *b, const char *where, struct error *err);

// An exposure series of the ceiling as it is lit now: pictures, list.csv (see
// photos.h) and camera.ini (see still_camera.h) in a folder that is there.
bool bench_photograph(struct bench *b, const char *folder, struct error *err);

// Absolute XYZ (cd/m2) that physical samples of those reflectances would send
// from the aimed place. Emulated booth only.
bool bench_truth(struct bench *b, const struct spectrum *reflectances, int count, struct xyz *out,
                 struct error *err);

// Shows "step: done of all" on a terminal, and how long the rest will take at
// the pace of this step so far.
void bench_progress(struct bench *b, const char *step, int done, int all);

#endif
