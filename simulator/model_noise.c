// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_noise.h"

#include <math.h>

void noise_init(struct noise *noise, uint64_t seed, uint64_t stream)
{
    *noise = (struct noise){.state = seed};
    noise->state = noise_bits(noise) ^ (stream * UINT64_C(0xd1342543de82ef95));
}

uint64_t noise_bits(struct noise *noise)
{
    uint64_t z = noise->state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

double noise_even(struct noise *noise)
{
    return (double)(noise_bits(noise) >> 11) * 0x1p-53;
}

double noise_normal(struct noise *noise)
{
    if (noise->has_spare) {
        noise->has_spare = false;
        return noise->spare;
    }
    double a, b, r2;
    do {
        a = 2 * noise_even(noise) - 1;
        b = 2 * noise_even(noise) - 1;
        r2 = a * a + b * b;
    } while (r2 >= 1 || r2 == 0);
    double k = sqrt(-2 * log(r2) / r2);
    noise->spare = b * k;
    noise->has_spare = true;
    return a * k;
}

void noise_bytes(struct noise *noise, uint8_t *out, size_t size)
{
    for (size_t i = 0; i < size; i++)
        out[i] = (uint8_t)(noise_bits(noise) >> 56);
}
