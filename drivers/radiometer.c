// SPDX-License-Identifier: Apache-2.0
#include "drivers/radiometer.h"

#include "drivers/pr655.h"
#include "drivers/spotread.h"

#define FIELD(name) SETTING_FIELD(struct radiometer_options, name)
#define SIZE(name) SETTING_SIZE(struct radiometer_options, name)

const struct setting radiometer_settings[] = {
    {"port", SETTING_TEXT, FIELD(port), SIZE(port), .unit = "", .preset = "",
     .help = "Serial line of the spectroradiometer; empty when there is none."},
    {"average", SETTING_INT, FIELD(average), .least = 1, .most = 99, .unit = "", .preset = "1",
     .help = "Measurements averaged into one sample."},
    {"program", SETTING_TEXT, FIELD(program), SIZE(program), .unit = "", .preset = "spotread",
     .help = "Driver spotread: ArgyllCMS's spotread, by name or whole path."},
    {"arguments", SETTING_TEXT, FIELD(arguments), SIZE(arguments), .unit = "", .preset = "",
     .help = "Driver spotread: more of its options, such as -c 1 -y l -X panel.ccss."},
    {"calibrate", SETTING_BOOL, FIELD(calibrate), .unit = "", .preset = "no",
     .help = "Driver spotread: let it calibrate when it asks at the start; the instrument must lie "
             "on its calibration position then."},
    {0},
};

const struct radiometer_driver *const radiometer_drivers[] = {&pr655_driver, &spotread_driver,
                                                              NULL};
