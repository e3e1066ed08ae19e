// SPDX-License-Identifier: Apache-2.0
// What tells the spectrometers of one protocol apart, as tables. See wires.md.
#ifndef SIMULATOR_MODEL_OOI_KIND_H
#define SIMULATOR_MODEL_OOI_KIND_H

#include <stdbool.h>
#include <stdint.h>

#include "simulator/model_detector.h"

#define OOI_KINDS(X)                                                                               \
    X(USB2000PLUS, "usb2000plus")                                                                  \
    X(USB4000, "usb4000")                                                                          \
    X(HR2000PLUS, "hr2000plus")                                                                    \
    X(HR4000, "hr4000")                                                                            \
    X(MAYA2000PRO, "maya2000pro")                                                                  \
    X(QE65000, "qe65000")

enum ooi_name {
#define X(name, text) OOI_##name,
    OOI_KINDS(X)
#undef X
        OOI_COUNT
};

struct ooi_kind {
    uint16_t product;        // USB product id
    const char *product_text;
    int pixels;              // values of a spectrum as transferred, padding included
    struct detector_zone zones[DETECTOR_ZONES_MOST];
    uint16_t inverted;       // bits sent upside down
    int saturation;          // raw counts at which the converter ends
    int saturation_at;       // where slot 17 tells it, u16
    double full;             // counts the vendor's axis ends at: full = saturation on it
    uint32_t least_us, most_us;
    uint32_t unit_us;        // of the integration time in commands and status
    int apart;               // bytes that come on endpoint 86 at high speed, first ones
    bool free_running;       // cycles without end, a request takes the one that runs
    bool cooled;
    const char *wavelength[4], *nonlinearity[8];
};

const struct ooi_kind *ooi_kind(enum ooi_name name);

#endif
