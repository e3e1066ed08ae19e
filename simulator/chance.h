// SPDX-License-Identifier: Apache-2.0
// Chance that repeats: numbers drawn from a seed and a name of what they are
// for, so that adding a draw in one place changes none in another.
#ifndef SIMULATOR_CHANCE_H
#define SIMULATOR_CHANCE_H

#include <math.h>
#include <stdint.h>

// Running state of one stream; start it with chance_start.
struct chance {
    uint64_t state;
};

// A stream of its own for every seed, name and number.
static inline struct chance chance_start(uint64_t seed, const char *name, uint64_t number)
{
    uint64_t hash = 1469598103934665603u ^ seed * 0x9e3779b97f4a7c15u; // FNV-1a
    for (; *name; name++)
        hash = (hash ^ (unsigned char)*name) * 1099511628211u;
    return (struct chance){hash ^ number * 0xbf58476d1ce4e5b9u};
}

// Uniform in 0..1, 1 excluded. Source: splitmix64 (Steele, Lea, Flood 2014).
static inline double chance_uniform(struct chance *c)
{
    uint64_t z = c->state += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return (double)((z ^ (z >> 31)) >> 11) / 9007199254740992.0;
}

// Uniform in -1..1.
static inline double chance_either(struct chance *c)
{
    return 2 * chance_uniform(c) - 1;
}

// Mean 0, standard deviation 1 (Box and Muller 1958).
static inline double chance_normal(struct chance *c)
{
    double u = 1 - chance_uniform(c), v = chance_uniform(c);
    return sqrt(-2 * log(u)) * cos(2 * 3.14159265358979323846 * v);
}

#endif
