// SPDX-License-Identifier: Apache-2.0
#include "daemon/eye.h"

#include <math.h>

#include "base/clock.h"

static const double SHORTEST_S = 0.001, LONGEST_S = 0.1; // between places
static const double LAG_M = 0.05;                        // at any speed
static const double SPEED_S = 0.16;                      // 1 Hz, as the filter's authors recommend
static const double FIRST_SPEED = 0.5;                   // m/s, of a head just found
static const double HORIZON_S = 0.05;
static const double REST_SPEED = 0.05; // m/s
static const double FASTEST = 3;       // m/s

static double seconds(int64_t ns)
{
    return (double)ns / NS_PER_S;
}

static double share_of(double dt_s, double time_constant_s)
{
    return time_constant_s > 0 ? -expm1(-dt_s / time_constant_s) : 1;
}

static struct vec3 towards(struct vec3 from, struct vec3 to, double share)
{
    return vec3_add(from, vec3_scale(vec3_sub(to, from), share));
}

static struct vec3 speed_between(struct vec3 from, struct vec3 to, double dt_s)
{
    return vec3_scale(vec3_sub(to, from), 1 / dt_s);
}

static void one_euro(struct eye_track *t, double rest_s, struct vec3 at, double dt_s)
{
    double share = share_of(dt_s, SPEED_S);
    t->approach = towards(t->approach, speed_between(t->at, at, dt_s), share);
    double faster = vec3_length(t->approach) * rest_s / LAG_M;
    t->at = towards(t->at, at, share_of(dt_s, rest_s / (1 + faster)));
}

static void kalman(struct eye_track *t, const struct state_settings *s, struct vec3 at, double dt)
{
    double noise = s->eye_noise_m * s->eye_noise_m;
    double q = s->eye_acceleration * s->eye_acceleration;
    t->at = vec3_add(t->at, vec3_scale(t->speed, dt));
    t->pp += dt * (2 * t->pv + dt * t->vv) + q * dt * dt * dt * dt / 4;
    t->pv += dt * t->vv + q * dt * dt * dt / 2;
    t->vv += q * dt * dt;
    double place_gain = t->pp / (t->pp + noise), speed_gain = t->pv / (t->pp + noise);
    struct vec3 off = vec3_sub(at, t->at);
    t->at = vec3_add(t->at, vec3_scale(off, place_gain));
    t->speed = vec3_add(t->speed, vec3_scale(off, speed_gain));
    t->vv -= speed_gain * t->pv;
    t->pv -= place_gain * t->pv;
    t->pp -= place_gain * t->pp;
}

void eye_take(struct eye_track *t, const struct state_settings *s, struct vec3 at, int64_t seen_ns)
{
    double passed_s = seconds(seen_ns - t->seen_ns);
    double dt_s = fmin(fmax(passed_s, SHORTEST_S), LONGEST_S);
    struct vec3 seen = t->seen;
    if (!t->known || passed_s < 0 || passed_s >= s->eye_hold_s) {
        *t = (struct eye_track){.known = true,
                                .at = at,
                                .pp = s->eye_noise_m * s->eye_noise_m,
                                .vv = FIRST_SPEED * FIRST_SPEED};
        seen = at;
    }
    t->seen_ns = seen_ns;
    t->seen = at;
    switch ((enum eye_filter)s->eye_filter) {
    case EYE_FILTER_NONE:
        t->at = at;
        break;
    case EYE_FILTER_ONE_EURO:
        one_euro(t, s->eye_s, at, dt_s);
        break;
    case EYE_FILTER_KALMAN:
        kalman(t, s, at, dt_s);
        return;
    }
    t->speed = towards(t->speed, speed_between(seen, at, dt_s), share_of(dt_s, SPEED_S));
}

struct vec3 eye_at(const struct eye_track *t, const struct state_settings *s, int64_t photon_ns)
{
    double horizon_s = fmin(fmax(seconds(photon_ns - t->seen_ns), 0), HORIZON_S);
    double speed = vec3_length(t->speed);
    if (!(s->eye_ahead_s > 0) || speed <= REST_SPEED)
        return t->at;
    double believed = fmin(speed - REST_SPEED, FASTEST) / speed;
    return vec3_add(t->at, vec3_scale(t->speed, believed * horizon_s));
}
