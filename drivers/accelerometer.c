// SPDX-License-Identifier: Apache-2.0
#include "drivers/accelerometer.h"

#include "drivers/witmotion.h"

#define FIELD(name) SETTING_FIELD(struct accelerometer_options, name)
#define SIZE(name) SETTING_SIZE(struct accelerometer_options, name)

const char *const accelerometer_models[] = {"wt901c485", "hwt9073", NULL};

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
    {0},
};

const struct accelerometer_driver *const accelerometer_drivers[] = {&witmotion_driver, NULL};

double tilt_of_gravity(struct vec3 gravity)
{
    return atan2(gravity.y, gravity.z) * (180 / M_PI);
}
