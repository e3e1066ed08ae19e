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
static const double STIR = 0.1;        // m/s: noise alone may look like that
static const double LIVELY = 0.25;     // m/s: from here on a head may do anything
static const double REST_SHARE = 0.1;  // of its acceleration, of one that rests
static const double FORGET_S = 0.5;    // a swaying head turns around within it

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

// What is believed after dt, and how much of what a place is off counts for
// place and speed.
static void gain(struct eye_spread *k, double speed, double most, double noise, double dt,
                 double *place, double *pull)
{
    k->pace = fmax(speed, k->pace * exp(-dt / FORGET_S));
    double share = fmin(fmax((k->pace - STIR) / (LIVELY - STIR), REST_SHARE), 1);
    double q = share * most * share * most;
    k->pp += dt * (2 * k->pv + dt * k->vv) + q * dt * dt * dt * dt / 4;
    k->pv += dt * k->vv + q * dt * dt * dt / 2;
    k->vv += q * dt * dt;
    *place = k->pp / (k->pp + noise * noise);
    *pull = k->pv / (k->pp + noise * noise);
    k->vv -= *pull * k->pv;
    k->pv -= *place * k->pv;
    k->pp -= *place * k->pp;
}

static void kalman(struct eye_track *t, const struct state_settings *s, struct vec3 at,
                   struct vec3 sight, double dt)
{
    double place[2], pull[2];
    sight = vec3_unit(sight);
    struct vec3 along = vec3_scale(sight, vec3_dot(t->speed, sight));
    struct vec3 across = vec3_sub(t->speed, along);
    gain(&t->along, vec3_length(along), s->eye_acceleration, s->eye_depth_noise_m, dt, &place[0],
         &pull[0]);
    gain(&t->across, vec3_length(across), s->eye_acceleration, s->eye_noise_m, dt, &place[1],
         &pull[1]);
    t->at = vec3_add(t->at, vec3_scale(t->speed, dt));
    struct vec3 off = vec3_sub(at, t->at), deep = vec3_scale(sight, vec3_dot(off, sight));
    struct vec3 wide = vec3_sub(off, deep);
    t->at = vec3_add(t->at, vec3_add(vec3_scale(deep, place[0]), vec3_scale(wide, place[1])));
    t->speed = vec3_add(t->speed, vec3_add(vec3_scale(deep, pull[0]), vec3_scale(wide, pull[1])));
}

static struct eye_spread unknown(double noise)
{
    return (struct eye_spread){
        .pp = noise * noise, .vv = FIRST_SPEED * FIRST_SPEED, .pace = FIRST_SPEED};
}

void eye_take(struct eye_track *t, const struct state_settings *s, struct vec3 at,
              struct vec3 sight, int64_t seen_ns)
{
    double passed_s = seconds(seen_ns - t->seen_ns);
    double dt_s = fmin(fmax(passed_s, SHORTEST_S), LONGEST_S);
    struct vec3 seen = t->seen;
    if (!t->known || passed_s < 0 || passed_s >= s->eye_hold_s) {
        *t = (struct eye_track){.known = true,
                                .at = at,
                                .along = unknown(s->eye_depth_noise_m),
                                .across = unknown(s->eye_noise_m)};
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
        kalman(t, s, at, sight, dt_s);
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
