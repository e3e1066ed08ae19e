// SPDX-License-Identifier: Apache-2.0
#include "daemon/commands.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/control.h"
#include "files/exr.h"
#include "files/png.h"

enum { FIELDS_MOST = 4 };

struct command {
    const char *name;
    enum job_kind kind;
    bool (*parse)(const json_t *request, struct job *job, struct error *err);
    const char *fields[FIELDS_MOST];
};

static bool take_text(const json_t *request, const char *field, bool needed, char *out, size_t size,
                      struct error *err)
{
    const json_t *value = json_object_get(request, field);
    *out = 0;
    if (!value && !needed)
        return true;
    const char *text = json_string_value(value);
    if (!text || strlen(text) != json_string_length(value))
        return fail(err, ERROR_RANGE, "%s: must be a text", field);
    if (!*text || strlen(text) >= size)
        return fail(err, ERROR_RANGE, "%s: must have 1..%zu characters", field, size - 1);
    strcpy(out, text);
    return true;
}

static bool take_number(const json_t *request, const char *field, double preset, double least,
                        double most, double *out, struct error *err)
{
    const json_t *value = json_object_get(request, field);
    *out = value ? json_number_value(value) : preset;
    if (value && !json_is_number(value))
        return fail(err, ERROR_RANGE, "%s: must be a number, %g..%g", field, least, most);
    if (!(*out >= least && *out <= most))
        return fail(err, ERROR_RANGE, "%s: %g is outside %g..%g", field, *out, least, most);
    return true;
}

static bool take_whole(const json_t *request, const char *field, double preset, double least,
                       double most, int *out, struct error *err)
{
    double value;
    if (!take_number(request, field, preset, least, most, &value, err))
        return false;
    if (value != rint(value))
        return fail(err, ERROR_RANGE, "%s: %g is no whole number", field, value);
    *out = (int)value;
    return true;
}

static bool parse_nothing(const json_t *request, struct job *job, struct error *err)
{
    (void)request, (void)job, (void)err;
    return true;
}

static bool parse_show(const json_t *request, struct job *job, struct error *err)
{
    return take_text(request, "material", true, job->name, sizeof job->name, err) &&
           take_text(request, "patch", false, job->patch, sizeof job->patch, err);
}

static bool parse_patch(const json_t *request, struct job *job, struct error *err)
{
    const json_t *rgb = json_object_get(request, "rgb");
    double v[3];
    if (json_array_size(rgb) != 3)
        return fail(err, ERROR_RANGE, "rgb: must be three numbers, 0..1");
    for (int i = 0; i < 3; i++) {
        const json_t *value = json_array_get(rgb, i);
        v[i] = json_number_value(value);
        if (!json_is_number(value))
            return fail(err, ERROR_RANGE, "rgb: number %d must be a number, 0..1", i + 1);
        if (!(v[i] >= 0 && v[i] <= 1))
            return fail(err, ERROR_RANGE, "rgb: number %d: %g is outside 0..1", i + 1, v[i]);
    }
    job->counts = (struct counts){v[0], v[1], v[2]};
    return true;
}

static bool ends_with(const char *text, const char *end)
{
    size_t all = strlen(text), last = strlen(end);
    return all > last && !strcmp(text + all - last, end);
}

static bool parse_capture(const json_t *request, struct job *job, struct error *err)
{
    if (!take_text(request, "file", true, job->name, sizeof job->name, err))
        return false;
    if (*job->name != '/')
        return fail(err, ERROR_RANGE, "file: \"%s\" must be a whole path, beginning with /",
                    job->name);
    return ends_with(job->name, ".png") || ends_with(job->name, ".exr") ||
           fail(err, ERROR_RANGE, "file: \"%s\" must end in .png (counts) or .exr (cd/m2)",
                job->name);
}

static bool parse_probe(const json_t *request, struct job *job, struct error *err)
{
    return take_whole(request, "x_px", -1, 0, 16383, &job->x_px, err) &&
           take_whole(request, "y_px", -1, 0, 16383, &job->y_px, err);
}

static bool parse_measure(const json_t *request, struct job *job, struct error *err)
{
    return take_number(request, "timeout_s", 60, 0.1, 600, &job->timeout_s, err);
}

static bool parse_teach(const json_t *request, struct job *job, struct error *err)
{
    return take_text(request, "lamp", true, job->name, sizeof job->name, err) &&
           lamp_name_fits(job->name, err) &&
           take_whole(request, "readings", 20, 1, 1000, &job->readings, err) &&
           take_number(request, "timeout_s", 50, 0.1, 600, &job->timeout_s, err);
}

static bool parse_raw(const json_t *request, struct job *job, struct error *err)
{
    return take_whole(request, "integration_us", 0, 0, 65535000, &job->integration_us, err) &&
           take_whole(request, "readings", 20, 1, SERIES_MOST, &job->readings, err) &&
           take_number(request, "timeout_s", 50, 0.1, 3600, &job->timeout_s, err);
}

static const struct command commands[] = {
    {CONTROL_SHOW, JOB_SHOW, parse_show, {"material", "patch"}},
    {CONTROL_PATCH, JOB_PATCH, parse_patch, {"rgb"}},
    {CONTROL_CAPTURE, JOB_CAPTURE, parse_capture, {"file"}},
    {CONTROL_PROBE, JOB_PROBE, parse_probe, {"x_px", "y_px"}},
    {CONTROL_MEASURE, JOB_MEASURE, parse_measure, {"timeout_s"}},
    {CONTROL_TEACH, JOB_TEACH, parse_teach, {"lamp", "readings", "timeout_s"}},
    {CONTROL_RAW, JOB_RAW, parse_raw, {"integration_us", "readings", "timeout_s"}},
    {CONTROL_RELOAD, JOB_RELOAD, parse_nothing, {0}},
    {CONTROL_QUIT, JOB_QUIT, parse_nothing, {0}},
};

enum { COMMANDS = sizeof commands / sizeof *commands };

static bool known_fields(const struct command *c, const json_t *request, struct error *err)
{
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)request, key, value)
    {
        bool known = !strcmp(key, "do");
        for (int i = 0; i < FIELDS_MOST && c->fields[i]; i++)
            known = known || !strcmp(key, c->fields[i]);
        if (!known)
            return fail(err, ERROR_RANGE, "%s: \"%.60s\" is no field of it", c->name, key);
    }
    return true;
}

bool command_parse(const char *what, const json_t *request, struct job *job, struct error *err)
{
    for (int i = 0; i < COMMANDS; i++) {
        const struct command *c = &commands[i];
        if (strcmp(c->name, what))
            continue;
        *job = (struct job){.kind = c->kind};
        return known_fields(c, request, err) &&
               (c->parse(request, job, err) || while_doing(err, "%s", what));
    }
    return fail(err, ERROR_RANGE,
                "\"%.40s\" is no request; there is: status, show, patch, capture, probe, measure, "
                "teach, raw, reload, quit",
                what);
}

bool command_is_for_desk(enum job_kind kind)
{
    return kind == JOB_MEASURE || kind == JOB_TEACH || kind == JOB_RAW;
}

static bool save_light(const struct job *job, struct error *err)
{
    struct exr image;
    size_t plane = (size_t)job->width * job->height;
    if (!exr_init(&image, job->width, job->height, 3, err))
        return false;
    for (int c = 0; c < 3; c++) {
        snprintf(image.names[c], sizeof image.names[c], "%c", "XYZ"[c]);
        for (size_t i = 0; i < plane; i++)
            image.pixels[c * plane + i] = job->light[3 * i + c];
    }
    exr_set_text(&image, "boothd.unit", "cd/m2");
    bool fine = exr_save(job->name, &image, err);
    exr_fini(&image);
    return fine;
}

static json_t *capture_reply(const struct job *job, struct error *err)
{
    bool fine = job->light ? save_light(job, err)
                           : png_save_rgb8(job->name, job->width, job->height, job->picture, err);
    if (!fine)
        return NULL;
    return json_pack("{s:s, s:i, s:i}", "file", job->name, "width_px", job->width, "height_px",
                     job->height);
}

json_t *command_reply(struct job *job, const struct snapshot *now, struct error *err)
{
    if (job->picture || job->light)
        return capture_reply(job, err);
    json_t *reply = job->reply;
    job->reply = NULL;
    if (!reply)
        *err = job->err;
    else if (command_is_for_desk(job->kind))
        json_object_set_new(reply, "shown", status_shown(now));
    return reply;
}
