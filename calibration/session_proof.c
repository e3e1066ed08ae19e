// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "calibration/bench_pose.h"
#include "calibration/proof.h"
#include "calibration/session.h"
#include "config/bands_file.h"
#include "config/materials.h"

enum { SETTLE_ATTEMPTS = 60, LOOKS = 5, REPEATS = 5 };
static const double SUSPECT_DE00 = 2; // a good display model is never so far off
static const double STILL_DEG = 0.1, STILL_M = 0.015; // twice what noise moves them between looks
static const double ASKED_DEG = 3; // a person sets no tilt better
static const double POSE_TILTS_DEG[] = {20, 45, 60};
static const double AXIS_DEG[] = {0, 15, 25}, AXIS_TILT_DEG = 60, AXIS_DISTANCE_M = 0.7;
static const struct vec3 POSE_EYES[] = {{-0.10, 0.55, 0.60}, {0.12, 0.50, 0.70}};

// What a sample would send by the taught spectrum at that illuminance.
static struct xyz expected(const struct lamp_report *lamp, const struct spectrum *reflectance,
                           double lux)
{
    struct xyz c = xyz_relative(&lamp->irradiance, reflectance, OBSERVER_1931_2);
    double k = lux / 100 / acos(-1);
    return (struct xyz){k * c.X, k * c.Y, k * c.Z};
}

static bool probe(struct session *s, struct proofed_pixel *out, struct error *err)
{
    return bench_pixel(&s->bench, s->settings.screen.width_px / 2,
                       s->settings.screen.height_px / 2, out, err);
}

// The emulated booth knows; elsewhere it is what is expected.
static bool reference(struct session *s, const struct spectrum *reflectance, struct xyz expectation,
                      struct xyz *out, struct error *err)
{
    *out = expectation;
    return !s->bench.booth || bench_truth(&s->bench, reflectance, 1, out, err);
}

static bool simulate(struct lamp_report *lamp, const struct material *chart, const char *bands,
                     struct error *err)
{
    struct band_set set;
    struct band_matrix matrix;
    if (!bands_named(bands, &set, err) ||
        !band_matrix_adapted(&set, &lamp->irradiance, OBSERVER_1931_2, &matrix, err))
        return false;
    lamp->white_taught = xyz_relative(&lamp->irradiance, NULL, OBSERVER_1931_2);
    for (int i = 0; i < lamp->patch_count; i++) {
        struct bands c = bands_of(&set, &chart->palette[i]);
        lamp->patches[i].full = xyz_relative(&lamp->irradiance, &chart->palette[i], OBSERVER_1931_2);
        lamp->patches[i].bands = band_xyz(&matrix, &c);
    }
    return true;
}

static int lightest(const struct lamp_report *lamp)
{
    int best = 0;
    for (int i = 1; i < lamp->patch_count; i++)
        if (lamp->patches[i].full.Y > lamp->patches[best].full.Y)
            best = i;
    return best;
}

static int by_luminance(const void *a, const void *b)
{
    double x = ((const struct xyz *)a)->Y, y = ((const struct xyz *)b)->Y;
    return (x > y) - (x < y);
}

// A reading so far from what the models say is taken twice more, and the middle
// one counts: instruments misread.
static bool measure_patch(struct session *s, const char *what, const struct lamp_report *lamp,
                          struct patch_report *p, struct error *err)
{
    struct xyz read[3];
    struct lab a, b;
    if (!bench_measure(&s->bench, what, &read[0], &p->reading, err))
        return false;
    p->measured = read[0];
    if (!lab_of(read[0], lamp->white_reference, &a, err) ||
        !lab_of(p->predicted, lamp->white_reference, &b, err))
        return false;
    if (delta_e_2000(a, b) < SUSPECT_DE00)
        return true;
    for (int i = 1; i < 3; i++)
        if (!bench_measure(&s->bench, what, &read[i], NULL, err))
            return false;
    qsort(read, 3, sizeof *read, by_luminance);
    p->measured = read[1];
    return true;
}

// Reference and reading of a patch are taken together, since lamps drift.
static bool measure_patches(struct session *s, struct lamp_report *lamp,
                            const struct material *chart, struct error *err)
{
    struct bench *b = &s->bench;
    for (int i = 0; i < lamp->patch_count; i++) {
        struct patch_report *p = &lamp->patches[i];
        struct proofed_pixel pixel;
        char what[160];
        snprintf(what, sizeof what, "%s under %s", p->name, lamp->name);
        if (!bench_show(b, s->material, p->name, err) || !probe(s, &pixel, err))
            return false;
        p->in_gamut = pixel.in_gamut;
        p->aimed = pixel.surface;
        p->predicted = pixel.sent;
        p->counts = pixel.counts;
        p->expected = expected(lamp, &chart->palette[i], pixel.lux);
        if (!reference(s, &chart->palette[i], p->expected, &p->reference, err) ||
            !measure_patch(s, what, lamp, p, err))
            return false;
        bench_progress(b, lamp->name, i + 1, lamp->patch_count);
    }
    return true;
}

// repeats: all readings of it, count <= REPEATS; the middle one is *measured.
static bool measure_white(struct session *s, const struct lamp_report *lamp, struct xyz *repeats,
                          int count, struct xyz *reference_white, struct xyz *measured,
                          struct error *err)
{
    struct spectrum diffuser;
    struct proofed_pixel pixel;
    struct xyz sorted[REPEATS];
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        diffuser.v[i] = 1;
    if (!bench_show(&s->bench, "white", NULL, err) || !probe(s, &pixel, err) ||
        !reference(s, &diffuser, expected(lamp, &diffuser, pixel.lux), reference_white, err))
        return false;
    for (int i = 0; i < count; i++)
        if (!bench_measure(&s->bench, "perfect diffuser", &repeats[i], NULL, err))
            return false;
    memcpy(sorted, repeats, (size_t)count * sizeof *sorted);
    qsort(sorted, (size_t)count, sizeof *sorted, by_luminance);
    *measured = sorted[count / 2];
    return true;
}

static void take_repeats(const struct xyz *read, int count, struct lamp_report *lamp)
{
    double level[REPEATS], red[REPEATS], blue[REPEATS];
    for (int i = 0; i < count; i++) {
        level[i] = read[i].Y;
        red[i] = read[i].X / read[i].Y;
        blue[i] = read[i].Z / read[i].Y;
    }
    struct summary y = summarise(level, count), r = summarise(red, count),
                   b = summarise(blue, count);
    lamp->repeats = count;
    lamp->repeat_level = y.std / y.mean;
    lamp->repeat_colour = hypot(r.std / r.mean, b.std / b.mean) / sqrt(2);
}

static bool measure_whites(struct session *s, struct lamp_report *lamp, struct error *err)
{
    struct xyz read[REPEATS];
    struct proofed_pixel pixel;
    if (!measure_white(s, lamp, read, REPEATS, &lamp->white_reference, &lamp->white_measured,
                       err) ||
        !probe(s, &pixel, err))
        return false;
    lamp->proof_lux = pixel.lux;
    memcpy(lamp->gains, pixel.gains, sizeof lamp->gains);
    take_repeats(read, REPEATS, lamp);
    return bench_patch(&s->bench, (struct counts){0, 0, 0}, err) &&
           bench_measure(&s->bench, "black", &lamp->black_shown, NULL, err);
}

static bool measure_drift(struct session *s, struct lamp_report *lamp, struct error *err)
{
    struct xyz read, reference_white, measured;
    if (!measure_white(s, lamp, &read, 1, &reference_white, &measured, err))
        return false;
    double before = lamp->white_measured.Y / lamp->white_reference.Y;
    lamp->chart_drift_percent = 100 * (measured.Y / reference_white.Y / before - 1);
    return true;
}

static bool take_names(struct lamp_report *lamp, const struct material *chart, struct error *err)
{
    for (int i = 0; i < chart->palette_count && i < FACTS_PATCHES; i++)
        if (strcmp(chart->palette_names[i], "background"))
            snprintf(lamp->patches[lamp->patch_count++].name, sizeof lamp->patches->name, "%s",
                     chart->palette_names[i]);
    if (!lamp->patch_count || chart->palette_count > FACTS_PATCHES)
        return fail(err, ERROR_CONFIG, "%s: a chart of 1..%d patches with spectra is needed",
                    chart->name, FACTS_PATCHES);
    return true;
}

static bool picture(struct session *s, struct lamp_report *lamp, struct error *err)
{
    char path[sizeof lamp->picture];
    if (!*s->out)
        return true;
    snprintf(path, sizeof path, "%s/chart-%s.png", s->out, lamp->name);
    memcpy(lamp->picture, path, sizeof path);
    return bench_show(&s->bench, s->material, NULL, err) &&
           bench_capture(&s->bench, lamp->picture, err);
}

static bool proof_chart(struct session *s, struct lamp_report *lamp, const struct material *chart,
                        struct error *err)
{
    if (!take_names(lamp, chart, err) || !simulate(lamp, chart, s->settings.quality.bands, err))
        return false;
    lamp->white_patch = lightest(lamp);
    return measure_whites(s, lamp, err) && measure_patches(s, lamp, chart, err) &&
           measure_drift(s, lamp, err) && picture(s, lamp, err) && proof_judge(lamp, err);
}

bool session_chart(struct session *s, int index, struct error *err)
{
    struct material chart = {0};
    if (!session_aim(s, session_eye(s), err) ||
        !material_load(&s->settings, s->material, &chart, err))
        return false;
    bool fine = session_place(s, &chart, err) &&
                proof_chart(s, &s->facts->lamps[index], &chart, err);
    material_fini(&chart);
    return fine;
}

bool session_proof(struct session *s, int index, struct error *err)
{
    const struct lamp_report *lamp = &s->facts->lamps[index];
    return (bench_lamp(&s->bench, lamp->name, err) &&
            bench_await_lamp(&s->bench, lamp->name, 30, err) && session_chart(s, index, err)) ||
           while_doing(err, "lamp %s", lamp->name);
}

// One look at the daemon's belief: tilt, and the eye added to *eyes.
static bool seen(struct session *s, struct pose_report *pose, struct vec3 *eyes, struct error *err)
{
    json_t *status = bench_status(&s->bench, err);
    if (!status)
        return false;
    const json_t *eye = json_object_get(json_object_get(status, "eye"), "eye_m");
    pose->tilt_seen_deg =
        json_number_value(json_object_get(json_object_get(status, "tilt"), "tilt_deg"));
    *eyes = vec3_add(*eyes, (struct vec3){json_number_value(json_array_get(eye, 0)),
                                          json_number_value(json_array_get(eye, 1)),
                                          json_number_value(json_array_get(eye, 2))});
    json_decref(status);
    return true;
}

static bool settle(struct session *s, struct pose_report *pose, struct error *err)
{
    for (int attempt = 0; attempt < SETTLE_ATTEMPTS; attempt++) {
        struct vec3 eyes = {0};
        double least = INFINITY, most = -INFINITY;
        for (int i = 0; i < LOOKS; i++) {
            clock_sleep_until_ns(clock_now_ns() + 100 * NS_PER_MS);
            if (!seen(s, pose, &eyes, err))
                return false;
            least = fmin(least, pose->tilt_seen_deg);
            most = fmax(most, pose->tilt_seen_deg);
        }
        struct vec3 before = pose->eye_seen;
        pose->eye_seen = vec3_scale(eyes, 1.0 / LOOKS);
        if (attempt && most - least < STILL_DEG && fabs(most - pose->tilt_deg) < ASKED_DEG &&
            vec3_length(vec3_sub(before, pose->eye_seen)) < STILL_M)
            return true;
    }
    return fail(err, ERROR_RETRY,
                "tilt or head did not settle: %.1f degrees are asked for, %.1f seen", pose->tilt_deg,
                pose->tilt_seen_deg);
}

static bool white_again(struct session *s, struct pose_report *pose, struct error *err)
{
    const struct lamp_report *lamp = &s->facts->lamps[s->facts->lamp_count - 1];
    struct xyz read;
    pose->moved_screen = true;
    if (!settle(s, pose, err) || !session_aim(s, pose->eye, err) ||
        !measure_white(s, lamp, &read, 1, &pose->reference, &pose->measured, err))
        return false;
    if (!(pose->reference.Y > 0))
        return fail(err, ERROR_DATA, "tilt %.0f: the reference is dark", pose->tilt_deg);
    pose->error_percent = 100 * (pose->measured.Y / pose->reference.Y - 1);
    return true;
}

static bool tilted(struct session *s, double tilt_deg, struct pose_report *pose, struct error *err)
{
    pose->tilt_deg = tilt_deg;
    return bench_tilt(&s->bench, tilt_deg, err) && white_again(s, pose, err);
}

// An upright screen, the eye before it and aside: down to the right, where a
// camera behind the screen still sees the head.
static bool off_axis(struct session *s, double off_normal_deg, struct pose_report *pose,
                     struct error *err)
{
    double angle = off_normal_deg * M_PI / 180;
    struct vec3 in_screen = vec3_scale((struct vec3){sin(angle) * M_SQRT1_2, -sin(angle) * M_SQRT1_2,
                                                     cos(angle)},
                                       AXIS_DISTANCE_M);
    pose->off_axis = true;
    pose->off_normal_deg = off_normal_deg;
    pose->tilt_deg = AXIS_TILT_DEG;
    pose->eye = rigid_apply(stand_pose(&s->settings.stand.stand, AXIS_TILT_DEG), in_screen);
    return bench_head(&s->bench, pose->eye, err) && white_again(s, pose, err);
}

static bool off_axes(struct session *s, struct error *err)
{
    int count = sizeof AXIS_DEG / sizeof *AXIS_DEG;
    if (!bench_tilt(&s->bench, AXIS_TILT_DEG, err))
        return false;
    for (int i = 0; i < count; i++) {
        if (!off_axis(s, AXIS_DEG[i], &s->facts->poses[s->facts->pose_count++], err))
            return while_doing(err, "%.0f degrees off the normal", AXIS_DEG[i]);
        bench_progress(&s->bench, "off the normal", i + 1, count);
    }
    return bench_tilt(&s->bench, s->settings.stand.default_tilt_deg, err);
}

bool session_poses(struct session *s, struct error *err)
{
    struct session_facts *f = s->facts;
    int tilts = sizeof POSE_TILTS_DEG / sizeof *POSE_TILTS_DEG;
    int eyes = sizeof POSE_EYES / sizeof *POSE_EYES;
    double rest_deg = s->settings.stand.default_tilt_deg;
    struct vec3 eye = session_eye(s);
    for (int i = 0; i < tilts + 1; i++) {
        struct pose_report *p = &f->poses[f->pose_count++];
        p->eye = eye;
        if (!tilted(s, i < tilts ? POSE_TILTS_DEG[i] : rest_deg, p, err))
            return false;
        bench_progress(&s->bench, "tilts", i + 1, tilts + 1);
    }
    for (int i = 0; i < eyes; i++) {
        struct pose_report *p = &f->poses[f->pose_count++];
        p->eye = POSE_EYES[i];
        p->tilt_deg = rest_deg;
        if (!bench_head(&s->bench, p->eye, err) || !settle(s, p, err))
            return false;
        bench_progress(&s->bench, "head", i + 1, eyes);
    }
    return (!f->view.measured || off_axes(s, err)) && bench_head(&s->bench, eye, err);
}
