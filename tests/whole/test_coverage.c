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
enum { SESSIONS = 24, LABS = 8 };
static const double COVER_LEAST = 0.85, COVER_MOST = 1; // few sessions scatter
#else
enum { SESSIONS = 408, LABS = 68 };
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
static void predict(struct session_here *s, const struct display_model *m, struct budget_patch *p,
                    struct counts *counts, struct xyz *screen)
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
    *counts = (struct counts){code[0], code[1], code[2]};
    struct xyz out = display_forward(m, inverse.counts); // rounding is one of the causes
    p->screen = (struct xyz){out.X + k * rho * white.X, out.Y + k * rho * white.Y,
                             out.Z + k * rho * white.Z};
    p->by_code = report_by_code(&along_the_normal, m, inverse.counts, 8);
    *screen = seen(s, code);
}

static void fill_shown(const struct session_here *s, struct budget_input *in)
{
    struct easel easel = easel_at(&s->scenario.stand, s->scenario.stand.tilt_deg);
    const double *e = s->scenario.head.eye_m;
    struct vec3 eye = {e[0], e[1], e[2]};
    in->scope = SCOPE_SHOWN;
    in->reflectance = s->scenario.panel.reflectance;
    in->eye_distance_m = vec3_length(vec3_sub(eye, easel.centre));
    in->eye_angle_deg = asin(sqrt(sin2_from(&easel, eye))) * 180 / M_PI;
}

// The same chart again, not read but predicted.
static bool predict_and_compare(struct session_here *s, const struct lab_here *lab, int seed,
                                struct budget_input *in, struct budget_patch *patches,
                                struct truth *truth, struct tally *t, struct error *err)
{
    struct lamp_report *shown = calloc(1, sizeof *shown);
    struct budget b = {0};
    struct xyz *modes = NULL;
    bool fine = shown != NULL;
    fill_shown(s, in);
    for (int i = 0; fine && i < PATCHES; i++) {
        predict(s, &lab->model, &patches[i], &shown->patches[i].counts, &truth->screen[i]);
        shown->patch_count = i + 1;
    }
    for (int c = 0; fine && c < 4; c++)
        shown->gains[c] = 1;
    fine = fine && report_display_modes(shown, &lab->model, &lab->uncertainty, &in->display_modes,
                                        &modes, err);
    in->display_mode = modes;
    fine = fine && budget_make(in, DRAWS, (uint64_t)seed, &b, err);
    if (fine)
        tally_session(&b, truth, t);
    budget_fini(&b);
    free(modes);
    free(shown);
    return fine;
}

static bool state_and_compare(struct session_here *s, const struct lab_here *lab, int seed,
                              struct tally t[2], struct error *err)
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
    fine = fine && predict_and_compare(s, lab, seed, &in, patches, &truth, &t[SCOPE_SHOWN], err);
    budget_fini(&b);
    free(patches);
    free(radiances);
    return fine;
}

static bool session(int seed, const struct lab_here *lab, struct tally t[2], struct error *err)
{
    struct session_here *s = calloc(1, sizeof *s);
    bool fine = s && set_up(s, seed, lab, err);
    if (fine)
        true_light(s);
    fine = fine && find_out(s, seed, err) && state_and_compare(s, lab, seed, t, err);
    if (s)
        close_up(s);
    free(s);
    return fine;
}

// ---- the test ----------------------------------------------------------------------------

static struct tally each[SESSIONS][2];

static int hold_sessions(void **state)
{
    static bool fine[SESSIONS];
    struct lab_here *labs = calloc(LABS, sizeof *labs);
    int failed = make_shared(state) || !labs;
#pragma omp parallel for schedule(dynamic)
    for (int i = 0; i < LABS; i++)
        fine[i] = !failed && lab_make(5000 + i, &labs[i], NULL);
    for (int i = 0; i < LABS; i++)
        failed = failed || !fine[i];
#pragma omp parallel for schedule(dynamic)
    for (int i = 0; i < SESSIONS; i++)
        fine[i] = !failed && session(1000 + i, &labs[i % LABS], each[i], NULL);
    for (int i = 0; i < SESSIONS; i++)
        failed = failed || !fine[i];
    free(labs);
    return failed ? -1 : 0;
}

static double share_of(const struct tally *t, int way, int from, int to)
{
    double within = 0, all = 0;
    for (int k = from; k <= to; k++) {
        within += t->within[way][k];
        all += t->all[way][k];
    }
    return within / all;
}

static void sum_up(enum budget_scope scope, struct tally *all)
{
    *all = (struct tally){0};
    for (int i = 0; i < SESSIONS; i++)
        for (int k = 0; k < 6; k++) {
            const struct tally *t = &each[i][scope];
            all->within[k / 3][k % 3] += t->within[k / 3][k % 3];
            all->all[k / 3][k % 3] += t->all[k / 3][k % 3];
            all->z2[k / 3][k % 3] += t->z2[k / 3][k % 3];
        }
    for (int k = 0; k < 6; k++)
        print_message("%s, delta %c: U covers the truth in %.1f %% of %d, rms error over u %.2f\n",
                      k / 3 ? "as published" : "absolute", "LCH"[k % 3],
                      100 * share_of(all, k / 3, k % 3, k % 3), all -> all[k / 3][k % 3],
                      sqrt(all->z2[k / 3][k % 3] / all->all[k / 3][k % 3]));
}

static void what_is_read_from_the_screen_is_as_uncertain_as_stated(void **state)
{
    (void)state;
    struct tally all;
    sum_up(SCOPE_MEASURED, &all);
    for (int k = 0; k < 6; k++) {
        double share = share_of(&all, k / 3, k % 3, k % 3);
        assert_true(share >= COVER_LEAST && share <= COVER_MOST);
    }
}

// What the display model's own uncertainty calls local is an upper bound, alike
// in lightness and colour: as published, where all that is common cancels, delta
// L is stated generously.
static void what_is_predicted_for_the_eye_is_as_uncertain_as_stated(void **state)
{
    (void)state;
    struct tally all;
    sum_up(SCOPE_SHOWN, &all);
    for (int k = 0; k < 6; k++)
        assert_true(share_of(&all, k / 3, k % 3, k % 3) >= COVER_LEAST);
    for (int way = 0; way < 2; way++) {
        double share = share_of(&all, way, 0, 2);
        assert_true(share >= COVER_LEAST && share <= COVER_MOST);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_read_from_the_screen_is_as_uncertain_as_stated),
        cmocka_unit_test(what_is_predicted_for_the_eye_is_as_uncertain_as_stated),
    };
    return cmocka_run_group_tests(tests, hold_sessions, free_shared);
}
