// SPDX-License-Identifier: Apache-2.0
// opentrack's output "UDP over network": a pose of the head as a datagram of
// 48 bytes, six little-endian doubles x, y, z (cm) and yaw, pitch, roll (deg),
// at a rate of its own. See wires.md.
#ifndef SIMULATOR_MODEL_OPENTRACK_H
#define SIMULATOR_MODEL_OPENTRACK_H

#include "simulator/around.h"

enum { OPENTRACK_VALUES = 6, OPENTRACK_SIZE = 48, OPENTRACK_MOST = 96 };

struct opentrack_options {
    struct around around; // with a head
    double rate_hz;
    struct vec3 zero; // m, in the tracker's frame: where x, y and z are 0
    bool mirrored;    // its camera's picture is; else x, yaw and roll have the other sign
    uint64_t seed;
};

struct opentrack;

// NULL when out of memory.
struct opentrack *opentrack_create(const struct opentrack_options *options);
void opentrack_destroy(struct opentrack *source);

// The datagram that is due: its size, or -EAGAIN. *again_ns is when the next
// one is due. What was missed is not made up for. now_ns never goes back.
int opentrack_out(struct opentrack *source, int64_t now_ns, uint8_t out[OPENTRACK_MOST],
                  int64_t *again_ns);

// How datagrams go wrong. NOT_A_NUMBER: one value is NaN or infinite, another
// one each time. FROZEN: the last one again and again. WRONG_SIZE: 0, 47, 49,
// 96 bytes by turns. OUT_OF_RANGE: one value is far beyond any room or turn.
enum opentrack_upset {
    OPENTRACK_WELL,
    OPENTRACK_NOT_A_NUMBER,
    OPENTRACK_FROZEN,
    OPENTRACK_WRONG_SIZE,
    OPENTRACK_OUT_OF_RANGE,
};
void opentrack_upset(struct opentrack *source, enum opentrack_upset how);

// x, y, z, yaw, pitch, roll as they are sent.
void opentrack_bytes(const double values[OPENTRACK_VALUES], uint8_t out[OPENTRACK_SIZE]);

// Yaw (+ to the wearer's left), pitch (+ up), roll (+ left ear up), in degrees,
// of a rotation of a head whose axes are right, up and backwards: first roll,
// then pitch, then yaw. Source: opentrack's point tracker, with a mirrored picture.
struct opentrack_angles {
    double yaw_deg, pitch_deg, roll_deg;
};
struct opentrack_angles opentrack_angles(const struct mat3 *turn);

#endif
