// SPDX-License-Identifier: Apache-2.0
// From an exposure series of the ceiling to its luminance map.
#ifndef CALIBRATION_CEILING_PHOTO_H
#define CALIBRATION_CEILING_PHOTO_H

#include "calibration/ceiling_view.h"
#include "calibration/spots.h"

enum response_source {
    CURVE_AUTO, // Robertson's of 8 bits, linear of 16
    CURVE_ROBERTSON,
    CURVE_DEBEVEC,
    CURVE_LINEAR,
    CURVE_FILE
};

struct ceiling_recipe {
    const char *list; // of the pictures, see photos.h
    struct still_camera camera;
    enum response_source response;
    const char *response_file; // CURVE_FILE
    struct ceiling ceiling;
    bool corners_given;      // else they are found
    double corner_px[4][2];  // far left, far right, near right, near left
    enum ceiling_side top;   // of the picture, when they are found
    double inset_m;          // of the corners within the ceiling's edges
    int width_px, height_px; // of the map, 1..8192; 0: 512 across or fewer, as the camera
                             // resolves, and as good as square
};

// What came of it.
struct ceiling_photo {
    struct ceiling_picture picture; // owned; light not yet in cd/m2
    double corner_px[4][2];
    int pictures, hot;
    struct response responses[3]; // owned
    double method_difference;     // rms of Robertson's and Debevec's responses; NAN unless both
    double noise;                 // see hdr.h
    double off;                   // greatest |off| of a picture, and which
    char off_path[512];
    double clipped; // share of the ceiling
};

void ceiling_photo_fini(struct ceiling_photo *p); // accepts a zeroed one

// Errors: those of photos_load, response_find and ceiling_view_make; DATA when
// pictures contradict each other by 30 % and more, or all of the ceiling is clipped.
bool ceiling_photo_take(const struct ceiling_recipe *recipe, struct ceiling_photo *out,
                        struct error *err);

// The picture as a map of that ceiling, not yet in cd/m2; clipped pixels, whose
// luminance is not known, are 0 there. Free with luminance_map_fini.
bool ceiling_photo_map(const struct ceiling_photo *photo, const struct ceiling *ceiling,
                       struct luminance_map *out, struct error *err);

// What the command or the session knows besides.
struct ceiling_origin {
    char lamp[64];
    struct spot_scale spots;
};

// Writes light times scale.scale as channel Y (cd/m2), its standard uncertainty
// from noise as "sigma", the share of a pixel that is clipped as "clipped";
// attributes boothd.width_m, boothd.depth_m, boothd.scale, boothd.clipped,
// boothd.lamp, boothd.software, boothd.created. Whole or not there.
bool ceiling_photo_save(const char *path, const struct ceiling_photo *photo,
                        const struct ceiling *ceiling, const struct ceiling_origin *origin,
                        struct error *err);

#endif
