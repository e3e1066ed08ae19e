// SPDX-License-Identifier: Apache-2.0
// boothcal: colours, a display's model, bands, and a session from bare settings to its report, the spectrometer.
#include <stdio.h>
#include <string.h>

#include "calibration/commands.h"
#include "files/write.h"

static const struct command FAMILIES[] = {
    {"colour", command_colour, "deltae|spectrum", "colour differences; colours of spectra"},
    {"display", command_display, "measure|view|fit|check|verify|forward|inverse|export", "the display model of a panel"},
    {"bands", command_bands, "optimise|check", "the bands that carry reflectances"},
    {"light", command_light, "teach|map|points|list", "the lamps of the booth and their luminance maps"},
    {"session", command_session, "--config FILE --maps FOLDER -o FOLDER",
     "from bare settings to an accuracy report"},
    {"verify", command_verify, "--config FILE [--published-mean T] ...",
     "whether the proof keeps to tolerances under the lamp that is on"},
    {"report", command_report, "FOLDER | --check FILE...",
     "a session's facts made into a sealed report with uncertainties"},
    {"spectrometer", command_spectrometer, "dark|wavelength|linearity|raw",
     "calibrating the spectrometer itself: stored darks, wavelengths, linearity"},
    {"audit", command_audit, "SPECTRUM... | --lamps FOLDER | --config FILE --lamp NAME...",
     "what the spectrometer alone can tell of a booth's lamps"},
    {"list", command_list, "[--config FILE] [--json] | --udev",
     "instruments found, their serial numbers and permissions; the udev rules"},
    {"tilt", command_tilt, "--config FILE [--poses FILE.csv] [OPTION]...",
     "hinge, screen and inclinometer from poses of the stand"},
    {"tracker", command_tracker, "--config FILE [--points FILE.csv] [OPTION]...",
     "place of the head tracker from its marker held before the screen"},
    {"keep", command_keep, "--config FILE [--display D.ini] [--lamp NAME.ini] [OPTION]...",
     "makes single results a new version of the store of calibrations"},
    {"history", command_history, "--config FILE [--verify] [--json]",
     "the calibrations of a booth and its display in the store"},
    {"diff", command_diff, "--config FILE A [B] [--json]",
     "by how much two of them differ: CIEDE2000, per cent, metres"},
    {"use", command_use, "--config FILE N", "puts one of them in force"},
    {NULL, NULL, NULL, NULL},
};

int main(int argc, char **argv)
{
    int code = COMMAND_FINE;
    files_take_pipes();
    if (argc == 2 && !strcmp(argv[1], "--version"))
        printf("boothcal %s\n", BOOTHD_VERSION);
    else
        code = command_run("boothcal", FAMILIES, argc, argv);
    if (argc >= 2 && (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h")))
        printf("  boothcal --version\n  boothcal FAMILY --help\n");
    if (fflush(stdout) || ferror(stdout)) {
        fprintf(stderr, "boothcal: standard output cannot be written\n");
        return COMMAND_FAILED;
    }
    return code;
}
