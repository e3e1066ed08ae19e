// SPDX-License-Identifier: Apache-2.0
// From any inclinometer or accelerometer to the screen's tilt.
#ifndef DRIVERS_ACCELEROMETER_H
#define DRIVERS_ACCELEROMETER_H

#include "base/linear.h"
#include "drivers/spectrometer.h"

#define TILT_DOUBTS(X)                                                                             \
    X(NONE, "good")                                                                                \
    X(NO_READING, "the sensor has no reading")                                                     \
    X(GRAVITY, "gravity is not 9.81 m/s2")                                                         \
    X(DISAGREE, "angle and acceleration disagree: is the map right?")

enum tilt_doubt {
#define X(name, text) TILT_##name,
    TILT_DOUBTS(X)
#undef X
};

const char *tilt_doubt_text(enum tilt_doubt doubt);

struct tilt_sample {
    struct interval taken;
    struct vec3 gravity; // m/s2 in the sensor's axes: z out of the screen, x right, y up along it;
                         // 0 0 0 from a sensor that only knows its angle
    double tilt_deg;  // screen plane against horizontal: 0 lies flat face up, 90 upright; -180..180
    double angle_deg; // the same from the sensor's own angle registers, NAN when it has none
    bool plausible;   // |gravity| within 9.81 +- 0.3 m/s2 and both tilts agree within 2 degrees
    enum tilt_doubt doubt; // why it is not plausible, NONE when it is
};

#define ACCELEROMETER_NO_SENTINEL (-4294967296.0) // no register reaches it

struct accelerometer_options {
    char port[128];      // "/dev/ttyUSB0", or "host:port" for Modbus TCP
    int unit;            // Modbus unit id 1..247
    int baud;            // 1200..921600
    int model;           // index into accelerometer_models
    double offset_deg;   // added to tilt, -180..180
    char iio_device[64]; // driver iio: name, label or "iio:deviceN", "" = the first one
    // Of the register map "generic" (accel_axes also of driver iio); see modbus_map.h.
    int function;                       // 3 or 4
    int accel_register, angle_register; // 0..65535, -1 = none
    int accel_format, angle_format;     // index into modbus_formats
    int word_order;                     // index into modbus_word_orders
    double accel_scale, accel_offset;   // m/s2 per count; counts
    double angle_scale, angle_offset;   // deg per count; counts
    double accel_axes[3];               // screen's x, y, z as +-1, +-2, +-3
    double sentinel;                    // counts, ACCELEROMETER_NO_SENTINEL = none
};

extern const struct setting accelerometer_settings[];
extern const char *const accelerometer_models[]; // "wt901c485", "hwt9073", "generic", NULL

struct accelerometer;

// As spectrometer_driver, each function alike. Records: "witmotion", "iio".
struct accelerometer_driver {
    const char *name;
    struct accelerometer *(*open)(const struct accelerometer_options *options, int64_t deadline_ns,
                                  struct error *err);
    bool (*read)(struct accelerometer *device, int64_t deadline_ns, struct tilt_sample *out,
                 struct error *err);
    void (*identify)(const struct accelerometer *device, struct instrument_identity *out);
    void (*close)(struct accelerometer *device);
    bool portless; // it needs no options->port
};

extern const struct accelerometer_driver *const accelerometer_drivers[];

// Tilt from gravity in the sensor's axes by atan2 forms, right at +-90 degrees:
// (0, 0, g) is 0, (0, g, 0) is 90. Source: Freescale AN3461 (2013), eq. 25-26.
double tilt_of_gravity(struct vec3 gravity);

// The same angle within -180..180.
double tilt_wrap(double deg);

// accel_axes as whole numbers; CONFIG unless they are 1, 2, 3 in some order,
// each with its sign.
bool accelerometer_axes(const double accel_axes[3], int out[3], struct error *err);

// The sensor's vector along the screen's axes.
struct vec3 accelerometer_turn(const int axes[3], struct vec3 sensor);

// How a sensor is turned on the screen: from the screen's axes about their right
// by the first angle, then about its own up by the second, then about its own
// out by the third, degrees, right-handed.
//
// The unit vector of gravity's opposite in such a sensor's axes, at a tilt of
// the screen; turned as 0 0 0 gives (0, sin tilt, cos tilt).
struct vec3 tilt_gravity_turned(double tilt_deg, const double turned_deg[3]);

// The screen's tilt from the tilt that such a sensor reads: the inverse of
// tilt_of_gravity(tilt_gravity_turned(tilt, turned)), -180..180. The second and third
// angle must be within -80..80.
double tilt_of_turned(double reading_deg, const double turned_deg[3]);

// Fills plausible and doubt from the rest; has_gravity is false for a sensor
// that only knows its angle, angle_deg NAN for one that does not.
void tilt_judge(struct tilt_sample *sample, bool has_gravity);

#endif
