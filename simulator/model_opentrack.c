// SPDX-License-Identifier: Apache-2.0
#include "simulator/model_opentrack.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "simulator/model_noise.h"

enum { VALUES = OPENTRACK_VALUES, PLACES = 3 };

#define CM_PER_M 100.0
#define NOISE_CM 0.05
#define NOISE_DEG 0.1
#define FAR_CM 1e6
#define FAR_DEG 1e5

struct opentrack {
    struct opentrack_options options;
    struct noise noise;
    enum opentrack_upset how;
    int sent; // since it changed
    int64_t next_ns;
    bool begun;
    uint8_t last[OPENTRACK_SIZE];
};

struct opentrack *opentrack_create(const struct opentrack_options *options)
{
    struct opentrack *o = calloc(1, sizeof(*o));
    if (!o)
        return NULL;
    o->options = *options;
    noise_init(&o->noise, options->seed, 'o');
    return o;
}

void opentrack_destroy(struct opentrack *source)
{
    free(source);
}

void opentrack_upset(struct opentrack *source, enum opentrack_upset how)
{
    if (source->how != how)
        source->sent = 0;
    source->how = how;
}

struct opentrack_angles opentrack_angles(const struct mat3 *turn)
{
    const double(*m)[3] = turn->m;
    return (struct opentrack_angles){atan2(m[0][2], m[2][2]) * 180 / M_PI,
                                     -atan2(m[1][2], hypot(m[1][0], m[1][1])) * 180 / M_PI,
                                     atan2(-m[1][0], m[1][1]) * 180 / M_PI};
}

// By which x, y, z, yaw, pitch and roll change when the picture is no mirror's.
static const double unmirrored[VALUES] = {-1, 1, 1, -1, 1, -1};

static void sense(struct opentrack *o, int64_t now_ns, double values[VALUES])
{
    struct rigid head = o->options.around.head(o->options.around.context, now_ns);
    struct vec3 place = vec3_scale(vec3_sub(head.translation, o->options.zero), CM_PER_M);
    struct opentrack_angles turn = opentrack_angles(&head.rotation);
    const double exact[VALUES] = {place.x,      place.y,        place.z,
                                  turn.yaw_deg, turn.pitch_deg, turn.roll_deg};
    for (int i = 0; i < VALUES; i++)
        values[i] = exact[i] * (o->options.mirrored ? 1 : unmirrored[i]) +
                    (i < PLACES ? NOISE_CM : NOISE_DEG) * noise_normal(&o->noise);
}

static void spoil(struct opentrack *o, double values[VALUES])
{
    static const double no_numbers[] = {NAN, INFINITY, -INFINITY};
    int which = o->sent % VALUES;
    if (o->how == OPENTRACK_NOT_A_NUMBER)
        values[which] = no_numbers[o->sent % 3];
    if (o->how == OPENTRACK_OUT_OF_RANGE)
        values[which] = which < PLACES ? FAR_CM : FAR_DEG;
}

void opentrack_bytes(const double values[VALUES], uint8_t out[OPENTRACK_SIZE])
{
    for (int i = 0; i < VALUES; i++) {
        uint64_t bits;
        memcpy(&bits, &values[i], sizeof(bits));
        for (int k = 0; k < 8; k++)
            out[8 * i + k] = (uint8_t)(bits >> 8 * k);
    }
}

static int size_of(const struct opentrack *o)
{
    static const int wrong[] = {0, OPENTRACK_SIZE - 1, OPENTRACK_SIZE + 1, OPENTRACK_MOST};
    return o->how == OPENTRACK_WRONG_SIZE ? wrong[o->sent % 4] : OPENTRACK_SIZE;
}

static void make(struct opentrack *o, int64_t now_ns)
{
    double values[VALUES];
    sense(o, now_ns, values);
    spoil(o, values);
    opentrack_bytes(values, o->last);
    o->begun = true;
}

int opentrack_out(struct opentrack *source, int64_t now_ns, uint8_t out[OPENTRACK_MOST],
                  int64_t *again_ns)
{
    struct opentrack *o = source;
    int64_t period_ns = (int64_t)(NS_PER_S / o->options.rate_hz);
    *again_ns = o->next_ns;
    if (o->begun && now_ns < o->next_ns)
        return -EAGAIN;
    o->next_ns = o->begun ? o->next_ns + period_ns : now_ns + period_ns;
    if (o->next_ns <= now_ns)
        o->next_ns = now_ns + period_ns;
    if (!o->begun || o->how != OPENTRACK_FROZEN)
        make(o, now_ns);
    memset(out, 0, OPENTRACK_MOST);
    memcpy(out, o->last, OPENTRACK_SIZE);
    int size = size_of(o);
    o->sent++;
    *again_ns = o->next_ns;
    return size;
}
