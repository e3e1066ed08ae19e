// SPDX-License-Identifier: Apache-2.0
#include "simulator/world_control.h"

#include <stdlib.h>
#include <string.h>

#include "simulator/tools.h"

static bool get_number(json_t *request, const char *key, const double *preset, double *out,
                       struct error *err)
{
    json_t *value = json_object_get(request, key);
    if (!value && preset) {
        *out = *preset;
        return true;
    }
    if (!json_is_number(value))
        return fail(err, ERROR_CONFIG, "%s: %s", key, value ? "is not a number" : "is missing");
    *out = json_number_value(value);
    return true;
}

static bool get_text(json_t *request, const char *key, const char **out, struct error *err)
{
    json_t *value = json_object_get(request, key);
    if (!json_is_string(value))
        return fail(err, ERROR_CONFIG, "%s: %s", key, value ? "is not a text" : "is missing");
    *out = json_string_value(value);
    return true;
}

static bool get_place(json_t *request, const char *key, struct vec3 *out, struct error *err)
{
    json_t *value = json_object_get(request, key);
    double v[3];
    for (size_t i = 0; i < 3; i++) {
        json_t *number = json_array_get(value, i);
        if (json_array_size(value) != 3 || !json_is_number(number))
            return fail(err, ERROR_CONFIG, "%s: is not three numbers [x, y, z]", key);
        v[i] = json_number_value(number);
    }
    *out = (struct vec3){v[0], v[1], v[2]};
    return true;
}

static bool read_lamp(const struct scenario *s, json_t *request, struct event *out,
                      struct error *err)
{
    const char *name = "";
    double level;
    json_t *add = json_object_get(request, "add");
    if (add && !json_is_boolean(add))
        return fail(err, ERROR_CONFIG, "add: is neither true nor false");
    return get_text(request, "name", &name, err) &&
           get_number(request, "level", &(double){1}, &level, err) &&
           event_lamp(s, name, level, json_is_true(add), out, err);
}

static bool read_aim(const struct scenario *s, json_t *request, struct event *out,
                     struct error *err)
{
    struct aim aim = {.target = AIM_SCREEN};
    const char *target = "";
    if (!get_text(request, "target", &target, err))
        return false;
    if (!strcmp(target, "ceiling"))
        aim.target = AIM_CEILING;
    else if (strcmp(target, "screen"))
        return fail(err, ERROR_RANGE, "target: \"%s\" is not one of: screen, ceiling", target);
    bool screen = aim.target == AIM_SCREEN;
    aim.from_given = screen && json_object_get(request, "from_m");
    return get_number(request, screen ? "x_px" : "x_m", NULL, &aim.x, err) &&
           get_number(request, screen ? "y_px" : "z_m", NULL, &aim.y, err) &&
           (!aim.from_given || get_place(request, "from_m", &aim.from_m, err)) &&
           event_aim(s, &aim, out, err);
}

static bool read_event(const struct scenario *s, const char *what, json_t *request,
                       struct event *out, struct error *err)
{
    const char *instrument = "", *kind = "";
    struct vec3 eye;
    double deg, over;
    if (!strcmp(what, CONTROL_LAMP))
        return read_lamp(s, request, out, err);
    if (!strcmp(what, CONTROL_AIM))
        return read_aim(s, request, out, err);
    if (!strcmp(what, CONTROL_FAULT))
        return get_text(request, "instrument", &instrument, err) &&
               get_text(request, "kind", &kind, err) && event_fault(instrument, kind, out, err);
    if (!get_number(request, "over_s", &(double){0}, &over, err))
        return false;
    if (!strcmp(what, CONTROL_TILT))
        return get_number(request, "deg", NULL, &deg, err) && event_tilt(deg, over, out, err);
    if (!strcmp(what, CONTROL_HEAD))
        return get_place(request, "eye_m", &eye, err) && event_head(eye, over, out, err);
    return fail(err, ERROR_CONFIG,
                "\"%s\" is not one of: lamp, tilt, head, aim, radiance, truth, fault, protractor, "
                "tape",
                what);
}

static bool read_samples(json_t *value, const char *key, double **out, size_t *count,
                         struct error *err)
{
    size_t size = json_array_size(value);
    if (size < 2)
        return fail(err, ERROR_CONFIG, "reflectance %s: is not a list of two numbers or more", key);
    double *numbers = calloc(size, sizeof *numbers);
    if (!numbers)
        return fail(err, ERROR_SYSTEM, "out of memory");
    for (size_t i = 0; i < size; i++) {
        json_t *number = json_array_get(value, i);
        if (!json_is_number(number)) {
            free(numbers);
            return fail(err, ERROR_CONFIG, "reflectance %s[%zu]: is not a number", key, i);
        }
        numbers[i] = json_number_value(number);
    }
    *out = numbers;
    *count = size;
    return true;
}

static bool read_reflectance(json_t *value, struct spectrum *out, struct error *err)
{
    if (json_is_number(value)) {
        double flat = json_number_value(value);
        if (!(flat >= 0 && flat <= 2))
            return fail(err, ERROR_RANGE, "reflectance: %g is outside 0..2", flat);
        for (int i = 0; i < SPECTRUM_COUNT; i++)
            out->v[i] = flat;
        return true;
    }
    if (!json_is_object(value))
        return fail(err, ERROR_CONFIG, "reflectance: is neither a number nor {nm, values}");
    double *nm = NULL, *values = NULL;
    size_t count = 0, given = 0;
    bool good = read_samples(json_object_get(value, "nm"), "nm", &nm, &count, err) &&
                read_samples(json_object_get(value, "values"), "values", &values, &given, err);
    if (good && count != given)
        good = fail(err, ERROR_CONFIG, "reflectance: %zu nm but %zu values", count, given);
    if (good && !spectrum_from_samples(nm, values, count, true, out, err))
        good = while_doing(err, "reflectance");
    free(nm);
    free(values);
    return good;
}

static json_t *json_of_xyz(struct xyz c)
{
    return json_pack("[f, f, f]", c.X, c.Y, c.Z);
}

static json_t *json_of_vec3(struct vec3 v)
{
    return json_pack("[f, f, f]", v.x, v.y, v.z);
}

// What a matt sample shows: R E / pi.
static json_t *sample_truth(json_t *sample, const struct spectrum *irradiance, struct error *err)
{
    struct spectrum radiance;
    if (!read_reflectance(json_object_get(sample, "reflectance"), &radiance, err))
        return NULL;
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        radiance.v[i] *= irradiance->v[i] / M_PI;
    struct xyz c = xyz_absolute(&radiance, OBSERVER_1931_2);
    json_t *answer = json_pack("{s: o, s: f}", "XYZ", json_of_xyz(c), "Y", c.Y);
    json_t *name = json_object_get(sample, "name");
    if (name)
        json_object_set(answer, "name", name);
    return answer;
}

static json_t *samples_truth(json_t *samples, const struct spectrum *irradiance, struct error *err)
{
    json_t *answers = json_array(), *answer;
    if (!json_is_array(samples))
        fail(err, ERROR_CONFIG, "samples: is not a list");
    for (size_t i = 0; i < json_array_size(samples); i++) {
        answer = sample_truth(json_array_get(samples, i), irradiance, err);
        if (!answer) {
            while_doing(err, "samples[%zu]", i);
            json_decref(answers);
            return NULL;
        }
        json_array_append_new(answers, answer);
    }
    if (json_is_array(samples))
        return answers;
    json_decref(answers);
    return NULL;
}

static json_t *json_of_aim(const struct aim *aim)
{
    bool screen = aim->target == AIM_SCREEN;
    json_t *answer = json_pack("{s: s, s: f, s: f}", "target", screen ? "screen" : "ceiling",
                               screen ? "x_px" : "x_m", aim->x, screen ? "y_px" : "z_m", aim->y);
    if (aim->from_given)
        json_object_set_new(answer, "from_m", json_of_vec3(aim->from_m));
    return answer;
}

static void add_lamps(const struct world *world, const struct world_state *s, json_t *answer)
{
    char names[SCENARIO_LAMPS_MOST * SCENARIO_NAME_SIZE] = "";
    double level = 0;
    json_t *levels = json_object();
    for (int i = 0; i < SCENARIO_LAMPS_MOST; i++) {
        const struct lamp *lamp = world_lamp(world, i);
        if (!lamp)
            continue;
        json_object_set_new(levels, lamp->name, json_real(s->level[i]));
        if (s->level[i] <= 0)
            continue;
        strcat(strcat(names, *names ? "+" : ""), lamp->name);
        level = fmax(level, s->level[i]);
    }
    json_object_set_new(answer, "lamp", json_string(*names ? names : "none"));
    json_object_set_new(answer, "level", json_real(level));
    json_object_set_new(answer, "levels", levels);
}

static json_t *state_answer(struct world *world, int64_t now_ns, const struct spectrum *irradiance)
{
    struct world_state s;
    world_state_at(world, now_ns, &s);
    struct xyz e = xyz_absolute(irradiance, OBSERVER_1931_2);
    struct xyz white = {e.X / M_PI, e.Y / M_PI, e.Z / M_PI};
    json_t *answer = json_pack("{s: f, s: f, s: o, s: f, s: o, s: o}", "at_s", s.at_s, "lux", e.Y,
                               "illuminant_xyz", json_of_xyz(white), "tilt_deg", s.tilt_deg,
                               "eye_m", json_of_vec3(s.eye), "aim", json_of_aim(&s.aim));
    add_lamps(world, &s, answer);
    return answer;
}

static bool truth_place(const struct world *world, int64_t now_ns, json_t *request, double *x,
                        double *y, struct error *err)
{
    const struct scenario_screen *screen = &world_scenario(world)->screen;
    struct world_state s;
    world_state_at((struct world *)world, now_ns, &s);
    bool aimed = s.aim.target == AIM_SCREEN;
    double there[2] = {aimed ? s.aim.x : (screen->width_px - 1) / 2.0,
                       aimed ? s.aim.y : (screen->height_px - 1) / 2.0};
    struct event unused;
    struct aim aim = {.target = AIM_SCREEN};
    if (!get_number(request, "x_px", &there[0], &aim.x, err) ||
        !get_number(request, "y_px", &there[1], &aim.y, err) ||
        !event_aim(world_scenario(world), &aim, &unused, err))
        return false;
    *x = aim.x;
    *y = aim.y;
    return true;
}

static json_t *answer_truth(struct world *world, int64_t now_ns, json_t *request, struct error *err)
{
    struct spectrum irradiance;
    double x, y;
    if (!truth_place(world, now_ns, request, &x, &y, err))
        return NULL;
    world_truth(world, now_ns, x, y, &irradiance);
    json_t *truth = NULL, *samples = json_object_get(request, "samples");
    if (samples && !(truth = samples_truth(samples, &irradiance, err)))
        return NULL;
    if (!samples && json_object_get(request, "reflectance") &&
        !(truth = sample_truth(request, &irradiance, err)))
        return NULL;
    json_t *answer = state_answer(world, now_ns, &irradiance);
    if (samples)
        json_object_set_new(answer, "samples", truth);
    else if (truth) {
        json_object_update(answer, truth);
        json_decref(truth);
    }
    return answer;
}

// What is measured by hand; NULL, err untouched, for anything else.
static json_t *answer_tools(struct world *world, int64_t now_ns, const char *what, json_t *request,
                            struct error *err)
{
    double x, y;
    if (!strcmp(what, CONTROL_PROTRACTOR))
        return json_pack("{s: f}", "deg", tools_protractor(world, now_ns));
    if (strcmp(what, CONTROL_TAPE) || !get_number(request, "x_m", NULL, &x, err) ||
        !get_number(request, "y_m", NULL, &y, err))
        return NULL;
    return json_pack("{s: o}", "point_m", json_of_vec3(tools_tape(world, now_ns, x, y)));
}

static bool is_tool(const char *what)
{
    return !strcmp(what, CONTROL_PROTRACTOR) || !strcmp(what, CONTROL_TAPE);
}

static json_t *answer_radiance(struct world *world, int64_t now_ns)
{
    struct around around = world_around(world);
    struct spectrum light;
    json_t *values = json_array();
    around.radiance(around.context, now_ns, &light);
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        json_array_append_new(values, json_real(light.v[i]));
    return json_pack("{s: f, s: {s: i, s: i, s: o}}", "at_s", world_seconds(world, now_ns),
                     "radiance", "first_nm", SPECTRUM_FIRST_NM, "step_nm", 1, "values", values);
}

json_t *world_answer(struct world *world, int64_t now_ns, const char *what, json_t *request,
                     struct error *err)
{
    struct event event;
    if (is_tool(what))
        return answer_tools(world, now_ns, what, request, err);
    if (!strcmp(what, CONTROL_RADIANCE))
        return answer_radiance(world, now_ns);
    if (strcmp(what, CONTROL_TRUTH) &&
        (!read_event(world_scenario(world), what, request, &event, err) ||
         !world_add_now(world, now_ns, event, err)))
        return NULL;
    json_t *plain = strcmp(what, CONTROL_TRUTH) ? json_object() : json_incref(request);
    json_t *answer = answer_truth(world, now_ns, plain, err);
    json_decref(plain);
    return answer;
}
