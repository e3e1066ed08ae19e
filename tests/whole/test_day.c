// SPDX-License-Identifier: Apache-2.0
// Twenty-four hours of a booth in one process on an injected clock: the drivers
// and boothd's own way of keeping instruments in service and believing them, on
// the simulator's models, with faults at random. No wire, no thread, no waiting.
//
// While all is well an instrument gets a turn only now and then, as on a
// machine that sleeps most of the day: at native rates a day has eight million
// poses. From a second before a fault until after it the pauses are short or none.
#include "tests/fakes/support.h"

#include <dirent.h>
#include <malloc.h>

#include "colorimetry/colour.h"
#include "tests/whole/day_booth.h"

static const int64_t LOOK_NS = 250 * NS_PER_MS;
static const int64_t BEFORE_NS = NS_PER_S;
static const int64_t TURN_NS = 3100 * NS_PER_MS;  // an opening has three seconds; the rest is wire
static const int64_t OVERDUE_NS = 10 * NS_PER_MS; // the last call that a deadline cuts short
static const int64_t RECOVERY_NS = 2 * NS_PER_S;  // and three integrations, once it is on its bus
// A server of libmodbus more or less; the least leak a fault would be 20 kB a day.
static const size_t GROWTH_BYTES = 2048;
static const int64_t SERIES_WITHIN_NS = 2 * NS_PER_S;
static const int64_t HORIZON_NS = 50 * NS_PER_MS; // for so long the eye is carried on
static const int64_t SETTLED_NS = 60 * NS_PER_S;  // readings are up to 15 s apart
enum {
    GOOD_AFTER = 3,
    LOOKS_A_TRUTH = 40,
    SERIES_EVERY = 50,
    SERIES_READINGS = 3,
    MEASURE_WITHIN_S = 30,
    FAILS_AFTER = 1,
    DOUBT_LINES = 2, // that it lasts, and that it is over
    FINDINGS_MOST = 20
};

static const double LUX_SHARE = 0.02;   // calibration file and binning
static const double DARK_LUX_S = 0.35;  // seven times the read noise, over the exposure
static const double LEVEL_SHARE = 0.03; // and the lamp's warming up between two readings
static const double TILT_DEG = 0.15;    // seven times the inclinometer's noise
static const double EYE_M = 0.04;       // the camera's pixels, a metre away
static const double POSE_M = 1e-9;      // centimetres in double
static const double RADIANCE = 0.02;    // the radiometer's noise is a tenth of it

static int findings;
static uint64_t looks;

static double seconds(int64_t ns)
{
    return (double)ns / NS_PER_S;
}

static struct vec3 eye_at_ns(int64_t at_ns)
{
    struct world_state now;
    world_state_at(day.world, at_ns, &now);
    return now.eye;
}

// ---- what was found ------------------------------------------------------------

__attribute__((format(printf, 2, 3))) static void found(const struct station *s, const char *format,
                                                        ...)
{
    char text[512];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (findings++ < FINDINGS_MOST)
        print_error("%s, %.3f s (%s since %.3f s, last fault: %s): %s\n", s->lane.name,
                    seconds(s->lane.now_ns - DAY_START_NS), day_fault_name(s->lane.fault),
                    seconds(s->lane.since_ns - DAY_START_NS), day_fault_name(s->struck), text);
}

// ---- samples -------------------------------------------------------------------

static bool finite_vec3(struct vec3 v)
{
    return isfinite(v.x) && isfinite(v.y) && isfinite(v.z);
}

static void check_interval(struct station *s, const struct interval *taken)
{
    if (taken->earliest_ns > taken->latest_ns || taken->latest_ns > s->lane.now_ns ||
        taken->latest_ns <= s->latest_ns)
        found(s, "a sample from %.6f to %.6f s after one of %.6f s", seconds(taken->earliest_ns),
              seconds(taken->latest_ns), seconds(s->latest_ns));
    s->latest_ns = taken->latest_ns;
}

static bool light_changed(const struct interval *taken)
{
    struct world_state a, b;
    world_state_at(day.world, taken->earliest_ns, &a);
    world_state_at(day.world, taken->latest_ns, &b);
    return memcmp(a.level, b.level, sizeof a.level);
}

// Whether it can be believed, and then whether it is true.
static bool good_spectrum(struct station *s, bool *is_true)
{
    const struct spectrum_sample *p = &s->letters[0].sample.spectrum;
    struct spectrum truth;
    check_interval(s, &p->taken);
    if (!isfinite(spectrum_sum(&p->irradiance)) || !isfinite(spectrum_sum(&p->sigma)) ||
        !isfinite(p->peak))
        found(s, "a spectrum is not finite");
    if (p->status != SPECTROMETER_GOOD && p->status != SPECTROMETER_WEAK)
        return false;
    day.around.irradiance(day.around.context, p->taken.earliest_ns, p->taken.latest_ns, &truth);
    double lux = xyz_absolute(&p->irradiance, OBSERVER_1931_2).Y;
    double wanted = xyz_absolute(&truth, OBSERVER_1931_2).Y;
    double noise = DARK_LUX_S / (p->integration_us * 1e-6 * p->averaged);
    *is_true = light_changed(&p->taken) || fabs(lux - wanted) <= LUX_SHARE * wanted + noise;
    if (!*is_true && s->lane.fault != WIRE_GARBAGE)
        found(s, "%g lx instead of %g", lux, wanted);
    return true;
}

static bool good_tilt(struct station *s, bool *is_true)
{
    const struct tilt_sample *p = &s->letters[0].sample.tilt;
    struct world_state a, b;
    check_interval(s, &p->taken);
    if (!finite_vec3(p->gravity) || !isfinite(p->tilt_deg) ||
        (p->plausible && !isfinite(p->angle_deg)))
        found(s, "a tilt is not finite");
    if (!p->plausible)
        return false;
    world_state_at(day.world, p->taken.earliest_ns, &a);
    world_state_at(day.world, p->taken.latest_ns, &b);
    double least = fmin(a.tilt_deg, b.tilt_deg), most = fmax(a.tilt_deg, b.tilt_deg);
    *is_true = p->tilt_deg >= least - TILT_DEG && p->tilt_deg <= most + TILT_DEG;
    if (!*is_true && s->lane.fault != WIRE_GARBAGE)
        found(s, "%g degrees instead of %g to %g", p->tilt_deg, least, most);
    return true;
}

static bool good_head(struct station *s, bool *is_true)
{
    const struct head_sample *p = &s->letters[0].sample.head;
    const struct rigid booth_from_camera = booth_from_tracker(&day.settings);
    check_interval(s, &p->taken);
    if (!finite_vec3(p->eye) || !isfinite(p->reprojection_px))
        found(s, "a head is not finite");
    if (p->status != TRACKER_SEEN)
        return false;
    bool camera = s == &day.stations[CAMERA];
    struct vec3 at = camera ? rigid_apply(booth_from_camera, p->eye) : p->eye;
    double off = vec3_length(vec3_sub(at, eye_at_ns(p->taken.latest_ns)));
    *is_true = off <= (camera ? EYE_M : POSE_M);
    if (!*is_true && s->lane.fault != WIRE_GARBAGE)
        found(s, "the eye is %g m off, %g px", off, p->reprojection_px);
    return true;
}

static bool good_sample(struct station *s, bool *is_true)
{
    *is_true = false;
    return s->instrument == INSTRUMENT_SPECTROMETER    ? good_spectrum(s, is_true)
           : s->instrument == INSTRUMENT_ACCELEROMETER ? good_tilt(s, is_true)
                                                       : good_head(s, is_true);
}

// ---- faults --------------------------------------------------------------------

static const struct day_kind *kind_of(const struct station *s, int fault)
{
    for (int i = 0; i < s->kind_count; i++)
        if (s->kinds[i].fault == fault)
            return &s->kinds[i];
    return &s->kinds[0];
}

// What happened during a turn or a rest: the last thing that did counts.
static void notice(struct station *s, int before)
{
    for (int i = before; i < s->lane.next; i++) {
        int fault = s->lane.plan[i].fault;
        if (fault == WIRE_FINE) {
            s->over_ns = s->lane.plan[i].at_ns;
            s->good = 0;
        } else if (i == 0 || s->lane.plan[i - 1].fault == WIRE_FINE) {
            if (s->over_ns && !s->good)
                found(s, "did not recover before %s", day_fault_name(fault));
            s->faults++;
            s->struck = fault;
            s->struck_lines = s->lane.lines;
        }
    }
}

static bool recovering(const struct station *s)
{
    return s->lane.fault == WIRE_FINE && s->over_ns && !s->good;
}

static void recovered(struct station *s)
{
    int64_t took_ns = s->lane.now_ns - s->over_ns;
    s->recovered++;
    if (took_ns > s->worst_ns) {
        s->worst_ns = took_ns;
        s->worst_fault = s->struck;
    }
    if (took_ns > RECOVERY_NS + 3 * s->integration_ns)
        found(s, "took %.3f s to recover", seconds(took_ns));
    int lines = s->lane.lines - s->struck_lines;
    if (kind_of(s, s->struck)->rides && lines)
        found(s, "%d lines were logged of what changed nothing", lines);
    if (s->struck == DAY_DOUBTFUL && lines != DOUBT_LINES)
        found(s, "a doubt took %d lines of log", lines);
}

static void take_sample(struct station *s)
{
    bool is_true, good = good_sample(s, &is_true);
    s->samples++;
    if (!good)
        return;
    s->good_samples++;
    s->letters[0].good_ns = s->latest_ns;
    if (s->lane.fault != WIRE_FINE || s->latest_ns < s->over_ns)
        return;
    if (recovering(s) && is_true)
        recovered(s);
    s->good++;
}

// How long the instrument is left alone after a sample: not while something is
// or was wrong, nor just before.
static int64_t pause_of(const struct station *s)
{
    int64_t calm_ns = s->lane.plan[s->lane.next].at_ns - s->lane.now_ns - BEFORE_NS;
    if (s->lane.fault != WIRE_FINE || s->good < GOOD_AFTER || calm_ns <= 0)
        return s->hot_ns;
    return calm_ns < s->cold_ns ? calm_ns : s->cold_ns;
}

// ---- turns ---------------------------------------------------------------------

// No driver waits for longer than it may.
static void check_turn(struct station *s, int64_t took_ns, int64_t most_ns)
{
    s->longest_ns = took_ns > s->longest_ns ? took_ns : s->longest_ns;
    if (took_ns > most_ns)
        found(s, "a turn took %.3f s", seconds(took_ns));
}

// Now and then raw readings are asked for, in good times and bad.
static void ask_for_series(struct station *s)
{
    static struct series done;
    struct error err = {0};
    if (s->series_asked && polled_series(s->polled, s->series_asked, &done, &err)) {
        if (err.code ? !*err.text : done.readings != SERIES_READINGS || !isfinite(done.mean[1000]))
            found(s, "a series of %d readings, \"%s\"", done.readings, err.text);
        s->series_asked = 0;
        s->series_done += !err.code;
        s->series_refused += err.code != ERROR_NONE;
    }
    if (s->instrument != INSTRUMENT_SPECTROMETER || s->series_asked || s->samples < s->series_next)
        return;
    struct series_wanted wanted = {0, SERIES_READINGS, s->lane.now_ns,
                                   s->lane.now_ns + SERIES_WITHIN_NS};
    s->series_asked = polled_ask_series(s->polled, &wanted);
    s->series_next = s->samples + SERIES_EVERY;
}

static void take_polled_turn(struct station *s)
{
    int before = s->lane.next;
    const int64_t begun_ns = s->lane.now_ns;
    struct letter letter = s->letters[0];
    ask_for_series(s);
    int64_t rest_ns = polled_turn(s->polled), pace_ns = 0;
    letter.number = polled_latest(s->polled, &letter.sample);
    letter.posted_ns = s->lane.now_ns;
    notice(s, before);
    if (letter.number != s->letters[0].number) {
        s->letters[1] = s->letters[0];
        s->letters[0] = letter;
        take_sample(s);
        pace_ns = pause_of(s);
    }
    check_turn(s, s->lane.now_ns - begun_ns, TURN_NS);
    before = s->lane.next;
    lane_wait(s->lane.now_ns + (rest_ns > pace_ns ? rest_ns : pace_ns));
    notice(s, before);
}

static void check_radiance(struct station *s, const struct job *job)
{
    struct spectrum truth;
    double Y = json_number_value(json_array_get(json_object_get(job->reply, "XYZ"), 1));
    day.around.radiance(day.around.context, s->lane.now_ns, &truth);
    double wanted = xyz_absolute(&truth, OBSERVER_1931_2).Y;
    if (!isfinite(Y))
        found(s, "a luminance is not finite");
    if (s->lane.fault == WIRE_FINE && !(fabs(Y - wanted) <= RADIANCE * wanted))
        found(s, "%g cd/m2 instead of %g", Y, wanted);
}

// Measures every now and then, and while something is wrong again and again.
static void take_radiometer_turn(struct station *s)
{
    struct job job = {.kind = JOB_MEASURE, .timeout_s = MEASURE_WITHIN_S};
    int before = s->lane.next, begun_fault = s->lane.fault;
    int64_t begun_ns = s->lane.now_ns;
    desk_do(day.desk, &job);
    notice(s, before);
    check_turn(s, s->lane.now_ns - begun_ns, MEASURE_WITHIN_S * NS_PER_S + TURN_NS);
    s->samples++;
    bool through = begun_fault == WIRE_FINE && s->lane.next == before;
    if (job.reply) {
        if (through)
            check_radiance(s, &job);
        s->good_samples++;
        if (recovering(s) && begun_ns >= s->over_ns)
            recovered(s);
        s->good += begun_ns >= s->over_ns;
        s->failures = 0;
    } else if (through && ++s->failures > FAILS_AFTER) {
        found(s, "measurement %d after the fault failed: %s", s->failures, job.err.text);
    } else if (!job.err.code || !*job.err.text) {
        found(s, "a measurement failed without a reason");
    }
    job_fini(&job);
    before = s->lane.next;
    lane_wait(s->lane.now_ns + pause_of(s));
    notice(s, before);
}

// ---- belief --------------------------------------------------------------------

// The newest that has arrived by now.
static const struct letter *arrived(const struct station *of)
{
    bool ahead = of->letters[0].posted_ns > day.stations[BELIEF].lane.now_ns;
    return &of->letters[ahead];
}

static bool within_01(double share)
{
    return share >= 0 && share <= 1;
}

// Ages count from the last good sample; who is fresh has its age.
static void check_belief(const struct station *s, const struct station *of, const struct belief *b,
                         double hold_s)
{
    int64_t age_ns = s->lane.now_ns - arrived(of)->good_ns;
    if (b->standing == STANDING_PRESET)
        return;
    if (!within_01(b->confidence) || b->age_ns < 0)
        found(s, "%s: confidence %g, age %.3f s", of->lane.name, b->confidence, seconds(b->age_ns));
    if (b->age_ns < age_ns || (b->standing == STANDING_FRESH && b->age_ns != age_ns))
        found(s, "%s: age %.3f s is %.3f s (%s)", of->lane.name, seconds(age_ns),
              seconds(b->age_ns), standing_name(b->standing));
    if ((b->standing == STANDING_STALE) != (seconds(b->age_ns) > hold_s))
        found(s, "%s: %s after %.3f s", of->lane.name, standing_name(b->standing),
              seconds(b->age_ns));
}

static void check_state(struct station *s, const struct state *was, const struct samples *before)
{
    const struct state *now = &day.state;
    if (!isfinite(now->lamp.level) || !isfinite(now->lamp.lux) || !isfinite(now->tilt.deg) ||
        !finite_vec3(now->eye.at) || !isfinite(now->lamp.distance))
        found(s, "what is believed is not finite");
    if (day.seen.tilt_number == before->tilt_number && now->tilt.deg != was->tilt.deg)
        found(s, "the tilt was not held: %g, then %g", was->tilt.deg, now->tilt.deg);
    if (day.seen.spectrum_number == before->spectrum_number && now->lamp.index >= 0 &&
        now->lamp.level != was->lamp.level)
        found(s, "the level was not held: %g, then %g", was->lamp.level, now->lamp.level);
    bool carried = was->eye.belief.age_ns < HORIZON_NS;
    if (day.seen.head_number == before->head_number && !carried &&
        vec3_length(vec3_sub(now->eye.at, was->eye.at)) > 0)
        found(s, "the eye was not held");
}

static void deliver(void)
{
    const struct letter *spectrum = arrived(&day.stations[SPECTROMETER]);
    const struct letter *tilt = arrived(&day.stations[INCLINOMETER]);
    const struct letter *head = arrived(&day.stations[CAMERA]);
    day.seen.spectrum_number = spectrum->number;
    day.seen.spectrum = spectrum->sample.spectrum;
    day.seen.tilt_number = tilt->number;
    day.seen.tilt = tilt->sample.tilt;
    day.seen.head_number = head->number;
    day.seen.head = head->sample.head;
}

// Whether it may be expected to be known by now: well for some time.
static bool is_well(const struct station *of)
{
    int64_t since_ns = of->lane.since_ns > of->over_ns ? of->lane.since_ns : of->over_ns;
    return of->lane.fault == WIRE_FINE && of->good >= GOOD_AFTER &&
           day.stations[BELIEF].lane.now_ns - since_ns > SETTLED_NS;
}

static void check_lamp(const struct station *s, const struct world_state *world)
{
    struct spectrum light;
    int lamp = -1;
    for (int i = 0; i < SCENARIO_LAMPS_MOST; i++)
        lamp = world->level[i] > 0 ? i : lamp;
    day.around.irradiance(day.around.context, s->lane.now_ns, s->lane.now_ns + 1, &light);
    double level = xyz_absolute(&light, OBSERVER_1931_2).Y / DAY_TAUGHT_LUX;
    if (day.state.lamp.index != lamp)
        found(s, "lamp %d is believed, %d is on", day.state.lamp.index, lamp);
    else if (lamp >= 0 && fabs(day.state.lamp.level - level) > LEVEL_SHARE * level)
        found(s, "level %g is believed, it is %g", day.state.lamp.level, level);
}

// Where the world has been at rest and all is well, it is as believed.
static void check_truth(const struct station *s)
{
    struct world_state now, then;
    world_state_at(day.world, s->lane.now_ns, &now);
    world_state_at(day.world, s->lane.now_ns - SETTLED_NS, &then);
    if (is_well(&day.stations[SPECTROMETER]) && !memcmp(now.level, then.level, sizeof now.level))
        check_lamp(s, &now);
    if (is_well(&day.stations[INCLINOMETER]) && now.tilt_deg == then.tilt_deg &&
        fabs(day.state.tilt.deg - now.tilt_deg) > TILT_DEG)
        found(s, "tilt %g is believed, it is %g", day.state.tilt.deg, now.tilt_deg);
    if (is_well(&day.stations[CAMERA]) && !memcmp(&now.eye, &then.eye, sizeof now.eye) &&
        vec3_length(vec3_sub(day.state.eye.at, now.eye)) > EYE_M)
        found(s, "the eye is believed %g m off", vec3_length(vec3_sub(day.state.eye.at, now.eye)));
}

static void take_look(struct station *s)
{
    const struct state_settings *limits = &day.settings.state;
    struct state was = day.state;
    struct samples before = day.seen;
    deliver();
    day.state = estimate(&day.estimator, &day.seen, s->lane.now_ns);
    check_state(s, &was, &before);
    if (looks++ % LOOKS_A_TRUTH == 0 && s->lane.now_ns > SETTLED_NS)
        check_truth(s);
    check_belief(s, &day.stations[SPECTROMETER], &day.state.lamp.belief, limits->lamp_hold_s);
    check_belief(s, &day.stations[INCLINOMETER], &day.state.tilt.belief, limits->tilt_hold_s);
    check_belief(s, &day.stations[CAMERA], &day.state.eye.belief, limits->eye_hold_s);
    lane_wait(s->lane.now_ns + LOOK_NS);
}

// ---- what is held --------------------------------------------------------------

struct holding {
    size_t bytes;
    int descriptors, threads, handles; // of the fake libraries
};

static int entries_of(const char *path)
{
    int count = 0;
    DIR *folder = opendir(path);
    for (struct dirent *entry; folder && (entry = readdir(folder));)
        count += *entry->d_name != '.';
    if (folder)
        closedir(folder);
    return count;
}

#ifdef __SANITIZE_ADDRESS__
// Of sanitizer/allocator_interface.h, which gcc does not bring.
size_t __sanitizer_get_current_allocated_bytes(void);

static size_t bytes_in_use(void)
{
    return __sanitizer_get_current_allocated_bytes();
}
#else
// malloc counts what a thread's cache keeps for its next use as in use: up to
// seven pieces a size, filled here each time.
static void fill_cache(void)
{
    enum { SIZES = 64, PIECES = 7, STEP = 16 };
    static void *pieces[SIZES * PIECES];
    for (size_t i = 0; i < SIZES * PIECES; i++)
        pieces[i] = malloc((i / PIECES + 1) * STEP);
    for (size_t i = 0; i < SIZES * PIECES; i++)
        free(pieces[i]);
}

static size_t bytes_in_use(void)
{
    fill_cache();
    struct mallinfo2 heap = mallinfo2();
    return heap.uordblks + heap.hblkhd;
}
#endif

static struct holding holding(void)
{
    return (struct holding){bytes_in_use(), entries_of("/proc/self/fd"),
                            entries_of("/proc/self/task"), day_usb_held() + day_hid_held()};
}

static struct instrument_report report_of(const struct station *s)
{
    struct instrument_report report;
    polled_report(s->polled, s->lane.now_ns, &report);
    return report;
}

static void all_run(void)
{
    for (int i = SPECTROMETER; i <= POSES; i++) {
        struct instrument_report report = report_of(&day.stations[i]);
        if (report.state != INSTRUMENT_IS_RUNNING)
            print_error("%s is %s\n", day.stations[i].lane.name,
                        instrument_state_name(report.state));
        assert_int_equal(report.state, INSTRUMENT_IS_RUNNING);
        assert_true(report.overdue_ns <= OVERDUE_NS);
    }
}

// ---- the day -------------------------------------------------------------------

static void live_until(int64_t end_ns)
{
    for (;;) {
        struct station *s = &day.stations[BELIEF];
        for (int i = 0; i < BELIEF; i++)
            if (day.stations[i].lane.now_ns < s->lane.now_ns)
                s = &day.stations[i];
        if (s->lane.now_ns >= end_ns)
            break;
        present = &s->lane;
        if (s->polled)
            take_polled_turn(s);
        else if (s == &day.stations[RADIOMETER])
            take_radiometer_turn(s);
        else
            take_look(s);
    }
    present = NULL;
}

static void print_counts(void)
{
    int faults = 0;
    int64_t overdue_ns = 0;
    for (int i = 0; i < BELIEF; i++) {
        const struct station *s = &day.stations[i];
        faults += s->faults;
        if (s->polled && report_of(s).overdue_ns > overdue_ns)
            overdue_ns = report_of(s).overdue_ns;
        print_message("%s: %d faults, recovery %.2f s at worst (%s), longest turn %.2f s, "
                      "%llu of %llu samples good, %d lines of log\n",
                      s->lane.name, s->faults, seconds(s->worst_ns), day_fault_name(s->worst_fault),
                      seconds(s->longest_ns), (unsigned long long)s->good_samples,
                      (unsigned long long)s->samples, s->lane.lines);
    }
    print_message("%d faults in all, %llu looks, %d series of raw readings, %d refused, "
                  "a driver %.2f ms beyond its deadline at worst\n",
                  faults, (unsigned long long)looks, day.stations[SPECTROMETER].series_done,
                  day.stations[SPECTROMETER].series_refused, 1e3 * seconds(overdue_ns));
}

static void nothing_grows_in_a_day_of_faults_and_all_recover(void **state)
{
    (void)state;
    live_until(DAY_START_NS + HOUR_S * NS_PER_S);
    all_run();
    struct holding before = holding();
    live_until(DAY_START_NS + DAY_S * NS_PER_S);
    all_run();
    struct holding after = holding();
    print_counts();
    print_message("%zu bytes, %d descriptors, %d threads, %d handles after an hour; %zu, %d, %d, "
                  "%d after the day\n",
                  before.bytes, before.descriptors, before.threads, before.handles, after.bytes,
                  after.descriptors, after.threads, after.handles);
    assert_int_equal(findings, 0);
    for (int i = 0; i < BELIEF; i++) {
        assert_int_equal(day.stations[i].recovered, day.stations[i].faults);
        assert_int_equal(day.stations[i].lane.repeated, 0);
    }
    assert_int_equal(after.descriptors, before.descriptors);
    assert_int_equal(after.threads, before.threads);
    assert_int_equal(after.handles, before.handles);
    assert_true(after.bytes <= before.bytes + GROWTH_BYTES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_grows_in_a_day_of_faults_and_all_recover),
    };
    return cmocka_run_group_tests(tests, day_open, day_close);
}
