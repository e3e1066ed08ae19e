// SPDX-License-Identifier: Apache-2.0
// Numbers drawn by chance that repeat: the same seed gives the same numbers on
// every machine. Not for secrets.
#ifndef BASE_RANDOM_H
#define BASE_RANDOM_H

#include <math.h>
#include <stdint.h>

// Running state; any start is as good as any other.
struct random {
    uint64_t state;
};

// 64 random bits. Source: splitmix64 (Steele, Lea, Flood 2014).
static inline uint64_t random_bits(struct random *r)
{
    uint64_t z = (r->state += UINT64_C(0x9e3779b97f4a7c15));
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

// A stream of its own for every seed and number.
static inline struct random random_stream(uint64_t seed, uint64_t number)
{
    struct random r = {seed};
    r.state = random_bits(&r) ^ (number * UINT64_C(0xd1342543de82ef95));
    return r;
}

// Even in 0..1, 1 excluded.
static inline double random_uniform(struct random *r)
{
    return (double)(random_bits(r) >> 11) / 9007199254740992.0;
}

// Mean 0, standard deviation 1 (Box, Muller 1958).
static inline double random_normal(struct random *r)
{
    double u = 1 - random_uniform(r), v = random_uniform(r);
    return sqrt(-2 * log(u)) * cos(2 * 3.14159265358979323846 * v);
}

#endif
