// SPDX-License-Identifier: Apache-2.0
#include "drivers/modbus_map.h"

#include <math.h>
#include <string.h>

const char *const modbus_formats[] = {"s16", "u16", "s32", "u32", "float", NULL};
const char *const modbus_word_orders[] = {"high-first", "low-first", NULL};

static int words_of(enum modbus_format format)
{
    return format == MODBUS_S16 || format == MODBUS_U16 ? 1 : 2;
}

int modbus_field_words(const struct modbus_field *field)
{
    return field->first < 0 ? 0 : field->count * words_of(field->format);
}

static double count_of(const struct modbus_field *field, const uint16_t *r)
{
    uint32_t high = field->low_first ? r[1] : r[0], low = field->low_first ? r[0] : r[1];
    uint32_t bits = high << 16 | low;
    float single;
    switch (field->format) {
    case MODBUS_S16:
        return (int16_t)r[0];
    case MODBUS_U16:
        return r[0];
    case MODBUS_S32:
        return (int32_t)bits;
    case MODBUS_U32:
        return bits;
    case MODBUS_FLOAT:
        memcpy(&single, &bits, sizeof single);
        return (double)single;
    }
    return NAN;
}

bool modbus_field_value(const struct modbus_field *field, const uint16_t *registers, int which,
                        double *value)
{
    uint16_t two[2] = {0};
    int words = words_of(field->format);
    memcpy(two, registers + which * words, (size_t)words * sizeof *two);
    double count = count_of(field, two);
    *value = (count + field->offset) * field->scale;
    return isfinite(*value) && count != field->sentinel;
}

static bool gravity_of(const struct modbus_map *map, const uint16_t *registers, struct vec3 *out)
{
    double v[3];
    for (int i = 0; i < 3; i++)
        if (!modbus_field_value(&map->accel, registers, i, &v[i]))
            return false;
    *out = accelerometer_turn(map->axes, (struct vec3){v[0], v[1], v[2]});
    return true;
}

void modbus_decode(const struct modbus_map *map, const uint16_t *accel, const uint16_t *angle,
                   double offset_deg, struct tilt_sample *out)
{
    double deg = NAN;
    bool read = (!accel || gravity_of(map, accel, &out->gravity)) &&
                (!angle || modbus_field_value(&map->angle, angle, 0, &deg));
    if (!accel || !read)
        out->gravity = (struct vec3){0, 0, 0};
    out->angle_deg = angle && read ? tilt_wrap(deg + offset_deg) : NAN;
    out->tilt_deg =
        accel && read ? tilt_wrap(tilt_of_gravity(out->gravity) + offset_deg) : out->angle_deg;
    if (read)
        tilt_judge(out, accel != NULL);
    else
        *out =
            (struct tilt_sample){.taken = out->taken, .angle_deg = NAN, .doubt = TILT_NO_READING};
}

static bool check_field(const char *name, const struct modbus_field *field, struct error *err)
{
    return field->first + modbus_field_words(field) <= 65536 ||
           fail(err, ERROR_CONFIG, "%s: %d leaves no room for %d registers below 65536", name,
                field->first, modbus_field_words(field));
}

bool modbus_map_generic(const struct accelerometer_options *o, struct modbus_map *out,
                        struct error *err)
{
    const double sentinel = o->sentinel > ACCELEROMETER_NO_SENTINEL ? o->sentinel : NAN;
    struct modbus_map map = {
        .model = "generic",
        .function = o->function,
        .accel = {o->accel_register, 3, (enum modbus_format)o->accel_format, o->word_order,
                  o->accel_scale, o->accel_offset, sentinel},
        .angle = {o->angle_register, 1, (enum modbus_format)o->angle_format, o->word_order,
                  o->angle_scale, o->angle_offset, sentinel},
        .version = -1,
        .serial = -1,
    };
    if (map.accel.first < 0 && map.angle.first < 0)
        return fail(err, ERROR_CONFIG,
                    "model generic needs accel_register, angle_register or both");
    if (!accelerometer_axes(o->accel_axes, map.axes, err) ||
        !check_field("accel_register", &map.accel, err) ||
        !check_field("angle_register", &map.angle, err))
        return false;
    *out = map;
    return true;
}
