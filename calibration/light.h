// SPDX-License-Identifier: Apache-2.0
// What the subcommands of boothcal light share.
#ifndef CALIBRATION_LIGHT_H
#define CALIBRATION_LIGHT_H

#include "render/lights.h"

// Writes an RGB picture of a map, the cube root of luminance as grey, 1024
// pixels wide or more; lights (may be NULL) as red discs and the regions they
// stand for (lights->count of them) as blue frames.
bool light_picture(const char *path, const struct luminance_map *map,
                   const struct light_points *lights, const struct pixels *regions,
                   struct error *err);

// The subcommands; argv[0] is the subcommand's own name.
int light_teach_command(int argc, char **argv);
int light_map_command(int argc, char **argv);
int light_list_command(int argc, char **argv);
int light_points_command(int argc, char **argv);

#endif
