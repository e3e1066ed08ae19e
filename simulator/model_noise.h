// SPDX-License-Identifier: Apache-2.0
// Noise that comes out the same for the same seed on every machine.
#ifndef SIMULATOR_MODEL_NOISE_H
#define SIMULATOR_MODEL_NOISE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct noise {
    uint64_t state;
    double spare;
    bool has_spare;
};

// Streams of one seed are independent of each other.
void noise_init(struct noise *noise, uint64_t seed, uint64_t stream);

// 64 random bits. Source: splitmix64 (Steele, Lea, Flood 2014).
uint64_t noise_bits(struct noise *noise);

// Even in [0, 1).
double noise_even(struct noise *noise);

// Normal with mean 0 and standard deviation 1 (Marsaglia's polar method, 1964).
double noise_normal(struct noise *noise);

void noise_bytes(struct noise *noise, uint8_t *out, size_t size);

#endif
