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
        {"map", light_map_command, "LIST.csv -o MAP.exr --config FILE | --size W,D [OPTION]...",
         "luminance map of the ceiling from an exposure series\n"
         "\n"
         "LIST.csv names PNG pictures of 8 or 16 bits beside it, \"FILE, SECONDS, KIND\" a line;\n"
         "KIND is light, dark (lens capped, the longest exposures) or flat (a field of equal\n"
         "luminance); without it light.\n"
         "\n"
         "  -o, --out MAP.exr        channels Y (cd/m2), sigma, clipped\n"
         "  --config FILE            boothd's settings: place and size of the ceiling\n"
         "  --size W,D               its size in metres; places are counted from its centre\n"
         "  --spot X,Z,CDM2          a reading of 10 mm of the ceiling at x, z in metres; may be\n"
         "                           repeated, up to 7 times\n"
         "  --measure                the radiometer reads such spots now, through boothd\n"
         "  --socket PATH            boothd's control socket (default: the settings', else the\n"
         "                           user's)\n"
         "  --booth PATH             control socket of an emulated booth\n"
         "  --corners X,Y,...        four corners in the picture: far left, far right, near\n"
         "                           right, near left (default: those of the lit field are found)\n"
         "  --top near|far|left|right  side of the ceiling on top of the picture, for corners\n"
         "                           that are found (default: near)\n"
         "  --inset M                the corners lie so many metres within the ceiling's edges\n"
         "  --camera FILE.ini        lens: [camera] width_px, height_px, fx_px, fy_px, cx_px,\n"
         "                           cy_px, k1, k2, p1, p2, k3, cos4, v2, v4, v6; [ceiling]\n"
         "                           top, inset_m\n"
         "  --lens K1,K2,P1,P2,K3    distortion; with --focal PX and, unless in the middle, "
         "--axis\n"
         "                           X,Y\n"
         "  --vignetting cos4|A,B,C  falloff of light: fourth power of the cosine, or 1 + A t2 +\n"
         "                           B t4 + C t6 of the tangent; pictures of the kind flat tell\n"
         "                           it better\n"
         "  --response robertson|debevec|linear|FILE.csv\n"
         "                           of the camera (default: robertson of 8 bits, linear of 16)\n"
         "  --save-response FILE.csv the response, \"code, exposure\" a line\n"
         "  --lamp NAME              noted in the map\n"
         "  --pixels W,H             of the map (default: 512 across, or what the camera resolves)\n"
         "  --png FILE.png           a picture of the map\n"
         "  --json                   what was found, as JSON\n"
         "\n"
         "Ends with 3 when the map is made but something about it is odd.\n"},
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
