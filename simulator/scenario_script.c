// SPDX-License-Identifier: Apache-2.0
#include "simulator/scenario_script.h"

#include <stdlib.h>
#include <string.h>

#include "files/write.h"
#include "simulator/wire.h"

enum { WORDS_MOST = 12, SCRIPT_BYTES_MOST = 16 << 20 };

static const char *const instruments[] = {
#define X(name, text) text,
    WIRE_INSTRUMENTS(X)
#undef X
        NULL};

static const char *const faults[] = {
#define X(name, text, wires) text,
    WIRE_FAULTS(X)
#undef X
        NULL};

static int index_of(const char *const *names, const char *name)
{
    for (int i = 0; names[i]; i++)
        if (!strcmp(names[i], name))
            return i;
    return -1;
}

static bool within(const char *what, double value, double least, double most, const char *unit,
                   struct error *err)
{
    if (value >= least && value <= most)
        return true;
    return fail(err, ERROR_RANGE, "%s: %g is outside %g..%g%s%s", what, value, least, most,
                *unit ? " " : "", unit);
}

bool event_lamp(const struct scenario *scenario, const char *name, double level, bool add,
                struct event *out, struct error *err)
{
    int lamp = scenario_lamp_index(scenario, name);
    if (lamp < 0 && (add || strcmp(name, "none"))) {
        char list[SCENARIO_LAMPS_MOST * (SCENARIO_NAME_SIZE + 2) + 8] = "none";
        for (int i = 0; i < SCENARIO_LAMPS_MOST; i++)
            if (scenario->lamps[i].name[0])
                strcat(strcat(list, ", "), scenario->lamps[i].name);
        return fail(err, ERROR_RANGE, "lamp: \"%s\" is not one of: %s", name, list);
    }
    if (!within("level", level, 0, 1.2, "", err))
        return false;
    *out = (struct event){.kind = add ? EVENT_ADD : EVENT_LAMP, .lamp = lamp, .level = level};
    return true;
}

bool event_tilt(double tilt_deg, double over_s, struct event *out, struct error *err)
{
    if (!within("tilt", tilt_deg, -90, 180, "deg", err) ||
        !within("over", over_s, 0, 1e6, "s", err))
        return false;
    *out = (struct event){.kind = EVENT_TILT, .tilt_deg = tilt_deg, .over_s = over_s};
    return true;
}

bool event_head(struct vec3 eye_m, double over_s, struct event *out, struct error *err)
{
    if (!within("head x", eye_m.x, -5, 5, "m", err) ||
        !within("head y", eye_m.y, -5, 5, "m", err) ||
        !within("head z", eye_m.z, -5, 5, "m", err) || !within("over", over_s, 0, 1e6, "s", err))
        return false;
    *out = (struct event){.kind = EVENT_HEAD, .eye_m = eye_m, .over_s = over_s};
    return true;
}

bool event_aim(const struct scenario *scenario, const struct aim *aim, struct event *out,
               struct error *err)
{
    bool good = false;
    switch (aim->target) {
    case AIM_SCREEN:
        good = within("aim x", aim->x, 0, scenario->screen.width_px - 1, "px", err) &&
               within("aim y", aim->y, 0, scenario->screen.height_px - 1, "px", err);
        break;
    case AIM_CEILING: {
        const struct scenario_ceiling *c = &scenario->ceiling;
        good = within("aim x", aim->x, c->centre_m[0] - c->width_m / 2,
                      c->centre_m[0] + c->width_m / 2, "m", err) &&
               within("aim z", aim->y, c->centre_m[2] - c->depth_m / 2,
                      c->centre_m[2] + c->depth_m / 2, "m", err);
        break;
    }
    }
    if (good)
        *out = (struct event){.kind = EVENT_AIM, .aim = *aim};
    return good;
}

static bool unknown(const char *what, const char *name, const char *const *names, struct error *err)
{
    char list[384] = "";
    for (int i = 0; names[i]; i++)
        snprintf(list + strlen(list), sizeof list - strlen(list), "%s%s", i ? ", " : "", names[i]);
    return fail(err, ERROR_RANGE, "%s: \"%s\" is not one of: %s", what, name, list);
}

static bool unknown_fault(int instrument, const char *kind, struct error *err)
{
    enum { FAULTS = sizeof(faults) / sizeof(faults[0]) };
    const char *suiting[FAULTS] = {0};
    for (int i = 0, count = 0; faults[i]; i++)
        if (wire_fault_suits((enum wire_instrument)instrument, (enum wire_fault)i))
            suiting[count++] = faults[i];
    return unknown("fault", kind, suiting, err);
}

bool event_fault(const char *instrument, const char *kind, struct event *out, struct error *err)
{
    int which = index_of(instruments, instrument), how = index_of(faults, kind);
    if (which < 0)
        return unknown("instrument", instrument, instruments, err);
    if (how < 0 || !wire_fault_suits((enum wire_instrument)which, (enum wire_fault)how))
        return unknown_fault(which, kind, err);
    *out = (struct event){.kind = EVENT_FAULT, .instrument = which, .fault = how};
    return true;
}

struct words {
    int count, used;
    char *word[WORDS_MOST];
};

static bool number(struct words *w, const char *what, double *value, struct error *err)
{
    if (w->used == w->count)
        return fail(err, ERROR_CONFIG, "%s is missing", what);
    const char *text = w->word[w->used++];
    char *end;
    *value = strtod(text, &end);
    if (end == text || *end || !isfinite(*value))
        return fail(err, ERROR_CONFIG, "%s: \"%s\" is not a number", what, text);
    return true;
}

static bool name(struct words *w, const char *what, const char **text, struct error *err)
{
    if (w->used == w->count)
        return fail(err, ERROR_CONFIG, "%s is missing", what);
    *text = w->word[w->used++];
    return true;
}

static bool next_is(struct words *w, const char *text)
{
    if (w->used == w->count || strcmp(w->word[w->used], text))
        return false;
    w->used++;
    return true;
}

static bool place(struct words *w, const char *what, struct vec3 *out, struct error *err)
{
    return number(w, what, &out->x, err) && number(w, what, &out->y, err) &&
           number(w, what, &out->z, err);
}

static bool parse_aim(const struct scenario *s, struct words *w, struct event *out,
                      struct error *err)
{
    struct aim aim = {.target = AIM_SCREEN};
    if (next_is(w, "ceiling"))
        aim.target = AIM_CEILING;
    else if (!next_is(w, "screen"))
        return fail(err, ERROR_CONFIG, "aim: \"%s\" is neither screen nor ceiling",
                    w->used < w->count ? w->word[w->used] : "");
    if (!number(w, "aim x", &aim.x, err) || !number(w, "aim y", &aim.y, err))
        return false;
    if (aim.target == AIM_SCREEN && next_is(w, "from")) {
        aim.from_given = true;
        if (!place(w, "from", &aim.from_m, err))
            return false;
    }
    return event_aim(s, &aim, out, err);
}

static bool parse_event(const struct scenario *s, struct words *w, struct event *out,
                        struct error *err)
{
    const char *what = "", *text = NULL, *kind = NULL;
    double value, over = 0;
    struct vec3 eye;
    if (!name(w, "what happens", &what, err))
        return false;
    if (!strcmp(what, "lamp") || !strcmp(what, "add")) {
        bool add = *what == 'a';
        value = 1;
        return name(w, "lamp", &text, err) &&
               ((!add && w->used == w->count) || number(w, "level", &value, err)) &&
               event_lamp(s, text, value, add, out, err);
    }
    if (!strcmp(what, "tilt"))
        return number(w, "tilt", &value, err) &&
               (!next_is(w, "over") || number(w, "over", &over, err)) &&
               event_tilt(value, over, out, err);
    if (!strcmp(what, "head"))
        return place(w, "head", &eye, err) &&
               (!next_is(w, "over") || number(w, "over", &over, err)) &&
               event_head(eye, over, out, err);
    if (!strcmp(what, "aim"))
        return parse_aim(s, w, out, err);
    if (!strcmp(what, "fault"))
        return name(w, "instrument", &text, err) && name(w, "fault", &kind, err) &&
               event_fault(text, kind, out, err);
    return fail(err, ERROR_CONFIG, "\"%s\" is not one of: lamp, add, tilt, head, aim, fault", what);
}

static bool parse_line(const struct scenario *s, char *line, struct event *out, bool *empty,
                       struct error *err)
{
    struct words w = {0};
    line[strcspn(line, "#")] = 0;
    char *rest = line, *word;
    while ((word = strtok_r(rest, " \t\r", &rest))) {
        if (w.count == WORDS_MOST)
            return fail(err, ERROR_CONFIG, "more than %d words", WORDS_MOST);
        w.word[w.count++] = word;
    }
    *empty = w.count == 0;
    if (*empty)
        return true;
    double at;
    if (!number(&w, "time", &at, err))
        return false;
    if (!within("time", at, 0, 1e9, "s", err) || !parse_event(s, &w, out, err))
        return false;
    if (w.used < w.count)
        return fail(err, ERROR_CONFIG, "\"%s\" is one word too many", w.word[w.used]);
    out->at_s = at;
    return true;
}

static bool append(struct event **events, int *count, const struct event *event, struct error *err)
{
    struct event *more = realloc(*events, (*count + 1) * sizeof *more);
    if (!more)
        return fail(err, ERROR_SYSTEM, "out of memory");
    *events = more;
    int at = (*count)++;
    for (; at > 0 && more[at - 1].at_s > event->at_s; at--)
        more[at] = more[at - 1];
    more[at] = *event;
    return true;
}

bool script_load(const char *path, const struct scenario *scenario, struct event **events,
                 int *count, struct error *err)
{
    size_t size;
    char *text = file_read(path, SCRIPT_BYTES_MOST, &size, err);
    if (!text)
        return false;
    *events = NULL;
    *count = 0;
    bool good = true;
    int line_number = 0;
    for (char *line = text, *end; good && line < text + size; line = end + 1) {
        struct event event;
        bool empty;
        end = line + strcspn(line, "\n");
        *end = 0;
        line_number++;
        good = parse_line(scenario, line, &event, &empty, err) &&
               (empty || append(events, count, &event, err));
    }
    free(text);
    if (good)
        return true;
    if (err && err->code == ERROR_RANGE)
        err->code = ERROR_CONFIG;
    free(*events);
    *events = NULL;
    return while_doing(err, "%s:%d", path, line_number);
}
