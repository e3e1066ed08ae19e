// SPDX-License-Identifier: Apache-2.0
#include "calibration/light.h"

#include "calibration/commands.h"

int command_light(int argc, char **argv)
{
    static const struct command COMMANDS[] = {
        {"points", light_points_command, "MAP.exr --count N [OPTION]...",
         "light points of a luminance map by median cut\n"
         "\n"
         "  --count N              how many, 1..1048576; fewer where the map has fewer lit pixels\n"
         "  --cut energy|variance  halve the energy, or keep the parts small (default: variance)\n"
         "  --config FILE          boothd's settings: the ceiling's place in the booth; without\n"
         "                         them places are counted from the ceiling's centre\n"
         "  --scale K              luminance times K, such as a lamp's map_scale (default: 1)\n"
         "  -o, --out FILE.csv     where the points go (default: standard output)\n"
         "  --png FILE.png         a picture of the map with its points and their regions\n"
         "  --json                 the points as JSON on standard output\n"},
        {0}};
    return command_run("boothcal light", COMMANDS, argc, argv);
}
