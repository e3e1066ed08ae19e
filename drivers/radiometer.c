// SPDX-License-Identifier: Apache-2.0
#include "drivers/radiometer.h"

#include <math.h>

#include "drivers/pr655.h"
#include "drivers/spotread.h"

#define FIELD(name) SETTING_FIELD(struct radiometer_options, name)
#define SIZE(name) SETTING_SIZE(struct radiometer_options, name)

const char *const radiometer_spectral_names[] = {"auto", "yes", "no", NULL};

const struct setting radiometer_settings[] = {
    {"port", SETTING_TEXT, FIELD(port), SIZE(port), .unit = "", .preset = "",
     .help = "Serial line of the spectroradiometer; empty when there is none."},
    {"average", SETTING_INT, FIELD(average), .least = 1, .most = RADIOMETER_AVERAGE_MOST,
     .unit = "", .preset = "1",
     .help = "Measurements averaged into one sample; they must agree within 3 %."},
    {"program", SETTING_TEXT, FIELD(program), SIZE(program), .unit = "", .preset = "spotread",
     .help = "Driver spotread: ArgyllCMS's spotread, by name or whole path."},
    {"arguments", SETTING_TEXT, FIELD(arguments), SIZE(arguments), .unit = "", .preset = "",
     .help = "Driver spotread: more of its options, such as -c 1 -y l -X panel.ccss."},
    {"calibrate", SETTING_BOOL, FIELD(calibrate), .unit = "", .preset = "no",
     .help = "Driver spotread: let it calibrate when it asks at the start; the instrument must lie "
             "on its calibration position then."},
    {"spectral", SETTING_ENUM, FIELD(spectral), .unit = "", .choices = radiometer_spectral_names,
     .preset = "auto",
     .help = "Driver spotread: ask for spectra: where the instrument has them (auto), always, or "
             "never. A colorimeter has none; auto starts spotread twice to find out."},
    {0},
};

const struct radiometer_driver *const radiometer_drivers[] = {&pr655_driver, &spotread_driver,
                                                              NULL};

bool radiometer_agree(const double *luminance, int count, struct error *err)
{
    const double relative = 0.03, least = 0.02;
    double mean = 0, lowest = luminance[0], highest = luminance[0];
    for (int i = 0; i < count; i++) {
        mean += luminance[i] / count;
        lowest = fmin(lowest, luminance[i]);
        highest = fmax(highest, luminance[i]);
    }
    return fmax(highest - mean, mean - lowest) <= fmax(relative * fabs(mean), least) ||
           fail(err, ERROR_RETRY, "%d readings of %.4g to %.4g cd/m2 do not agree", count, lowest,
                highest);
}
