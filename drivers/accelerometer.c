// SPDX-License-Identifier: Apache-2.0
#include "drivers/accelerometer.h"

#include <stdlib.h>
#include <string.h>

#include "drivers/iio.h"
#include "drivers/modbus_map.h"
#include "drivers/witmotion.h"

#define FIELD(name) SETTING_FIELD(struct accelerometer_options, name)
#define SIZE(name) SETTING_SIZE(struct accelerometer_options, name)

const char *const accelerometer_models[] = {"wt901c485", "hwt9073", "generic", NULL};

static const double gravity_m_s2 = 9.81, gravity_slack = 0.3;
static const double agreement_deg = 2;

const struct setting accelerometer_settings[] = {
    {"port", SETTING_TEXT, FIELD(port), SIZE(port), .unit = "", .preset = "/dev/ttyUSB0",
     .help = "Serial line of the inclinometer, or ADDRESS:PORT for Modbus over TCP."},
    {"unit", SETTING_INT, FIELD(unit), .least = 1, .most = 247, .unit = "", .preset = "80",
     .help = "Modbus unit number; 80 (0x50) as delivered."},
    {"baud", SETTING_INT, FIELD(baud), .least = 1200, .most = 921600, .unit = "Bd",
     .preset = "9600", .help = "Speed of the serial line, 8N1."},
    {"model", SETTING_ENUM, FIELD(model), .unit = "", .choices = accelerometer_models,
     .preset = "wt901c485", .help = "Which register map the sensor has."},
    {"offset_deg", SETTING_DOUBLE, FIELD(offset_deg), .least = -180, .most = 180, .unit = "deg",
     .preset = "0", .help = "Added to the tilt, for a sensor not mounted flush."},
    {"iio_device", SETTING_TEXT, FIELD(iio_device), SIZE(iio_device), .unit = "", .preset = "",
     .help = "Driver iio: name or label of the accelerometer; empty takes the first one found."},
    {"function", SETTING_INT, FIELD(function), .least = 3, .most = 4, .unit = "", .preset = "3",
     .help = "Model generic: Modbus function that reads, 3 holding or 4 input registers."},
    {"accel_register", SETTING_INT, FIELD(accel_register), .least = -1, .most = 65535, .unit = "",
     .preset = "-1",
     .help = "Model generic: first register of the acceleration's x, y, z; -1 none."},
    {"accel_format", SETTING_ENUM, FIELD(accel_format), .unit = "", .choices = modbus_formats,
     .preset = "s16", .help = "Model generic: how one acceleration is written."},
    {"accel_scale", SETTING_DOUBLE, FIELD(accel_scale), .least = -1000, .most = 1000,
     .unit = "m/s2", .preset = "0.0047884033",
     .help = "Model generic: acceleration per count; the preset is 16 g by 32768."},
    {"accel_offset", SETTING_DOUBLE, FIELD(accel_offset), .least = -4294967296.0,
     .most = 4294967296.0, .unit = "", .preset = "0",
     .help = "Model generic: counts added to an acceleration before scaling."},
    {"accel_axes", SETTING_VECTOR, FIELD(accel_axes), 3, -3, 3, .unit = "", .preset = "1 2 3",
     .help = "Driver iio and model generic: the sensor's axes (1, 2, 3, negative when turned "
             "round) that point to "
             "the screen's right, up and out."},
    {"angle_register", SETTING_INT, FIELD(angle_register), .least = -1, .most = 65535, .unit = "",
     .preset = "-1", .help = "Model generic: register of the tilt angle; -1 none."},
    {"angle_format", SETTING_ENUM, FIELD(angle_format), .unit = "", .choices = modbus_formats,
     .preset = "s16", .help = "Model generic: how the angle is written."},
    {"angle_scale", SETTING_DOUBLE, FIELD(angle_scale), .least = -1000, .most = 1000, .unit = "deg",
     .preset = "0.01", .help = "Model generic: angle per count; negative turns its sign."},
    {"angle_offset", SETTING_DOUBLE, FIELD(angle_offset), .least = -4294967296.0,
     .most = 4294967296.0, .unit = "", .preset = "0",
     .help = "Model generic: counts added to the angle before scaling."},
    {"word_order", SETTING_ENUM, FIELD(word_order), .unit = "", .choices = modbus_word_orders,
     .preset = "high-first", .help = "Model generic: order of the two registers of 32 bits."},
    {"sentinel", SETTING_DOUBLE, FIELD(sentinel), .least = ACCELEROMETER_NO_SENTINEL,
     .most = 4294967295.0, .unit = "", .preset = "-4294967296",
     .help = "Model generic: counts by which the sensor says that it has no reading; the preset is "
             "none."},
    {0},
};

const struct accelerometer_driver *const accelerometer_drivers[] = {&witmotion_driver, &iio_driver,
                                                                    NULL};

double tilt_of_gravity(struct vec3 gravity)
{
    return atan2(gravity.y, gravity.z) * (180 / M_PI);
}

double tilt_wrap(double deg)
{
    return deg - 360 * rint(deg / 360);
}

struct vec3 tilt_gravity_turned(double tilt_deg, const double turned_deg[3])
{
    const double rad = M_PI / 180;
    struct vec3 up = {0, sin(tilt_deg * rad), cos(tilt_deg * rad)}; // screen's axes
    struct mat3 screen_from_sensor = mat3_mul(
        mat3_rotation(0, turned_deg[0] * rad),
        mat3_mul(mat3_rotation(1, turned_deg[1] * rad), mat3_rotation(2, turned_deg[2] * rad)));
    return mat3_apply(mat3_transpose(screen_from_sensor), up);
}

// With f = tilt + a, turned as a, b, c: y = sin b sin c cos f + cos c sin f and
// z = cos b cos f are what the sensor reads as y / z = tan r.
double tilt_of_turned(double reading_deg, const double turned_deg[3])
{
    const double rad = M_PI / 180;
    double r = reading_deg * rad, b = turned_deg[1] * rad, c = turned_deg[2] * rad;
    double f = atan2((cos(b) * sin(r) - sin(b) * sin(c) * cos(r)) / cos(c), cos(r));
    return tilt_wrap(f / rad - turned_deg[0]);
}

const char *tilt_doubt_text(enum tilt_doubt doubt)
{
    switch (doubt) {
#define X(name, text)                                                                              \
    case TILT_##name:                                                                              \
        return text;
        TILT_DOUBTS(X)
#undef X
    }
    return "";
}

bool accelerometer_axes(const double axes[3], int out[3], struct error *err)
{
    int whole[3], seen = 0;
    for (int i = 0; i < 3; i++) {
        whole[i] = fabs(axes[i]) <= 3 ? (int)axes[i] : 0;
        if (whole[i] == axes[i] && whole[i] != 0)
            seen |= 1 << abs(whole[i]);
    }
    if (seen != (1 << 1 | 1 << 2 | 1 << 3))
        return fail(err, ERROR_CONFIG,
                    "accel_axes: %g %g %g are not 1, 2 and 3 in some order, each with its sign",
                    axes[0], axes[1], axes[2]);
    memcpy(out, whole, sizeof whole);
    return true;
}

struct vec3 accelerometer_turn(const int axes[3], struct vec3 sensor)
{
    const double from[] = {sensor.x, sensor.y, sensor.z};
    double to[3];
    for (int i = 0; i < 3; i++)
        to[i] = axes[i] > 0 ? from[axes[i] - 1] : -from[-axes[i] - 1];
    return (struct vec3){to[0], to[1], to[2]};
}

void tilt_judge(struct tilt_sample *s, bool has_gravity)
{
    bool weighs = !has_gravity || fabs(vec3_length(s->gravity) - gravity_m_s2) <= gravity_slack;
    bool agrees = !has_gravity || isnan(s->angle_deg) ||
                  fabs(tilt_wrap(s->tilt_deg - s->angle_deg)) <= agreement_deg;
    s->doubt = !isfinite(s->tilt_deg) ? TILT_NO_READING
               : !weighs              ? TILT_GRAVITY
               : !agrees              ? TILT_DISAGREE
                                      : TILT_NONE;
    s->plausible = s->doubt == TILT_NONE;
}
