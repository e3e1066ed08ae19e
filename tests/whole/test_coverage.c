// SPDX-License-Identifier: Apache-2.0
// Whether the stated uncertainty is true: hundreds of sessions, each in a booth
// whose instruments, map and pose are off by what only the simulator knows.
// The product's own computations run on what those instruments say; the truth
// comes from the simulator's physics.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail

#include "tests/whole/hidden_booth.h"

#ifdef __SANITIZE_ADDRESS__
enum { SESSIONS = 24 };
static const double COVER_LEAST = 0.85, COVER_MOST = 1; // few sessions scatter
#else
enum { SESSIONS = 408 };
static const double COVER_LEAST = 0.92, COVER_MOST = 0.98; // as asked: 95 % within 3
#endif

enum { DRAWS = 400 };

// How often the truth lies within U, by figure: L, C, H of both ways.
struct tally {
    int within[2][3], all[2][3];
    double z2[2][3]; // squares of error over u
};

static void count(struct tally *t, int way, int figure, const struct budget_figure *f, double truth)
{

    t->within[way][figure] += fabs(f->value - truth) <= 2 * f->u;
    t->all[way][figure]++;
    t->z2[way][figure] += pow((f->value - truth) / f->u, 2);
}

// White is exact as published: both sets are divided by it.
static void tally_session(const struct budget *b, const struct truth *truth, struct tally *t)
{
    for (int way = 0; way < 2; way++)
        for (int i = way; i < PATCHES; i++) {
            struct lab a = lab_in(truth, way, truth->reference, i);
            struct delta_lch d = delta_lch_2000(a, lab_in(truth, way, truth->screen, i));
            const struct budget_difference *stated = way ? &b->published[i] : &b->absolute[i];
            count(t, way, 0, &stated->L, d.L);
            count(t, way, 1, &stated->C, d.C);
            count(t, way, 2, &stated->H, d.H);
        }
}

static void fill_input(const struct session_here *s, struct budget_input *in)
{
    struct summary spots = summarise(s->spot_scale, SPOTS);
    *in = (struct budget_input){.u = shared.u,
                                .scope = SCOPE_MEASURED,
                                .observer = OBSERVER_1931_2,
                                .lamp = s->taught,
                                .lamp_noise = s->spread / sqrt(TEACH),
                                .map_by_radiometer = true,
                                .count = PATCHES};
    booth_light_into(&s->booth, spots.std / spots.mean, SPOTS, in);
}

static bool measure_chart(struct session_here *s, struct budget_patch *patches,
                          struct spectrum *radiances, struct truth *truth)
{
    for (int i = 0; i < PATCHES; i++) {
        // white first, then every other patch
        int at = i ? chart_index(i) : 18;
        patches[i].reflectance = shared.chart.spectra[at];
        patches[i].radiance = &radiances[i];
        patches[i].counts = true;
        show(s, &patches[i].reflectance);
        truth->reference[i] = sum_of(&s->irradiance, &patches[i].reflectance);
        truth->screen[i] = xyz_absolute(&s->light, OBSERVER_1931_2);
        if (!read_light(s, &patches[i].screen, &radiances[i]))
            return false;
    }
    truth->white = sum_of(&s->irradiance, NULL);
    return true;
}

// What the product would show for a sample, and what then leaves the screen.
static bool predict(struct session_here *s, const struct display_model *m, struct budget_patch *p,
                    struct xyz *screen)
{
    static const struct lamp_report along_the_normal = {.gains = {1, 1, 1, 1}};
    double k = s->booth.lux / 100 / M_PI, rho = s->scenario.panel.reflectance;
    struct xyz aim = xyz_relative(&s->taught, &p->reflectance, OBSERVER_1931_2);
    struct xyz white = xyz_relative(&s->taught, NULL, OBSERVER_1931_2);
    struct display_inverse inverse =
        display_invert(m, (struct xyz){k * (aim.X - rho * white.X), k * (aim.Y - rho * white.Y),
                                       k * (aim.Z - rho * white.Z)});
    double code[3] = {rint(255 * inverse.counts.r) / 255, rint(255 * inverse.counts.g) / 255,
                      rint(255 * inverse.counts.b) / 255};
    struct xyz out = display_forward(m, (struct counts){code[0], code[1], code[2]});
    p->screen = (struct xyz){out.X + k * rho * white.X, out.Y + k * rho * white.Y,
                             out.Z + k * rho * white.Z};
    p->by_code = report_by_code(&along_the_normal, m, inverse.counts, 8);
    *screen = seen(s, code);
    return inverse.in_gamut;
}

static void fill_shown(const struct session_here *s, struct vec3 rms, struct budget_input *in)
{
    struct easel easel = easel_at(&s->scenario.stand, s->scenario.stand.tilt_deg);
    const double *e = s->scenario.head.eye_m;
    struct vec3 eye = {e[0], e[1], e[2]};
    in->scope = SCOPE_SHOWN;
    in->display_rms = rms;
    in->reflectance = s->scenario.panel.reflectance;
    in->eye_distance_m = vec3_length(vec3_sub(eye, easel.centre));
    in->eye_angle_deg = asin(sqrt(sin2_from(&easel, eye))) * 180 / M_PI;
}

// The same chart again, not read but predicted.
static bool predict_and_compare(struct session_here *s, int seed, struct budget_input *in,
                                struct budget_patch *patches, struct truth *truth, struct tally *t,
                                struct error *err)
{
    struct display_model *m = calloc(1, sizeof *m);
    struct budget b = {0};
    struct vec3 rms = {0};
    bool fine = m && characterise(s, m) && check(s, m, seed, &rms);
    fill_shown(s, rms, in);
    for (int i = 0; fine && i < PATCHES; i++)
        predict(s, m, &patches[i], &truth->screen[i]);
    fine = fine && budget_make(in, DRAWS, (uint64_t)seed, &b, err);
    if (fine)
        tally_session(&b, truth, t);
    budget_fini(&b);
    free(m);
    return fine;
}

static bool state_and_compare(struct session_here *s, int seed, struct tally t[2],
                              struct error *err)
{
    struct budget_patch *patches = calloc(PATCHES, sizeof *patches);
    struct spectrum *radiances = calloc(PATCHES, sizeof *radiances);
    struct budget_input in;
    struct budget b = {0};
    struct truth truth;
    fill_input(s, &in);
    in.patches = patches;
    bool fine = patches && radiances && measure_chart(s, patches, radiances, &truth) &&
                budget_make(&in, DRAWS, (uint64_t)seed, &b, err);
    if (fine)
        tally_session(&b, &truth, &t[SCOPE_MEASURED]);
    fine = fine && predict_and_compare(s, seed, &in, patches, &truth, &t[SCOPE_SHOWN], err);
    budget_fini(&b);
    free(patches);
    free(radiances);
    return fine;
}

static bool session(int seed, struct tally t[2], struct error *err)
{
    struct session_here *s = calloc(1, sizeof *s);
    bool fine = s && set_up(s, seed, err);
    if (fine)
        true_light(s);
    fine = fine && find_out(s, seed, err) && state_and_compare(s, seed, t, err);
    if (s) {
        luminance_map_fini(&s->map);
        lamp_fini(&s->lamp);
        pr655_destroy(s->radiometer);
    }
    free(s);
    return fine;
}

// ---- the test ----------------------------------------------------------------------------

static struct tally each[SESSIONS][2];

static int hold_sessions(void **state)
{
    static bool fine[SESSIONS];
    if (make_shared(state))
        return -1;
#pragma omp parallel for schedule(dynamic)
    for (int i = 0; i < SESSIONS; i++)
        fine[i] = session(1000 + i, each[i], NULL);
    for (int i = 0; i < SESSIONS; i++)
        if (!fine[i])
            return -1;
    return 0;
}

static void assert_covered(enum budget_scope scope)
{
    struct tally all = {0};
    for (int i = 0; i < SESSIONS; i++)
        for (int k = 0; k < 6; k++) {
            const struct tally *t = &each[i][scope];
            all.within[k / 3][k % 3] += t->within[k / 3][k % 3];
            all.all[k / 3][k % 3] += t->all[k / 3][k % 3];
            all.z2[k / 3][k % 3] += t->z2[k / 3][k % 3];
        }
    for (int way = 0; way < 2; way++)
        for (int k = 0; k < 3; k++) {
            double share = (double)all.within[way][k] / all.all[way][k];
            print_message(
                "%s, delta %c: U covers the truth in %.1f %% of %d, rms error over u %.2f\n",
                way ? "as published" : "absolute", "LCH"[k], 100 * share, all.all[way][k],
                sqrt(all.z2[way][k] / all.all[way][k]));
        }
    for (int way = 0; way < 2; way++)
        for (int k = 0; k < 3; k++) {
            double share = (double)all.within[way][k] / all.all[way][k];
            assert_true(share >= COVER_LEAST && share <= COVER_MOST);
        }
}

static void what_is_read_from_the_screen_is_as_uncertain_as_stated(void **state)
{
    (void)state;
    assert_covered(SCOPE_MEASURED);
}

static void what_is_predicted_for_the_eye_is_as_uncertain_as_stated(void **state)
{
    (void)state;
    assert_covered(SCOPE_SHOWN);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_read_from_the_screen_is_as_uncertain_as_stated),
        cmocka_unit_test(what_is_predicted_for_the_eye_is_as_uncertain_as_stated),
    };
    return cmocka_run_group_tests(tests, hold_sessions, free_shared);
}
