// SPDX-License-Identifier: Apache-2.0
// What a row of the table sees of boothd: its status and its log.
#include "tests/fakes/support.h"

#include "tests/whole/running.h"

#include "tests/whole/faults.h"

static const int64_t LOOK_NS = 30 * NS_PER_MS;

const char *effect_text(enum effect effect)
{
    static const char *const texts[] = {
#define X(name, text) text,
        EFFECTS(X)
#undef X
    };
    return texts[effect];
}

const char *row_name(const struct row *row)
{
    return row->name ? row->name : row->fault;
}

bool found(struct row *row, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    if (!*row->finding)
        vsnprintf(row->finding, sizeof row->finding, format, args);
    va_end(args);
    return false;
}

bool look_at(struct lane *lane, struct row *row, struct look *look)
{
    char path[64];
    json_t *status = booth_status(lane->daemon);
    *look = (struct look){.answered_ns = clock_now_ns()};
    if (!status)
        return found(row, "boothd does not answer");
    snprintf(path, sizeof path, "instruments.%s", lane->kind->name);
    const json_t *instrument = dig(status, path);
    snprintf(look->state, sizeof look->state, "%s", dig_text(instrument, "state"));
    snprintf(look->error, sizeof look->error, "%s", dig_text(instrument, "last_error"));
    look->samples = dig_real(instrument, "samples");
    look->age_ms = dig_real(instrument, "age_ms");
    look->overdue_ms = dig_real(instrument, "overdue_ms");
    if (lane->kind->value)
        lane->kind->value(status, look->value, &look->held_ms);
    json_decref(status);
    return true;
}

bool look_again(struct lane *lane, struct row *row, struct look *look)
{
    clock_sleep_until_ns(clock_now_ns() + LOOK_NS);
    return look_at(lane, row, look);
}

bool is_true_value(const struct lane *lane, const struct look *look)
{
    return !lane->kind->is_true || lane->kind->is_true(lane, look->value);
}

bool dim(struct lane *lane, struct row *row, double level)
{
    json_t *request = json_pack("{ss,ss,sf}", "do", "lamp", "name", "D50", "level", level);
    json_t *reply = control_call(lane->booth, request, BOOTH_CALL_MS, NULL);
    json_decref(reply);
    return reply || found(row, "boothsim does not dim its lamp");
}

bool cause(struct lane *lane, struct row *row, const char *fault)
{
    const char *on = row->on ? row->on : lane->kind->instrument;
    return (lane->kind->cause ? lane->kind->cause(lane, fault)
                              : booth_fault(lane->booth, on, fault)) ||
           found(row, "\"%s\" cannot be brought about", fault);
}

// State in a line of the log, "waiting: ..."; NULL when the line is another's.
static const char *state_in(const char *line, const char *name, size_t *size)
{
    char start[64];
    int length = snprintf(start, sizeof start, "boothd: %s: ", name);
    if (strncmp(line, start, (size_t)length))
        return NULL;
    *size = strcspn(line + length, ":\n");
    return line + length;
}

int changes_logged(struct lane *lane, struct row *row, long from)
{
    char last[32], *text = booth_log(lane->here, from);
    int count = 0;
    snprintf(last, sizeof last, "%s", lane->kind->runs);
    for (char *line = text; *line; line = strchr(line, '\n') ? strchr(line, '\n') + 1 : "") {
        size_t size;
        const char *state = state_in(line, lane->kind->name, &size);
        if (!state)
            continue;
        if (size == strlen(last) && !strncmp(state, last, size))
            found(row, "\"%s\" was logged twice in a row", last);
        snprintf(last, sizeof last, "%.*s", (int)size, state);
        count++;
    }
    free(text);
    if (strcmp(last, lane->kind->runs))
        found(row, "the last line of the log is still \"%s\"", last);
    return count;
}

bool measures(struct lane *lane, int timeout_s, double *luminance, struct error *err)
{
    json_t *reply =
        control_call(lane->daemon, json_pack("{ss,si}", "do", "measure", "timeout_s", timeout_s),
                     BOOTH_CALL_MS, err);
    *luminance = json_number_value(json_array_get(json_object_get(reply, "XYZ"), 1));
    json_decref(reply);
    return reply;
}
