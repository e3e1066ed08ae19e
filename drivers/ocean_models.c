// SPDX-License-Identifier: Apache-2.0
#include "drivers/ocean_models.h"

#include "drivers/udev.h"

enum { SYNC = 0x69, COMMAND_INTEGRATION = 0x02 };

#define USB2000PLUS 0x101e, "USB2000+ or Flame-S"
#define USB4000 0x1022, "USB4000 or Flame-T"
#define HR2000PLUS 0x1016, "HR2000+"
#define HR4000 0x1012, "HR4000"
#define MAYA2000PRO 0x102a, "Maya2000Pro"
#define QE65000 0x1018, "QE65000"
#define ID(model) ID_OF(model)
#define ID_OF(product, name)                                                                       \
    {                                                                                              \
        DEVICE_USB, OCEAN_VENDOR, product, "Ocean Optics " name                                    \
    }
#define NO_RANGE                                                                                   \
    {                                                                                              \
        0, -1                                                                                      \
    }

const struct ocean_model ocean_models[] = {
    {USB2000PLUS, .raw_pixels = 2048, .pixels = 2048, .active = {20, 2047},
     .black = {{6, 17}, NO_RANGE}, .full_counts = 65535, .saturation = OCEAN_SATURATION_AT_4,
     .least_us = 1000, .most_us = 65535000, .base_us = 1, .read_noise = 50,
     .well_electrons = 160000},
    {USB4000, .raw_pixels = 3840, .pixels = 3648, .active = {21, 3647},
     .black = {{5, 15}, NO_RANGE}, .full_counts = 65535, .saturation = OCEAN_SATURATION_AT_4,
     .least_us = 10, .most_us = 65535000, .base_us = 1, .split_bytes = 2048,
     .least_cycle_us = 11400, .read_noise = 50, .well_electrons = 90000},
    {HR2000PLUS, .raw_pixels = 2048, .pixels = 2048, .active = {20, 2047},
     .black = {{2, 17}, NO_RANGE}, .flip = 0x2000, .full_counts = 16383,
     .saturation = OCEAN_SATURATION_FIXED, .least_us = 1000, .most_us = 65535000, .base_us = 1,
     .read_noise = 12, .well_electrons = 62500},
    {HR4000, .raw_pixels = 3840, .pixels = 3648, .active = {21, 3647}, .black = {{2, 12}, NO_RANGE},
     .flip = 0x2000, .full_counts = 16383, .saturation = OCEAN_SATURATION_FIXED, .least_us = 10,
     .most_us = 65535000, .base_us = 1, .split_bytes = 2048, .least_cycle_us = 11400,
     .read_noise = 12, .well_electrons = 90000},
    {MAYA2000PRO, .raw_pixels = 2304, .pixels = 2068, .active = {4, 2063},
     .black = {{0, 3}, {2064, 2067}}, .full_counts = 64000, .saturation = OCEAN_SATURATION_AT_0,
     .least_us = 7200, .most_us = 65000000, .base_us = 1, .read_noise = 50,
     .well_electrons = 200000},
    {QE65000, .raw_pixels = 1280, .pixels = 1044, .active = {11, 1033},
     .black = {{0, 3}, {1040, 1043}}, .flip = 0x8000, .full_counts = 65535,
     .saturation = OCEAN_SATURATION_FIXED, .least_us = 8000, .most_us = 1600000000, .base_us = 1000,
     .read_noise = 3, .well_electrons = 1000000},
    {0},
};

const struct device_id ocean_ids[] = {
    ID(USB2000PLUS), ID(USB4000), ID(HR2000PLUS), ID(HR4000), ID(MAYA2000PRO), ID(QE65000), {0}};

const struct ocean_model *ocean_model(unsigned product)
{
    for (const struct ocean_model *m = ocean_models; m->name; m++)
        if (m->product == product)
            return m;
    return NULL;
}

bool ocean_unpack(const struct ocean_model *model, const uint8_t *bytes, size_t count,
                  uint16_t raw[OCEAN_PIXELS_MOST], struct error *err)
{
    if (count != ocean_bytes(model))
        return fail(err, ERROR_DATA, "spectrum of %zu bytes instead of %zu", count,
                    ocean_bytes(model));
    if (bytes[count - 1] != SYNC)
        return fail(err, ERROR_DATA, "spectrum ends with %02x instead of %02x", bytes[count - 1],
                    SYNC);
    for (int i = 0; i < model->raw_pixels; i++)
        raw[i] = (uint16_t)((bytes[2 * i] | bytes[2 * i + 1] << 8) ^ model->flip);
    return true;
}

void ocean_integration_command(const struct ocean_model *model, int us, uint8_t command[5])
{
    uint32_t value = (uint32_t)us / (uint32_t)model->base_us;
    command[0] = COMMAND_INTEGRATION;
    for (int i = 0; i < 4; i++)
        command[1 + i] = value >> 8 * i & 255;
}
