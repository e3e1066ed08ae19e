// SPDX-License-Identifier: Apache-2.0
#include "drivers/radiometer.h"

#include "drivers/pr655.h"

#define FIELD(name) SETTING_FIELD(struct radiometer_options, name)
#define SIZE(name) SETTING_SIZE(struct radiometer_options, name)

const struct setting radiometer_settings[] = {
    {"port", SETTING_TEXT, FIELD(port), SIZE(port), .unit = "", .preset = "",
     .help = "Serial line of the spectroradiometer; empty when there is none."},
    {"average", SETTING_INT, FIELD(average), .least = 1, .most = 99, .unit = "", .preset = "1",
     .help = "Measurements averaged into one sample."},
    {0},
};

const struct radiometer_driver *const radiometer_drivers[] = {&pr655_driver, NULL};
