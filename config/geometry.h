// SPDX-License-Identifier: Apache-2.0
// geometry.ini: where stand and tracker were found to be. The rows of boothd.conf
// by their own names, those that were found and no others, and what is known
// of them. boothcal tilt and tracker write it, boothd loads it from the store.
#ifndef CONFIG_GEOMETRY_H
#define CONFIG_GEOMETRY_H

#include "config/booth.h"

// How well the rows are known, k = 2, in the units of the rows; 0 = not fitted.
struct geometry_uncertainty {
    double hinge_m[3], centre_from_hinge_m[3], turned_deg[3];
    double place_m[3], pitch_deg, yaw_deg, roll_deg;
};

struct geometry_origin {
    char stand_at[24], tracker_at[24]; // UTC, "" = never
    int stand_poses, tracker_points;
    char software[64];
};

// Plain data.
struct geometry {
    unsigned rows;               // 1 << enum booth_stored, from STORED_HINGE on: those it holds
    struct booth_settings booth; // only those rows of it count
    struct geometry_uncertainty uncertainty;
    struct geometry_origin origin;
};

// Errors name file, line, key, value and what is allowed.
bool geometry_load(const char *path, struct geometry *out, struct error *err);
bool geometry_save(const char *path, const struct geometry *geometry, struct error *err);

// Its rows as they stand in boothd.conf.
void geometry_print(const struct geometry *geometry, FILE *out);

// Copies the rows of a mask from one booth's settings to another's.
void geometry_take(struct booth_settings *to, const struct booth_settings *from, unsigned rows);

// Those rows of a mask in which two booths' settings differ.
unsigned geometry_differs(const struct booth_settings *a, const struct booth_settings *b,
                          unsigned rows);

#endif
