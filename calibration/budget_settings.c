// SPDX-License-Identifier: Apache-2.0
#include "calibration/budget.h"
#include "files/ini.h"

#define U(field, most, unit, preset, help)                                                         \
    {                                                                                              \
#field, SETTING_DOUBLE, offsetof(struct uncertainties, field), 0, 0, most, unit, NULL,     \
            preset, help                                                                           \
    }
#define WAVES(field, preset, help)                                                                 \
    {                                                                                              \
#field, SETTING_INT, offsetof(struct uncertainties, field), 0, 1, 10, "", NULL, preset,    \
            help                                                                                   \
    }

const struct setting uncertainty_settings[] = {
    U(spectrometer_nm, 10, "nm", "0.15", "Spectrometer: of its whole wavelength scale."),
    U(spectrometer_stretch_nm, 10, "nm", "0.1",
      "Spectrometer: of its scale at 380 and 780 nm against 580 nm."),
    U(spectrometer_slope, 0.5, "", "0.01",
      "Spectrometer: relative slope of its calibration over 180 nm."),
    U(spectrometer_relative, 0.5, "", "0.005",
      "Spectrometer: relative, of its calibration, smooth in wavelength."),
    WAVES(spectrometer_waves, "3",
          "Spectrometer: how smooth: the error is of 1 to so many waves over 380..780 nm."),
    U(spectrometer_stray, 0.1, "", "0.0005",
      "Spectrometer: light where there is none, over the mean of 380..780 nm."),
    U(radiometer_level, 0.5, "", "0.01", "Radiometer: of luminance, relative."),
    U(radiometer_relative, 0.5, "", "0.003",
      "Radiometer: relative, of its calibration, smooth in wavelength."),
    WAVES(radiometer_waves, "3",
          "Radiometer: how smooth: the error is of 1 to so many waves over 380..780 nm."),
    U(radiometer_nm, 10, "nm", "0.15", "Radiometer: of its whole wavelength scale."),
    U(radiometer_bandwidth_nm, 50, "nm", "8",
      "Radiometer: width of its band where nothing corrects for it; 0 = corrected."),
    U(radiometer_repeat, 0.1, "", "0.001",
      "Radiometer: of one reading, relative, alike in X, Y and Z."),
    U(radiometer_colour, 0.1, "", "0.0006",
      "Radiometer: of one reading, relative, X, Y and Z each."),
    U(map_shape, 0.5, "", "0.02", "Luminance map: of its edge over its centre, relative."),
    U(level, 0.5, "", "0.002", "Lamp: of its level since it was taught, relative."),
    U(tilt_deg, 10, "deg", "0.1", "Tilt of the screen."),
    U(place_m, 0.1, "m", "0.001", "Centre of the screen, up and towards the observer."),
    U(eye_m, 0.5, "m", "0.01", "Eye, across the line of sight."),
    U(angle_fall, 10, "", "1.57", "k of the panel's luminance exp(-k sin^2) over the angle."),
    U(display_drift, 0.5, "", "0.003", "Display: drift since it was characterised, relative."),
    U(reflection, 1, "", "0.1", "Display: of its surface's reflectance, relative."),
    {0},
};

bool uncertainties_load(const char *path, struct uncertainties *out, struct error *err)
{
    struct uncertainties u;
    const struct settings_section sections[] = {{"uncertainty", uncertainty_settings, &u}, {0}};
    settings_preset(uncertainty_settings, &u);
    if (path && *path && !ini_load(path, sections, err))
        return false;
    *out = u;
    return true;
}
