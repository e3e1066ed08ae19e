// SPDX-License-Identifier: Apache-2.0
#include "calibration/light.h"

#include "calibration/commands.h"

int command_light(int argc, char **argv)
{
    static const struct command COMMANDS[] = {
        {"teach", light_teach_command, "NAME --config FILE [OPTION]...",
         "teaches a lamp: its spectrum, once its light stands still\n"
         "\n"
         "  --config FILE      boothd's settings; NAME.ini and NAME.sp go to their lamp folder\n"
         "  --socket PATH      boothd's control socket (default: the settings', else the user's)\n"
         "  --booth PATH       control socket of an emulated booth; without it you are asked to\n"
         "                     switch the lamp\n"
         "  --map FILE.exr     the lamp's luminance map, made absolute by spot readings; without\n"
         "                     it the map of an earlier teaching stays\n"
         "  --drift PERCENT    it stands still when it changes by less a minute (default: 0.5)\n"
         "  --wait S           it is waited for at most so long (default: 1800)\n"
         "  --readings N       averaged (default: 20)\n"
         "  --json             what was found, as JSON\n"
         "\n"
         "A lamp that could not be told from another taught one is refused. Ends with 3 when it\n"
         "is close to one.\n"},
        {"list", light_list_command, "--config FILE | --lamps FOLDER [--json]",
         "the taught lamps\n"
         "\n"
         "  --config FILE   boothd's settings: their lamp folder, and how unlike lamps must be\n"
         "  --lamps FOLDER  another lamp folder\n"
         "  --json          as JSON, with the distance of every pair\n"
         "\n"
         "Ends with 3 when two of them are close or cannot be told apart.\n"},
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
