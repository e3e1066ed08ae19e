// SPDX-License-Identifier: Apache-2.0
#include "daemon/status.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"

static const double DIRECTION_SLACK = 0.02; // a degree: an eye that moves there changes little

__attribute__((format(printf, 2, 3))) static void warn(struct snapshot *s, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    for (int i = 0; i < WARNINGS_MOST; i++)
        if (!*s->warnings[i]) {
            vsnprintf(s->warnings[i], sizeof s->warnings[i], format, args);
            break;
        }
    va_end(args);
}

static double seconds(int64_t ns)
{
    return (double)ns / NS_PER_S;
}

static void warn_of_belief(struct snapshot *s, const char *what, const struct belief *b,
                           bool polled)
{
    switch (b->standing) {
    case STANDING_FRESH:
        return;
    case STANDING_PRESET:
        warn(s, "the %s is %s", what,
             polled ? "not known yet: the settings' default counts" : "the settings' default");
        return;
    case STANDING_HELD:
    case STANDING_STALE:
        warn(s, "the %s is %s: last seen %.1f s ago", what, standing_name(b->standing),
             seconds(b->age_ns));
        return;
    }
}

static void warn_of_lamp(struct snapshot *s)
{
    switch (s->state.lamp.verdict) {
    case LAMP_KNOWN:
    case LAMP_NONE:
        warn_of_belief(s, "lamp", &s->state.lamp.belief, true);
        return;
    case LAMP_UNKNOWN:
        if (*s->lamp_name)
            warn(s, "the light is unknown or mixed: %s is held, last seen %.1f s ago", s->lamp_name,
                 seconds(s->state.lamp.belief.age_ns));
        else
            warn(s, "the light is unknown or mixed: no proof is shown under it");
        return;
    }
}

// An emulated panel has no ramp to bend.
static void warn_of_output(struct snapshot *s)
{
    int bits = booth_bits(&s->settings);
    if (s->output.bits < bits)
        warn(s, "the window has %d bits a channel, not the %d of [display] bits", s->output.bits,
             bits);
    if (s->output.ramp == RAMP_BENT)
        warn(s, "the monitor's gamma ramp is not neutral: colours are wrong");
    if (s->output.ramp == RAMP_UNKNOWN && !s->settings.booth.emulated)
        warn(s, "the monitor's gamma ramp is not known: it must be neutral");
}

// Beyond the measured directions the display's light is taken as at their edge.
static void warn_of_direction(const struct booth *b, struct snapshot *s)
{
    const struct scene *scene = &b->scene;
    if (scene->kind != SCENE_SURFACE || !scene->view)
        return;
    struct vec3 eye = rigid_apply(rigid_inverse(scene->booth_from_screen), scene->eye);
    double sine = hypot(eye.x, eye.y) / vec3_length(eye), most = scene->view->sine_most;
    if (!(eye.z > 0) || sine > most + DIRECTION_SLACK)
        warn(s, "the eye is %.0f degrees off the screen's normal; the display was measured to %.0f",
             acos(eye.z / vec3_length(eye)) * 180 / M_PI, asin(most) * 180 / M_PI);
}

static void warnings(const struct booth *b, struct snapshot *s)
{
    char text[sizeof *s->warnings];
    if (s->failure.code)
        warn(s, "%s: %.160s", b->blind ? "nothing can be drawn" : "the screen is kept black",
             s->failure.text);
    warn_of_output(s);
    for (int i = 0; setup_warning(b->setup, i, text, sizeof text); i++)
        warn(s, "%s", text);
    if (booth_spectrometer(&s->settings))
        warn_of_lamp(s);
    else
        warn(s, "there is no spectrometer: %s",
             *s->lamp_name ? "the lamp is taken for granted" : "no lamp is known");
    warn_of_belief(s, "tilt", &s->state.tilt.belief, booth_accelerometer(&s->settings));
    warn_of_belief(s, "place of the eye", &s->state.eye.belief, booth_tracker(&s->settings));
    warn_of_direction(b, s);
    if (s->out_of_gamut > 0)
        warn(s, "%.2f %% of the screen is out of the display's gamut", 100 * s->out_of_gamut);
}

static void take_setup(const struct setup *u, struct snapshot *s)
{
    s->settings = u->settings;
    s->lamps = u->lamps.count;
    s->show = u->show;
    s->counts = u->counts;
    if (u->show == SHOW_MATERIAL) {
        memcpy(s->material, u->material_name, sizeof s->material);
        memcpy(s->patch, u->patch_name, sizeof s->patch);
    }
    s->has_display = u->has_display;
    if (u->has_display)
        memcpy(s->display, u->display.name, sizeof s->display);
    s->condition = u->has_display ? u->display.condition : 0;
    s->calibration = u->calibration;
    s->expired = u->expired;
    s->refused = u->refused;
    int lamp = s->state.lamp.index;
    if (lamp >= 0 && lamp < u->lamps.count)
        memcpy(s->lamp_name, u->lamps.lamps[lamp].file.name, sizeof s->lamp_name);
}

void snapshot_take(struct booth *b, struct snapshot *s)
{
    *s =
        (struct snapshot){.state = b->state,
                          .scene = b->scene.kind,
                          .frames = b->frames,
                          .failure = b->failure,
                          .matches = !b->failure.code && b->shown.lamp.index == b->state.lamp.index,
                          .output = renderer_output(b->renderer),
                          .tilt_number = b->seen.tilt_number,
                          .head_number = b->seen.head_number,
                          .tilt = b->seen.tilt,
                          .head = b->seen.head};
    take_setup(b->setup, s);
    snprintf(s->renderer, sizeof s->renderer, "%s", renderer_name(b->renderer));
    if (s->scene == SCENE_SURFACE)
        s->out_of_gamut = b->out_of_gamut;
    warnings(b, s);
}

static const char *scene_name(enum scene_kind kind)
{
    switch (kind) {
    case SCENE_DARK:
        return "dark";
    case SCENE_PATCH:
        return "patch";
    case SCENE_SURFACE:
        return "surface";
    }
    return "dark";
}

static const char *verdict_name(enum lamp_verdict verdict)
{
    switch (verdict) {
    case LAMP_NONE:
        return "none";
    case LAMP_KNOWN:
        return "known";
    case LAMP_UNKNOWN:
        return "unknown";
    }
    return "unknown";
}

void snapshot_line(const struct snapshot *s, char *text, size_t size)
{
    const char *lamp = *s->lamp_name                           ? s->lamp_name
                       : s->state.lamp.verdict == LAMP_UNKNOWN ? "unknown light"
                                                               : "no lamp";
    const char *shown = s->scene == SCENE_PATCH  ? "a patch of counts"
                        : s->scene == SCENE_DARK ? "nothing"
                                                 : s->material;
    snprintf(text, size, "%s, tilt %.0f degrees, %s on screen", lamp, s->state.tilt.deg, shown);
}

static const char *ramp_name(enum display_ramp ramp)
{
    switch (ramp) {
    case RAMP_NONE:
        return "none";
    case RAMP_UNKNOWN:
        return "unknown";
    case RAMP_NEUTRAL:
        return "neutral";
    case RAMP_BENT:
        return "not neutral";
    }
    return "unknown";
}

static json_t *text_or_null(const char *text)
{
    return *text ? json_string(text) : json_null();
}

static json_t *belief_json(const struct belief *b)
{
    return json_pack("{s:s, s:f, s:f}", "standing", standing_name(b->standing), "age_ms",
                     (double)b->age_ns / NS_PER_MS, "confidence", b->confidence);
}

static json_t *lamp_json(const struct snapshot *s)
{
    json_t *lamp = belief_json(&s->state.lamp.belief);
    json_t *more =
        json_pack("{s:s, s:o, s:f, s:f, s:f, s:i}", "verdict", verdict_name(s->state.lamp.verdict),
                  "name", text_or_null(s->lamp_name), "level", s->state.lamp.level, "lux",
                  s->state.lamp.lux, "distance", s->state.lamp.distance, "taught", s->lamps);
    json_object_update(lamp, more);
    json_decref(more);
    return lamp;
}

static json_t *instrument_json(const struct instrument_report *r, int64_t now_ns)
{
    json_t *age = r->samples ? json_real((double)(now_ns - r->latest_ns) / NS_PER_MS) : json_null();
    return json_pack("{s:s, s:o, s:s, s:s, s:s, s:b, s:I, s:o, s:o, s:o, s:f}", "state",
                     instrument_state_name(r->state), "driver", text_or_null(r->driver), "model",
                     r->identity.model, "serial", r->identity.serial, "firmware",
                     r->identity.firmware, "emulated", r->identity.emulated, "samples",
                     (json_int_t)r->samples, "age_ms", age, "note", text_or_null(r->note),
                     "last_error", text_or_null(r->error.code ? r->error.text : ""), "overdue_ms",
                     (double)r->overdue_ns / NS_PER_MS);
}

static json_t *instruments_json(const struct instruments_report *all, int64_t now_ns)
{
    json_t *out = json_object();
    for (int i = 0; i < INSTRUMENT_COUNT; i++)
        json_object_set_new(out, instrument_name(i), instrument_json(&all->of[i], now_ns));
    return out;
}

static bool emulated(const struct snapshot *s, const struct instruments_report *all)
{
    bool any = s->settings.booth.emulated;
    for (int i = 0; i < INSTRUMENT_COUNT; i++)
        any = any || all->of[i].identity.emulated;
    return any;
}

static json_t *settings_json(const struct snapshot *s)
{
    struct booth_tables tables;
    struct booth_settings settings = s->settings;
    json_t *out = json_object();
    booth_tables_init(&tables, &settings);
    for (const struct settings_section *section = tables.sections; section->name; section++) {
        json_t *rows = json_object();
        for (const struct setting *row = section->rows; row->name; row++) {
            char text[1024];
            settings_get(row, &settings, text, sizeof text);
            json_object_set_new(rows, row->name, json_string(text));
        }
        json_object_set_new(out, section->name, rows);
    }
    return out;
}

static bool believed(const struct belief *b)
{
    return b->standing == STANDING_FRESH || b->standing == STANDING_HELD;
}

static bool valid(const struct snapshot *s)
{
    return s->scene == SCENE_SURFACE && s->matches && s->output.ramp != RAMP_BENT &&
           s->state.lamp.verdict == LAMP_KNOWN && believed(&s->state.lamp.belief) &&
           (believed(&s->state.tilt.belief) || !booth_accelerometer(&s->settings));
}

static json_t *warnings_json(const struct snapshot *s)
{
    json_t *out = json_array();
    for (int i = 0; i < WARNINGS_MOST && *s->warnings[i]; i++)
        json_array_append_new(out, json_string(s->warnings[i]));
    return out;
}

static void add_shown(json_t *out, const struct snapshot *s)
{
    json_object_set_new(out, "scene", json_string(scene_name(s->scene)));
    json_object_set_new(out, "material", text_or_null(s->material));
    json_object_set_new(out, "patch", text_or_null(s->patch));
    json_object_set_new(out, "rgb",
                        s->scene == SCENE_PATCH
                            ? json_pack("[f,f,f]", s->counts.r, s->counts.g, s->counts.b)
                            : json_null());
}

json_t *status_shown(const struct snapshot *s)
{
    json_t *out = json_pack("{s:o, s:f, s:f}", "lamp", text_or_null(s->lamp_name), "level",
                            s->state.lamp.level, "tilt_deg", s->state.tilt.deg);
    add_shown(out, s);
    return out;
}

static json_t *tilt_json(const struct snapshot *s)
{
    json_t *tilt = belief_json(&s->state.tilt.belief);
    struct vec3 g = s->tilt.gravity;
    bool any = s->tilt_number && isfinite(s->tilt.tilt_deg);
    json_object_set_new(tilt, "tilt_deg", json_real(s->state.tilt.deg));
    json_object_set_new(tilt, "number", json_integer((json_int_t)s->tilt_number));
    json_object_set_new(tilt, "reading_deg", any ? json_real(s->tilt.tilt_deg) : json_null());
    json_object_set_new(tilt, "plausible", json_boolean(any && s->tilt.plausible));
    json_object_set_new(tilt, "gravity_m_s2",
                        any && vec3_length(g) > 0 ? json_pack("[f,f,f]", g.x, g.y, g.z)
                                                  : json_null());
    return tilt;
}

static json_t *eye_json(const struct snapshot *s)
{
    json_t *eye = belief_json(&s->state.eye.belief);
    struct vec3 at = s->state.eye.at;
    bool seen = s->head_number && s->head.status == TRACKER_SEEN;
    struct vec3 there = s->head.eye;
    json_object_set_new(eye, "eye_m", json_pack("[f,f,f]", at.x, at.y, at.z));
    json_object_set_new(eye, "number", json_integer((json_int_t)s->head_number));
    json_object_set_new(eye, "tracker_m",
                        seen ? json_pack("[f,f,f]", there.x, there.y, there.z) : json_null());
    return eye;
}

static json_t *overruled_json(unsigned rows)
{
    json_t *out = json_array();
    for (unsigned i = 0; i < STORED_COUNT; i++)
        if (rows & 1u << i)
            json_array_append_new(out, json_string(booth_stored_name(i)));
    return out;
}

static json_t *calibration_json(const struct snapshot *s)
{
    const struct booth_calibration *c = &s->calibration;
    const struct store_manifest *m = &c->manifest;
    if (!c->used)
        return json_null();
    json_t *out =
        json_pack("{s:s, s:o, s:b, s:o, s:o}", "store", s->settings.calibration.store, "version",
                  c->number ? json_integer(c->number) : json_null(), "expired", s->expired,
                  "refused", text_or_null(s->refused.code ? s->refused.text : ""), "overruled",
                  overruled_json(c->overruled));
    if (!c->number)
        return out;
    json_t *facts = json_pack("{s:s, s:o, s:s, s:s, s:s}", "created", m->created, "valid_until",
                              text_or_null(m->valid_until), "software", m->software, "note",
                              m->note, "sha256", c->sum.hex);
    json_object_update(out, facts);
    json_decref(facts);
    return out;
}

json_t *status_json(const struct snapshot *s, const struct instruments_report *instruments,
                    const char *since, int64_t now_ns)
{
    json_t *out =
        json_pack("{s:s, s:s, s:s, s:b, s:b}", "version", BOOTHD_VERSION, "since", since, "booth",
                  s->settings.booth.name, "emulated", emulated(s, instruments), "valid", valid(s));
    json_object_set_new(out, "instruments", instruments_json(instruments, now_ns));
    json_object_set_new(out, "lamp", lamp_json(s));
    json_object_set_new(out, "tilt", tilt_json(s));
    json_object_set_new(out, "eye", eye_json(s));
    add_shown(out, s);
    json_object_set_new(out, "renderer", json_string(s->renderer));
    json_object_set_new(
        out, "output",
        json_pack("{s:i, s:s}", "bits", s->output.bits, "ramp", ramp_name(s->output.ramp)));
    json_object_set_new(out, "failure", text_or_null(s->failure.code ? s->failure.text : ""));
    json_object_set_new(out, "frames", json_integer((json_int_t)s->frames));
    json_object_set_new(out, "out_of_gamut", json_real(s->out_of_gamut));
    json_object_set_new(out, "display",
                        s->has_display
                            ? json_pack("{s:s, s:s, s:f}", "model", s->display, "file",
                                        s->settings.display.model, "condition", s->condition)
                            : json_null());
    json_object_set_new(out, "calibration", calibration_json(s));
    json_object_set_new(out, "warnings", warnings_json(s));
    json_object_set_new(out, "settings", settings_json(s));
    return out;
}
