// SPDX-License-Identifier: Apache-2.0
#include "calibration/measuring.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "calibration/journal.h"

enum { WARM_UP_LEAST = 6, WARM_UP_MOST = 4096 };

static const uint64_t SEED = 20040912;

const struct measuring_plan MEASURING_WHOLE = {.sizes = {16, 12, 60, 25},
                                               .verify = 40,
                                               .seed = SEED,
                                               .warm_up_s = 1800,
                                               .warm_up_window_s = 120,
                                               .settle_s = -1};
const struct measuring_plan MEASURING_REHEARSAL = {
    .sizes = {6, 2, 10, 25}, .verify = 8, .seed = SEED};

// One run of measuring.
struct run {
    struct bench *bench;
    const struct measuring_plan *plan;
    struct measuring *out;
    struct journal journal;
    double began_s, last_s; // of UTC, and the latest elapsed time in the journal
    double settle_s;
};

void measuring_fini(struct measuring *m)
{
    patch_set_fini(&m->fit);
    patch_set_fini(&m->verify);
    *m = (struct measuring){0};
}

static double utc_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

// Since the journal was begun; never goes back, whatever the clock does.
static double elapsed(struct run *r)
{
    r->last_s = fmax(r->last_s, utc_s() - r->began_s);
    return r->last_s;
}

static void wait(double seconds)
{
    clock_sleep_until_ns(clock_now_ns() + (int64_t)(seconds * NS_PER_S));
}

// ---- the journal -----------------------------------------------------------

static json_t *head_of(const struct measuring_plan *p, const char *booth)
{
    char now[21];
    clock_utc(now);
    json_t *plan =
        json_pack("{s:i,s:i,s:i,s:i,s:i,s:I}", "ramp_steps", p->sizes.ramp_steps, "near_black",
                  p->sizes.near_black, "random", p->sizes.random, "white_every",
                  p->sizes.white_every, "verify", p->verify, "seed", (json_int_t)p->seed);
    return json_pack("{s:s,s:s,s:o,s:s,s:f,s:s}", "journal", "display measure", "booth", booth,
                     "plan", plan, "started", now, "started_s", utc_s(), "software",
                     "boothd " BOOTHD_VERSION);
}

static bool same_head(const struct journal *j, const json_t *asked, struct error *err)
{
    static const char *const KEYS[] = {"journal", "booth", "plan"};
    for (unsigned i = 0; i < sizeof KEYS / sizeof *KEYS; i++) {
        json_t *was = json_object_get(j->head, KEYS[i]), *is = json_object_get(asked, KEYS[i]);
        if (json_equal(was, is))
            continue;
        char *old = was ? json_dumps(was, JSON_COMPACT | JSON_ENCODE_ANY) : NULL;
        char *new = json_dumps(is, JSON_COMPACT | JSON_ENCODE_ANY);
        fail(err, ERROR_CONFIG,
             "%s:1: %s: %s, but now asked for: %s; measure into another folder, or delete it",
             j->path, KEYS[i], old ? old : "missing", new ? new : "");
        free(old);
        free(new);
        return false;
    }
    return true;
}

static bool same_instrument(struct run *r, const json_t *reading, struct error *err)
{
    char name[128];
    bench_instrument(reading, name, sizeof name);
    if (!*r->out->instrument)
        snprintf(r->out->instrument, sizeof r->out->instrument, "%s", name);
    return !strcmp(r->out->instrument, name) ||
           fail(err, ERROR_CONFIG, "%s: was begun with the instrument %s, this is %s",
                r->journal.path, r->out->instrument, name);
}

static bool take_xyz(const json_t *reading, struct xyz *out)
{
    json_error_t why;
    return !json_unpack_ex((json_t *)reading, &why, 0, "{s:[FFF]}", "XYZ", &out->X, &out->Y,
                           &out->Z) &&
           isfinite(out->X + out->Y + out->Z);
}

static struct patch_set *set_named(struct run *r, const char *name)
{
    return !strcmp(name, "characterise") ? &r->out->fit
           : !strcmp(name, "verify")     ? &r->out->verify
                                         : NULL;
}

// The plan's own patch must stand in the line: nothing is taken on trust.
static bool keep_reading(struct run *r, const json_t *line, int number, struct error *err)
{
    const char *set_name = "";
    int index = -1;
    double at = -1, rgb[3];
    json_t *reading = NULL;
    if (json_unpack((json_t *)line, "{s:s,s:i,s:F,s:[FFF],s:o}", "set", &set_name, "index", &index,
                    "elapsed_s", &at, "rgb", &rgb[0], &rgb[1], &rgb[2], "reading", &reading))
        return fail(err, ERROR_DATA, "%s:%d: is no reading", r->journal.path, number);
    r->last_s = fmax(r->last_s, at);
    struct patch_set *set = set_named(r, set_name);
    if (!set)
        return true; // of warming up or settling
    struct display_patch *p = index >= 0 && index < set->count ? &set->patches[index] : NULL;
    if (!p ||
        fabs(p->counts.r - rgb[0]) + fabs(p->counts.g - rgb[1]) + fabs(p->counts.b - rgb[2]) >
            1e-9 ||
        p->reading >= 0 || !take_xyz(reading, &p->xyz))
        return fail(err, ERROR_DATA, "%s:%d: index: %d of %s is not the patch that was to be read",
                    r->journal.path, number, index, set_name);
    p->elapsed_s = at;
    p->reading = (int)json_array_size(r->bench->readings);
    json_array_append(r->bench->readings, reading);
    r->out->kept++;
    return same_instrument(r, reading, err);
}

static bool keep_journal(struct run *r, struct error *err)
{
    size_t i;
    json_t *line;
    json_array_foreach(r->journal.lines, i,
                       line) if (!keep_reading(r, line, (int)i + 2, err)) return false;
    return true;
}

// ---- one reading -----------------------------------------------------------

static bool read_patch(struct run *r, const char *set, int index, struct counts c, double after_s,
                       struct display_patch *out, struct error *err)
{
    char what[96];
    snprintf(what, sizeof what, "%s %.4f %.4f %.4f", set, c.r, c.g, c.b);
    if (!bench_patch(r->bench, c, err))
        return false;
    wait(after_s);
    double at = elapsed(r);
    if (!bench_measure(r->bench, what, &out->xyz, &out->reading, err))
        return false;
    json_t *reading = json_array_get(r->bench->readings, (size_t)out->reading);
    out->elapsed_s = at;
    return same_instrument(r, reading, err) &&
           journal_add(&r->journal,
                       json_pack("{s:s,s:i,s:f,s:[f,f,f],s:O}", "set", set, "index", index,
                                 "elapsed_s", at, "rgb", c.r, c.g, c.b, "reading", reading),
                       err);
}

// ---- before the patches ----------------------------------------------------

static const struct counts WHITE = {1, 1, 1}, BLACK = {0, 0, 0};

// The newest readings that span the window, if there are enough of them.
static bool still(const double *at, const double *Y, int n, double window_s, double *per_hour)
{
    int first = n - 1;
    while (first > 0 && at[n - 1] - at[first] < window_s)
        first--;
    if (n - first < WARM_UP_LEAST || at[n - 1] - at[first] < window_s)
        return false;
    struct line_fit line = line_through(at + first, Y + first, n - first);
    *per_hour = 3600 * line.slope / line.at_mean;
    return fabs(line.slope) * window_s < MEASURING_STILL * line.at_mean;
}

static bool warm_up(struct run *r, struct error *err)
{
    static const char STEP[] = "warming up, s";
    const struct measuring_plan *p = r->plan;
    double *at = calloc(2 * WARM_UP_MOST, sizeof *at), *Y = at ? at + WARM_UP_MOST : NULL;
    double from = elapsed(r);
    bool fine = at || fail(err, ERROR_SYSTEM, "out of memory");
    r->out->warm = p->warm_up_s <= 0;
    for (int n = 0; fine && !r->out->warm && n < WARM_UP_MOST; n++) {
        struct display_patch white = {0};
        fine = read_patch(r, "warm-up", n, WHITE, 0, &white, err);
        at[n] = white.elapsed_s;
        Y[n] = white.xyz.Y;
        r->out->warm_up_s = at[n] - from;
        r->out->warm = fine && still(at, Y, n + 1, p->warm_up_window_s, &r->out->warm_up_slope);
        if (r->out->warm_up_s > p->warm_up_s)
            break;
        bench_progress(r->bench, STEP, (int)r->out->warm_up_s, (int)p->warm_up_s);
    }
    free(at);
    return fine;
}

static bool read_settling(void *context, bool white, double after_s, double *luminance,
                          struct error *err)
{
    struct run *r = context;
    struct display_patch p = {0};
    if (!bench_patch(r->bench, white ? BLACK : WHITE, err))
        return false;
    wait(SETTLE_LONGEST_S);
    if (!read_patch(r, "settle", 0, white ? WHITE : BLACK, after_s, &p, err))
        return false;
    *luminance = p.xyz.Y;
    return true;
}

static bool settle(struct run *r, struct error *err)
{
    struct settle *s = &r->out->settle;
    r->out->settle_found = r->plan->settle_s < 0;
    if (!r->out->settle_found)
        *s = (struct settle){.seconds = r->plan->settle_s, .settled = true};
    return !r->out->settle_found || settle_find(read_settling, r, s, err);
}

static bool check_output(struct run *r, struct error *err)
{
    json_t *status = bench_status(r->bench, err);
    if (!status)
        return false;
    const char *ramp =
        json_string_value(json_object_get(json_object_get(status, "output"), "ramp"));
    bool bent = ramp && !strcmp(ramp, "not neutral");
    json_decref(status);
    return !bent ||
           fail(err, ERROR_CONFIG,
                "the monitor's gamma ramp is not neutral: a display cannot be measured through it");
}

// ---- the patches -----------------------------------------------------------

static int missing(const struct patch_set *set)
{
    int n = 0;
    for (int i = 0; i < set->count; i++)
        n += set->patches[i].reading < 0;
    return n;
}

static bool measure_set(struct run *r, struct patch_set *set, const char *name, struct error *err)
{
    for (int i = 0; i < set->count; i++) {
        struct display_patch *p = &set->patches[i];
        if (p->reading >= 0)
            continue;
        if (!read_patch(r, name, i, p->counts, r->out->settle.seconds, p, err))
            return false;
        bench_progress(r->bench, name, set->count - missing(set), set->count);
    }
    return true;
}

static bool plan_sets(struct run *r, struct error *err)
{
    const struct measuring_plan *p = r->plan;
    struct patch_set *sets[] = {&r->out->fit, &r->out->verify};
    if (!patch_set_characterise(&p->sizes, p->seed, sets[0], err) ||
        !patch_set_verify(p->verify, p->seed + 1, sets[1], err))
        return false;
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < sets[k]->count; i++)
            sets[k]->patches[i].reading = -1;
    return true;
}

static bool measure(struct run *r, struct error *err)
{
    if (!missing(&r->out->fit) && !missing(&r->out->verify)) {
        r->out->warm = r->out->settle.settled = true; // nothing is left to do
        return true;
    }
    return check_output(r, err) && warm_up(r, err) && settle(r, err) &&
           measure_set(r, &r->out->fit, "characterise", err) &&
           measure_set(r, &r->out->verify, "verify", err);
}

static bool begin(struct run *r, const char *booth, const char *path, struct error *err)
{
    json_t *head = head_of(r->plan, booth);
    bool fine = journal_open(&r->journal, path, head, err) && same_head(&r->journal, head, err);
    json_decref(head);
    if (!fine)
        return false;
    const char *started = json_string_value(json_object_get(r->journal.head, "started"));
    r->began_s = json_number_value(json_object_get(r->journal.head, "started_s"));
    snprintf(r->out->started, sizeof r->out->started, "%s", started ? started : "");
    return plan_sets(r, err) && keep_journal(r, err);
}

bool measuring_run(struct bench *b, const struct measuring_plan *plan, const char *booth,
                   const char *journal, struct measuring *out, struct error *err)
{
    struct measuring m = {0};
    struct run r = {.bench = b, .plan = plan, .out = &m};
    bool fine = begin(&r, booth, journal, err) && measure(&r, err);
    journal_close(&r.journal);
    if (!fine) {
        measuring_fini(&m);
        return false;
    }
    m.drift = patch_set_drift(&m.fit);
    patch_set_white(&m.fit, &m.white);
    *out = m;
    return true;
}
