// SPDX-License-Identifier: Apache-2.0
// What is believed now: which lamp and how bright, which tilt, where the eye
// is, each with its age and its confidence. Pure: samples and the time come
// in, the state comes out; a day of booth life runs in a second of test.
#ifndef DAEMON_STATE_H
#define DAEMON_STATE_H

#include "colorimetry/classifier.h"
#include "config/booth.h"
#include "daemon/eye.h"

// The newest sample of each instrument and its running number (base/mailbox.h);
// 0 = none yet.
struct samples {
    uint64_t spectrum_number, tilt_number, head_number;
    struct spectrum_sample spectrum;
    struct tilt_sample tilt;
    struct head_sample head;
};

#define STANDINGS(X)                                                                               \
    X(PRESET, "preset") /* nothing was ever seen: the settings' default */                         \
    X(FRESH, "fresh")   /* seen, and younger than its hold time */                                 \
    X(HELD, "held")     /* last good value; what came since could not be used */                   \
    X(STALE, "stale")   /* older than its hold time; nothing better is known */

enum standing {
#define X(name, text) STANDING_##name,
    STANDINGS(X)
#undef X
};

const char *standing_name(enum standing standing);

struct belief {
    enum standing standing;
    int64_t age_ns;    // since the light, gravity or head was as believed; 0 for PRESET
    double confidence; // 0..1; past the hold time it falls as hold/age
};

struct state {
    struct {
        struct belief belief;
        enum lamp_verdict verdict; // of the newest readings
        int index;                 // lamp to proof under, -1 = none
        double level;              // smoothed live over taught level of that lamp
        double lux;                // live, at the spectrometer
        double distance;           // to the nearest taught lamp
    } lamp;
    struct {
        struct belief belief;
        double deg; // smoothed while it rests
    } tilt;
    struct {
        struct belief belief;
        struct vec3 at; // booth frame, m, when the light of a frame drawn now leaves the screen
    } eye;
};

// What one instrument's belief remembers.
struct memory {
    uint64_t number;   // of the last sample looked at
    int64_t seen_ns;   // latest instant of the last good sample; valid when ever
    bool ever, usable; // a good sample was ever seen; the newest one was good
    double confidence; // of the last good sample
};

// Plain data, owned by the main thread.
struct estimator {
    struct state_settings limits;
    struct classifier classifier;
    struct rigid booth_from_tracker;
    double turned_deg[3]; // of the inclinometer on the screen
    int64_t now_ns; // of the last call
    struct memory lamp, tilt, eye;
    struct state state;
    struct eye_track track;
    int level_readings; // of the lamp now on
    int level_steps;    // readings in a row beyond LEVEL_STEP on one side, signed
};

// taught may hold no lamp; its limits come from settings.
void estimator_init(struct estimator *e, const struct booth_settings *settings,
                    const struct classifier *taught);

// New settings and lamps, keeping what is believed of tilt and eye. The next
// reading decides on the lamp without waiting for a second one.
void estimator_change(struct estimator *e, const struct booth_settings *settings,
                      const struct classifier *taught);

// Takes what is new in seen and says what is believed at now_ns.
// - Lamp: the classifier's verdict. Unknown light keeps the last lamp for
//   lamp_hold_s and then gives none: a proof under light that is not the one
//   shown would be wrong. A silent or saturated spectrometer keeps it for
//   good, STALE after lamp_hold_s: nothing says that the light changed.
//   Without a spectrometer the lamp that the settings declare is on, PRESET.
// - Level: averaged from the first reading on, then smoothed over level_s; two
//   readings in a row more than 3 % off on the same side are a dimmer's work
//   and count at once.
// - Tilt: the reading, less how the sensor is turned, smoothed over tilt_s while within 0.3 degrees, else taken at once;
//   implausible samples are passed over.
// - Eye: smoothed and carried on to the time of the frame's light (eye.h); lost
//   or ambiguous markers keep the last place.
// Samples older than one already used are passed over. When now_ns goes back,
// ages start again from 0.
struct state estimate(struct estimator *e, const struct samples *seen, int64_t now_ns);

#endif
