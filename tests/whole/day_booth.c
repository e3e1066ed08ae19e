// SPDX-License-Identifier: Apache-2.0
#include "tests/fakes/support.h"

#include <signal.h>

#include "tests/whole/day_booth.h"

struct day day;

static const int64_t MEASURE_EVERY_MS = 300000;

// ---- how they fail -------------------------------------------------------------

#define ANY 0.02, 20 // s: from a blink to well beyond the longest patience

static const struct day_kind spectrometer_kinds[] = {
    {DAY_LAMP, 0, 0, true},
    {WIRE_UNPLUGGED, ANY, false},
    {WIRE_MOVED, 0, 0, false},
    {WIRE_PULLED_IN_COMMAND, ANY, false},
    {WIRE_PULLED_IN_SPECTRUM, ANY, false},
    {WIRE_BLANK, ANY, false},
    {WIRE_FORBIDDEN, ANY, false},
    {DAY_BUSY, ANY, false},
    {WIRE_STALL, 1, 2, true},
    {WIRE_SHORT, ANY, false},
    {WIRE_SILENT, ANY, false},
    {WIRE_GARBAGE, ANY, false},
    {WIRE_NO_SYNC, ANY, false},
    {WIRE_BAD_SYNC, ANY, false},
    {WIRE_OUT_OF_STEP, ANY, false},
    {WIRE_OTHER_PIXELS, ANY, false},
    {WIRE_OVERFLOW, ANY, false},
    {DAY_IO_ERROR, ANY, false},
    {WIRE_DEAF, ANY, false},
    {DAY_LAMP, 0, 0, true},
};

static const struct day_kind inclinometer_kinds[] = {
    {DAY_TILT, 0, 0, true},          {WIRE_UNPLUGGED, ANY, false},
    {WIRE_FORBIDDEN, ANY, false},    {DAY_BUSY, ANY, false},
    {WIRE_SILENT, ANY, false},       {WIRE_GARBAGE, ANY, false},
    {WIRE_SHORT, ANY, false},        {WIRE_STALL, ANY, false},
    {WIRE_BAD_CRC, ANY, false},      {WIRE_WRONG_UNIT, ANY, false},
    {WIRE_LATE, ANY, false},         {WIRE_DROPPED, ANY, true},
    {WIRE_BAD_FUNCTION, ANY, false}, {WIRE_BAD_ADDRESS, ANY, false},
    {WIRE_BAD_VALUE, ANY, false},    {WIRE_DEVICE_FAILURE, ANY, false},
    {DAY_SHAKEN, 0.02, 4, true},     {DAY_DOUBTFUL, 7, 20, false},
};

static const struct day_kind gateway_kinds[] = {
    {WIRE_HALF_OPEN, ANY, false},  {WIRE_UNPLUGGED, ANY, false}, {WIRE_SILENT, ANY, false},
    {WIRE_GARBAGE, ANY, false},    {WIRE_SHORT, ANY, false},     {WIRE_BAD_CRC, ANY, false},
    {WIRE_WRONG_UNIT, ANY, false}, {WIRE_LATE, ANY, false},      {WIRE_DROPPED, ANY, true},
};

static const struct day_kind camera_kinds[] = {
    {DAY_HEAD, 0, 0, true},    {WIRE_UNPLUGGED, ANY, false},     {WIRE_FORBIDDEN, ANY, false},
    {WIRE_SILENT, ANY, false}, {WIRE_GARBAGE, ANY, false},       {WIRE_SHORT, ANY, false},
    {WIRE_STALL, 0, 0, true},  {WIRE_FLOOD, 1, 3, true},         {WIRE_WRONG_REPORT, ANY, false},
    {DAY_AWAY, 1, 200, true},  {DAY_AWAY_UPSET, 100, 200, true}, {DAY_HEAD, 0, 0, true},
};

static const struct day_kind poses_kinds[] = {
    {WIRE_SILENT, ANY, false}, {WIRE_GARBAGE, ANY, false}, {WIRE_SHORT, ANY, false},
    {WIRE_FLOOD, 1, 3, true},  {DAY_NAN, ANY, false},      {DAY_FAR, ANY, false},
    {DAY_LONG, ANY, false},    {DAY_STALE, ANY, false},
};

static const struct day_kind radiometer_kinds[] = {
    {WIRE_UNPLUGGED, ANY, false}, {WIRE_SILENT, ANY, false}, {WIRE_GARBAGE, ANY, false},
    {WIRE_SHORT, ANY, false},     {WIRE_STALL, ANY, true},   {WIRE_WEAK_LIGHT, ANY, true},
    {WIRE_OVERLOAD, ANY, true},   {WIRE_DRIFT, ANY, true},   {WIRE_MISREAD, ANY, true},
    {WIRE_FORBIDDEN, ANY, false},
};

#define KINDS(list) list##_kinds, sizeof list##_kinds / sizeof *list##_kinds

// ---- the senses ----------------------------------------------------------------

static void sense_irradiance(void *context, int64_t from_ns, int64_t to_ns, struct spectrum *out)
{
    const struct around *world = context;
    world->irradiance(world->context, from_ns, to_ns, out);
}

static struct vec3 sense_gravity(void *context, int64_t at_ns)
{
    const struct around *world = context;
    struct vec3 g = world->gravity(world->context, at_ns);
    bool shaken = present && (present->fault == DAY_SHAKEN || present->fault == DAY_DOUBTFUL);
    return shaken ? vec3_scale(g, 1.2) : g;
}

static void sense_markers(void *context, int64_t at_ns, struct vec3 out[3])
{
    const struct around *world = context;
    bool away = present && (present->fault == DAY_AWAY || present->fault == DAY_AWAY_UPSET);
    world->markers(world->context, at_ns, out);
    for (int i = 0; i < 3 && away; i++)
        out[i].z = -1;
}

static void sense_radiance(void *context, int64_t at_ns, struct spectrum *out)
{
    const struct around *world = context;
    world->radiance(world->context, at_ns, out);
}

// As opentrack tells it: the camera's frame is the booth's here.
static struct vec3 head_of_poses(int64_t at_ns)
{
    struct world_state now;
    world_state_at(day.world, at_ns, &now);
    return now.eye;
}

static void drive_grey(void *context, int x, int y, double code[3])
{
    (void)context, (void)x, (void)y;
    code[0] = code[1] = code[2] = 0.5;
}

// ---- opening -------------------------------------------------------------------

static void open_station(struct station *s, const char *name, enum instrument instrument,
                         const struct day_kind *kinds, size_t count)
{
    s->lane.name = name;
    s->lane.now_ns = DAY_START_NS;
    s->instrument = instrument;
    s->kinds = kinds;
    s->kind_count = (int)count;
    s->lane.plan = day_plan(kinds, s->kind_count, name, day.world, DAY_START_NS);
    present = &s->lane;
}

static void pace(struct station *s, int64_t cold_ms, int64_t hot_ms, int64_t integration_ms)
{
    s->cold_ns = cold_ms * NS_PER_MS;
    s->hot_ns = hot_ms * NS_PER_MS;
    s->integration_ns = integration_ms * NS_PER_MS;
}

static void open_polled(struct station *s, const struct acquire_from *from)
{
    struct error err = {0};
    s->polled = polled_create(from, s->instrument, &err);
    assert_string_equal(err.text, "");
}

static void open_spectrometer(struct station *s, const struct acquire_from *from)
{
    open_station(s, "spectrometer", INSTRUMENT_SPECTROMETER, KINDS(spectrometer));
    pace(s, 15000, 0, from->spectrometer_options.longest_us / 1000);
    s->lane.strike = day_usb_strike;
    assert_true(day_usb_open(&day.around, DAY_START_NS, from->spectrometer_options.calibration));
    open_polled(s, from);
}

static void open_inclinometers(struct station *rtu, struct station *gateway,
                               const struct acquire_from *whole)
{
    struct acquire_from from = *whole;
    open_station(rtu, "inclinometer", INSTRUMENT_ACCELEROMETER, KINDS(inclinometer));
    pace(rtu, 5000, 0, 40);
    assert_true(day_rtu_open(&day.around, &rtu->lane));
    strcpy(from.accelerometer_options.port, rtu->lane.path);
    open_polled(rtu, &from);
    open_station(gateway, "gateway", INSTRUMENT_ACCELEROMETER, KINDS(gateway));
    pace(gateway, 5000, 0, 45);
    assert_true(day_tcp_open(&day.around, &gateway->lane));
    strcpy(from.accelerometer_options.port, gateway->lane.path);
    open_polled(gateway, &from);
}

static void open_trackers(struct station *camera, struct station *poses,
                          const struct acquire_from *whole)
{
    struct acquire_from from = *whole;
    open_station(camera, "camera", INSTRUMENT_TRACKER, KINDS(camera));
    pace(camera, 10000, 200, 10);
    camera->lane.strike = day_hid_strike;
    assert_true(day_hid_open(&day.around));
    open_polled(camera, &from);
    open_station(poses, "poses", INSTRUMENT_TRACKER, KINDS(poses));
    pace(poses, 20000, 100, 20);
    assert_true(day_poses_open(head_of_poses, &poses->lane));
    from.tracker = tracker_drivers[1];
    from.tracker_options.port = 0;
    memset(from.tracker_options.eye_from_marker_m, 0,
           sizeof from.tracker_options.eye_from_marker_m);
    open_polled(poses, &from);
}

static void open_radiometer(struct station *s)
{
    struct error err = {0};
    open_station(s, "radiometer", INSTRUMENT_RADIOMETER, KINDS(radiometer));
    pace(s, MEASURE_EVERY_MS, 5000, 13000);
    assert_true(day_radiometer_open(&day.around, &s->lane));
    strcpy(day.settings.radiometer.options.port, s->lane.path);
    day.desk = desk_create(&day.settings, NULL, &err);
    assert_string_equal(err.text, "");
}

static void teach(struct classifier *taught)
{
    classifier_reset(taught);
    for (taught->count = 0; world_lamp(day.world, taught->count); taught->count++) {
        const struct lamp *lamp = world_lamp(day.world, taught->count);
        struct taught_lamp *t = &taught->lamps[taught->count];
        *t = (struct taught_lamp){.irradiance = lamp->per_lux, .spread = 0.002};
        spectrum_scale(&t->irradiance, DAY_TAUGHT_LUX);
        strcpy(t->name, lamp->name);
    }
}

static void open_world(void)
{
    static struct scenario scenario;
    static struct around world;
    struct error err = {0};
    scenario_load("simulator/scenarios/booth.ini", &scenario, &err);
    scenario.ceiling.true_px[0] = 64; // nobody looks at it closely
    scenario.ceiling.true_px[1] = 42;
    scenario.radiometer.screen_spot_m = 0.005;
    day.world = world_create(&scenario, DAY_START_NS, &err);
    assert_string_equal(err.text, "");
    world_set_pixels(day.world, drive_grey, NULL);
    world = world_around(day.world);
    day.around = (struct around){.context = &world,
                                 .irradiance = sense_irradiance,
                                 .gravity = sense_gravity,
                                 .markers = sense_markers,
                                 .radiance = sense_radiance};
}

int day_open(void **state)
{
    static const struct happening nothing = {INT64_MAX, WIRE_FINE};
    static struct classifier taught;
    struct error err = {0};
    (void)state;
    signal(SIGPIPE, SIG_IGN); // as boothd does
    folder_open(&day.folder);
    booth_load("config/booths/emulated.conf", NULL, 0, &day.settings, &err);
    assert_string_equal(err.text, "");
    snprintf(day.settings.spectrometer.options.calibration,
             sizeof day.settings.spectrometer.options.calibration, "%s",
             folder_at(&day.folder, "spectrometer.cal"));
    open_world();
    struct acquire_from from = acquire_from(&day.settings);
    struct station *s = day.stations;
    open_spectrometer(&s[SPECTROMETER], &from);
    open_inclinometers(&s[INCLINOMETER], &s[GATEWAY], &from);
    open_trackers(&s[CAMERA], &s[POSES], &from);
    open_radiometer(&s[RADIOMETER]);
    s[BELIEF].lane = (struct lane){.name = "belief", .now_ns = DAY_START_NS, .plan = &nothing};
    teach(&taught);
    estimator_init(&day.estimator, &day.settings, &taught);
    day.state = day.estimator.state;
    present = NULL;
    return 0;
}

int day_close(void **state)
{
    (void)state;
    for (int i = 0; i < LANES; i++) {
        struct station *s = &day.stations[i];
        present = &s->lane;
        polled_destroy(s->polled);
        if (i == RADIOMETER)
            desk_close(day.desk, INT64_MAX);
    }
    for (int i = 0; i < BELIEF; i++)
        free((void *)day.stations[i].lane.plan);
    present = NULL;
    int held = day_usb_held() + day_hid_held();
    day_usb_close();
    day_hid_close();
    day_lines_close();
    day_poses_close();
    world_destroy(day.world);
    folder_close(&day.folder);
    return held;
}
