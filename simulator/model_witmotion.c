// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_witmotion.h"

#include <math.h>
#include <string.h>

#include "base/clock.h"

enum address {
    SAVE = 0x00,
    RATE = 0x03,
    BAUD = 0x04,
    UNIT = 0x1A,
    BANDWIDTH = 0x1F,
    LAST_SETTING = 0x2D,
    VERSION = 0x2E,
    ACC = 0x34,
    GYRO = 0x37,
    MAG = 0x3A,
    ROLL = 0x3D,
    TEMPERATURE = 0x40,
    PRECISE_ROLL = 0x3D,
    PRECISE_TEMPERATURE = 0x43,
    QUATERNION = 0x51,
    KEY = 0x69,
    NUMBER = 0x7F,
};

enum { KEY_OPEN = 0xB588, BAUD_9600 = 2, RATE_10_HZ = 6 };

#define STANDARD_G 9.80665
#define ANGLE_NOISE_DEG 0.02
#define PRECISE_NOISE_DEG 0.005
#define ACC_NOISE_G (ANGLE_NOISE_DEG * (M_PI / 180))
#define UNLOCKED_NS (10 * NS_PER_S)

static uint16_t word(double value)
{
    double limited = fmin(fmax(round(value), -32768), 32767);
    return (uint16_t)(int16_t)limited;
}

static uint16_t angle_word(double degrees)
{
    double wrapped = remainder(degrees, 360);
    return (uint16_t)(int16_t)((long)round(wrapped / 180 * 32768) & 0xFFFF);
}

void witmotion_init(struct witmotion *device, enum witmotion_map map, const struct around *around,
                    const char *serial, uint64_t seed, int64_t now_ns)
{
    *device = (struct witmotion){.map = map, .around = *around, .powered_ns = now_ns};
    noise_init(&device->noise, seed, 'i');
    uint16_t *r = device->registers;
    r[RATE] = RATE_10_HZ;
    r[BAUD] = BAUD_9600;
    r[UNIT] = WITMOTION_ADDRESS;
    r[BANDWIDTH] = 4;
    r[VERSION] = 4110;
    for (size_t i = 0; i < 12 && i < strlen(serial); i++)
        r[NUMBER + i / 2] |= (uint16_t)((uint8_t)serial[i] << (i % 2 ? 0 : 8));
    witmotion_refresh(device, now_ns);
}

static void put_precise(uint16_t words[2], double degrees)
{
    uint32_t value = (uint32_t)(int32_t)lround(1000 * remainder(degrees, 360));
    words[0] = value & 0xFFFF;
    words[1] = (uint16_t)(value >> 16);
}

static void set_angles(struct witmotion *d, double roll, double pitch)
{
    uint16_t *r = d->registers;
    double noise_deg = d->map == WITMOTION_PRECISE ? PRECISE_NOISE_DEG : ANGLE_NOISE_DEG;
    double angles[3] = {roll, pitch, 0};
    for (int i = 0; i < 3; i++) {
        double noisy = angles[i] + (i == 2 ? 3 : 1) * noise_deg * noise_normal(&d->noise);
        if (d->map == WITMOTION_PRECISE)
            put_precise(r + PRECISE_ROLL + 2 * i, noisy);
        else
            r[ROLL + i] = angle_word(noisy);
    }
    double half_roll = roll * (M_PI / 360), half_pitch = pitch * (M_PI / 360);
    double q[4] = {cos(half_roll) * cos(half_pitch), sin(half_roll) * cos(half_pitch),
                   cos(half_roll) * sin(half_pitch), -sin(half_roll) * sin(half_pitch)};
    for (int i = 0; i < 4; i++)
        r[QUATERNION + i] = word(q[i] * 32768);
}

void witmotion_refresh(struct witmotion *device, int64_t now_ns)
{
    struct vec3 a = device->around.gravity(device->around.context, now_ns);
    double g[3] = {a.x / STANDARD_G, a.y / STANDARD_G, a.z / STANDARD_G};
    uint16_t *r = device->registers;
    for (int i = 0; i < 3; i++) {
        double noisy = g[i] + ACC_NOISE_G * noise_normal(&device->noise);
        r[ACC + i] = word(noisy * (32768 / 16.0));
        r[GYRO + i] = word(0.05 * noise_normal(&device->noise) * (32768 / 2000.0));
        r[MAG + i] = word((const double[]){1500, 0, -3200}[i] + 5 * noise_normal(&device->noise));
    }
    double roll = atan2(g[1], g[2]) * (180 / M_PI);
    double pitch = atan2(-g[0], hypot(g[1], g[2])) * (180 / M_PI);
    set_angles(device, roll, pitch);
    double age_s = (double)(now_ns - device->powered_ns) * 1e-9;
    r[device->map == WITMOTION_PRECISE ? PRECISE_TEMPERATURE : TEMPERATURE] = word(100 * (25 + 4 * (1 - exp(-age_s / 300))));
}

void witmotion_write(struct witmotion *device, uint16_t address, uint16_t value, int64_t now_ns)
{
    if (address == KEY) {
        device->unlocked_until_ns = value == KEY_OPEN ? now_ns + UNLOCKED_NS : now_ns;
        return;
    }
    if (now_ns >= device->unlocked_until_ns || address > LAST_SETTING)
        return;
    device->registers[address] = address == SAVE ? 0 : value;
}
