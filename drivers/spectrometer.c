// SPDX-License-Identifier: Apache-2.0
#include "drivers/spectrometer.h"

#include "drivers/ocean.h"
#include "drivers/replay.h"

#define FIELD(name) SETTING_FIELD(struct spectrometer_options, name)
#define SIZE(name) SETTING_SIZE(struct spectrometer_options, name)

const char *spectrometer_status_name(enum spectrometer_status status)
{
    switch (status) {
#define X(name, text)                                                                              \
    case SPECTROMETER_##name:                                                                      \
        return text;
        SPECTROMETER_STATUSES(X)
#undef X
    }
    return "unknown";
}

static const char *const bend_names[] = {"above dark", "as read", "off", NULL};
static const char *const unit_names[] = {"uW/cm2/nm", "mW/m2/nm", "W/m2/nm", NULL};

const struct setting spectrometer_settings[] = {
    {"serial", SETTING_TEXT, FIELD(serial), SIZE(serial), .unit = "", .preset = "",
     .help = "Serial number of the spectrometer; empty takes the first one found."},
    {"calibration", SETTING_TEXT, FIELD(calibration), SIZE(calibration), .unit = "", .preset = "",
     .help = "CSV file \"nm,uJ_per_count\" of this very unit and its cosine corrector."},
    {"collector_mm2", SETTING_DOUBLE, FIELD(collector_mm2), .least = 0.01, .most = 10000,
     .unit = "mm2", .preset = "11.95", .help = "Area of the cosine corrector."},
    {"mains_hz", SETTING_DOUBLE, FIELD(mains_hz), .least = 50, .most = 60, .unit = "Hz",
     .preset = "50", .help = "Exposures of half a mains period and more are its multiples."},
    {"integration_us", SETTING_INT, FIELD(integration_us), .least = 1000, .most = 65535000,
     .unit = "us", .preset = "100000", .help = "First exposure; later ones follow the light."},
    {"longest_us", SETTING_INT, FIELD(longest_us), .least = 1000, .most = 65535000, .unit = "us",
     .preset = "200000",
     .help = "Longest exposure chosen by itself: in the dark a reading takes three of them."},
    {"average", SETTING_INT, FIELD(average), .least = 1, .most = 100, .unit = "", .preset = "1",
     .help = "Readings averaged into one sample."},
    {"boxcar", SETTING_INT, FIELD(boxcar), .least = 0, .most = 100, .unit = "px", .preset = "0",
     .help = "Half width of the moving mean over pixels; 0 keeps the full resolution."},
    {"nonlinearity", SETTING_ENUM, FIELD(nonlinearity), .unit = "", .choices = bend_names,
     .preset = "above dark",
     .help = "What the unit's linearity polynomial is over: as its calibration was made."},
    {"darks", SETTING_TEXT, FIELD(darks), SIZE(darks), .unit = "", .preset = "",
     .help =
         "CSV of stored dark spectra, by boothcal spectrometer dark: a row a pixel, a column an "
         "exposure in us (us100000x20: mean of 20); empty: optically black pixels only."},
    {"wavelength_nm", SETTING_VECTOR, FIELD(wavelength_nm), .size = 4, .least = -10000,
     .most = 10000, .unit = "nm", .preset = "0 0 0 0",
     .help =
         "Wavelength coefficients over pixel^0..3, by boothcal spectrometer wavelength; zeroes: "
         "the unit's own."},
    {"file", SETTING_TEXT, FIELD(file), SIZE(file), .unit = "", .preset = "",
     .help = "Driver replay: file of OceanView, SpectraSuite, Jaz, a .sp or \"nm, value\"."},
    {"file_unit", SETTING_ENUM, FIELD(file_unit), .unit = "", .choices = unit_names,
     .preset = "uW/cm2/nm", .help = "Driver replay: unit of the file's values."},
    {"reference", SETTING_TEXT, FIELD(reference), SIZE(reference), .unit = "", .preset = "",
     .help = "Driver replay: file of the irradiance behind the reference column of a Jaz file, in "
             "file_unit; its raw counts then count, as they do with a calibration."},
    {0},
};

const struct spectrometer_driver *const spectrometer_drivers[] = {&ocean_driver, &replay_driver,
                                                                  NULL};
