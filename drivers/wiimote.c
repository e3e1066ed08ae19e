// SPDX-License-Identifier: Apache-2.0
#include "drivers/wiimote.h"

#include <errno.h>
#include <hidapi.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <wchar.h>

#include "drivers/deadline.h"
#include "drivers/head.h"
#include "drivers/udev.h"

enum {
    OUT_MODE = 0x12,
    OUT_CAMERA_CLOCK = 0x13,
    OUT_WRITE = 0x16,
    OUT_CAMERA_LOGIC = 0x1a,
    IN_ACKNOWLEDGE = 0x22,
    IN_EXTENDED = 0x33,
    IN_BASIC = 0x37,
    IN_FULL_FIRST = 0x3e,
    IN_FULL_SECOND = 0x3f,
    ENABLE = 0x04,
    CONTINUOUS = 0x04,
    SPACE_REGISTERS = 0x04,
    CAMERA_RUN = 0x08,
    FULL_BLOB_BYTES = 9,
    BASIC_PAIR_BYTES = 5,
    WRITE_MOST = 16,
    PACE_MS = 30,     // between writes of the initialisation
    SILENCE_MS = 250, // after which the mode is asserted again
    TRAVEL_MS = 25,   // from exposure to the report's arrival
    SET_UP_MS = 400,  // a whole initialisation, with slack
    BLIND_MS = 1000,  // without a blob, before it is repeated; doubles each time
    BLIND_MOST_MS = 60000,
    MOST_SILENT = 4,
};

static const uint32_t reg_run = 0xb00030, reg_block1 = 0xb00000, reg_block2 = 0xb0001a,
                      reg_mode = 0xb00033;

// Which mode of the camera belongs to which report, and where its blobs begin.
static const struct {
    uint8_t mode, report;
    size_t bytes, offset;
    int frame_ms; // that the reports of one frame may lie apart
} formats[] = {
    [WIIMOTE_EXTENDED] = {3, IN_EXTENDED, 18, 6, 0}, // number, buttons, acceleration, blobs
    [WIIMOTE_BASIC] = {1, IN_BASIC, 22, 6, 0},       // the same, and an extension
    [WIIMOTE_FULL] = {5, IN_FULL_FIRST, 22, 4, 10},
};

static const struct {
    uint8_t block1[9], block2[2];
} sensitivities[] = {
    {{0x02, 0x00, 0x00, 0x71, 0x01, 0x00, 0x64, 0x00, 0xfe}, {0xfd, 0x05}},
    {{0x02, 0x00, 0x00, 0x71, 0x01, 0x00, 0x96, 0x00, 0xb4}, {0xb3, 0x04}},
    {{0x02, 0x00, 0x00, 0x71, 0x01, 0x00, 0xaa, 0x00, 0x64}, {0x63, 0x03}},
    {{0x02, 0x00, 0x00, 0x71, 0x01, 0x00, 0xc8, 0x00, 0x36}, {0x35, 0x03}},
    {{0x07, 0x00, 0x00, 0x71, 0x01, 0x00, 0x72, 0x00, 0x20}, {0x1f, 0x03}},
    {{0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x90, 0x00, 0x41}, {0x40, 0x00}},
};

const struct device_id wiimote_ids[] = {
    {DEVICE_BLUETOOTH, 0x057e, 0x0306, "Nintendo Wii remote (RVL-CNT-01)"},
    {DEVICE_BLUETOOTH, 0x057e, 0x0330, "Nintendo Wii remote plus (RVL-CNT-01-TR)"},
    {0},
};

struct tracker {
    struct tracker_options options;
    hid_device *hid;
    char model[64], serial[64];
    struct head_markers markers;
    struct head_memory memory;
    int silent;         // reads without a report, one after the other
    bool mode_lost;     // other reports came, or none: the camera may have lost its settings too
    int64_t blind_ns;   // since when there is no blob
    int blind_limit_ms; // before the camera is set up again
};

struct wiimote_blob wiimote_decode(const uint8_t b[3])
{
    struct wiimote_blob blob = {
        .x = b[0] | (b[2] & 0x30) << 4,
        .y = b[1] | (b[2] & 0xc0) << 2,
        .size = b[2] & 15,
    };
    blob.seen = blob.y < WIIMOTE_HEIGHT;
    return blob;
}

void wiimote_decode_basic(const uint8_t b[5], struct wiimote_blob out[2])
{
    out[0] = (struct wiimote_blob){.x = b[0] | (b[2] & 0x30) << 4, .y = b[1] | (b[2] & 0xc0) << 2};
    out[1] = (struct wiimote_blob){.x = b[3] | (b[2] & 0x03) << 8, .y = b[4] | (b[2] & 0x0c) << 6};
    for (int i = 0; i < 2; i++)
        out[i].seen = out[i].y < WIIMOTE_HEIGHT;
}

static bool belongs(enum wiimote_format format, uint8_t report)
{
    return report == formats[format].report || (format == WIIMOTE_FULL && report == IN_FULL_SECOND);
}

static bool take_full(const uint8_t *report, const uint8_t *blobs, struct wiimote_frame *frame)
{
    bool second = report[0] == IN_FULL_SECOND, whole = second && frame->half;
    for (int i = 0; i < 2; i++)
        frame->blobs[i + 2 * second] = wiimote_decode(blobs + FULL_BLOB_BYTES * i);
    frame->half = !second;
    return whole;
}

bool wiimote_report(enum wiimote_format format, const uint8_t *report, size_t count,
                    struct wiimote_frame *frame, bool *whole, struct error *err)
{
    if (count < 1 || !belongs(format, report[0]))
        return fail(err, ERROR_DATA, "report %02x instead of %02x", count ? report[0] : 0,
                    formats[format].report);
    if (count < formats[format].bytes)
        return fail(err, ERROR_DATA, "report of %zu bytes instead of %zu", count,
                    formats[format].bytes);
    const uint8_t *blobs = report + formats[format].offset;
    *whole = true;
    switch (format) {
    case WIIMOTE_EXTENDED:
        for (int i = 0; i < WIIMOTE_BLOBS; i++)
            frame->blobs[i] = wiimote_decode(blobs + 3 * i);
        return true;
    case WIIMOTE_BASIC:
        for (int i = 0; i < WIIMOTE_BLOBS; i += 2)
            wiimote_decode_basic(blobs + BASIC_PAIR_BYTES * i / 2, &frame->blobs[i]);
        return true;
    case WIIMOTE_FULL:
        *whole = take_full(report, blobs, frame);
        return true;
    }
    return false;
}

double wiimote_focal_px(double fov_deg)
{
    return WIIMOTE_WIDTH / 2.0 / tan(fov_deg * (M_PI / 360));
}

void wiimote_direction(struct wiimote_blob blob, double focal_px, double out[2])
{
    out[0] = -(blob.x - WIIMOTE_WIDTH / 2.0) / focal_px;
    out[1] = (blob.y - WIIMOTE_HEIGHT / 2.0) / focal_px;
}

static bool gone(struct error *err)
{
    return fail(err, ERROR_GONE, "the Wii remote is gone");
}

static bool put(struct tracker *t, const uint8_t *report, size_t count, struct error *err)
{
    return hid_write(t->hid, report, count) == (int)count || gone(err);
}

static bool assert_mode(struct tracker *t, struct error *err)
{
    return put(t, (const uint8_t[]){OUT_MODE, CONTINUOUS, formats[t->options.format].report}, 3,
               err);
}

// Lets PACE_MS pass while reading; *refused when an acknowledgement says so.
static bool pace(struct tracker *t, int64_t deadline_ns, bool *refused, struct error *err)
{
    int64_t until = clock_now_ns() + PACE_MS * NS_PER_MS;
    *refused = false;
    while (clock_now_ns() < until) {
        uint8_t r[32];
        int wait = deadline_ms(until, PACE_MS);
        int count = hid_read_timeout(t->hid, r, sizeof r, wait ? wait : 1);
        if (count < 0)
            return gone(err);
        if (count >= 5 && r[0] == IN_ACKNOWLEDGE && r[3] == OUT_WRITE && r[4] != 0)
            *refused = true;
    }
    return clock_now_ns() < deadline_ns ||
           fail(err, ERROR_RETRY, "the Wii remote was not set up in time");
}

static bool poke(struct tracker *t, uint32_t address, const uint8_t *bytes, size_t count,
                 int64_t deadline_ns, struct error *err)
{
    uint8_t report[6 + WRITE_MOST] = {OUT_WRITE,          SPACE_REGISTERS, address >> 16 & 255,
                                      address >> 8 & 255, address & 255,   (uint8_t)count};
    bool refused = true;
    memcpy(report + 6, bytes, count);
    for (int tries = 0; refused; tries++) {
        if (tries == 3)
            return fail(err, ERROR_DATA, "the Wii remote refuses to set register %06x", address);
        if (!put(t, report, sizeof report, err) || !pace(t, deadline_ns, &refused, err))
            return false;
    }
    return true;
}

static bool enable(struct tracker *t, uint8_t what, int64_t deadline_ns, struct error *err)
{
    bool refused;
    return put(t, (const uint8_t[]){what, ENABLE}, 2, err) && pace(t, deadline_ns, &refused, err);
}

static bool set_up(struct tracker *t, int64_t deadline_ns, struct error *err)
{
    const int level = t->options.sensitivity - 1;
    const uint8_t run = CAMERA_RUN, mode = formats[t->options.format].mode;
    return enable(t, OUT_CAMERA_CLOCK, deadline_ns, err) &&
           enable(t, OUT_CAMERA_LOGIC, deadline_ns, err) &&
           poke(t, reg_run, &run, 1, deadline_ns, err) &&
           poke(t, reg_block1, sensitivities[level].block1, 9, deadline_ns, err) &&
           poke(t, reg_block2, sensitivities[level].block2, 2, deadline_ns, err) &&
           poke(t, reg_mode, &mode, 1, deadline_ns, err) &&
           poke(t, reg_run, &run, 1, deadline_ns, err) && assert_mode(t, err);
}

// A camera may come up blind, or fall back to that; an observer may also just
// be away, so the pauses grow.
static bool cure_blindness(struct tracker *t, int seen, int64_t deadline_ns, struct error *err)
{
    int64_t now = clock_now_ns();
    if (seen > 0) {
        t->mode_lost = false;
        t->blind_ns = now;
        t->blind_limit_ms = BLIND_MS;
    }
    if (now - t->blind_ns < t->blind_limit_ms * NS_PER_MS)
        return true;
    if (deadline_ms(deadline_ns, SET_UP_MS) < SET_UP_MS)
        return !t->mode_lost || fail(err, ERROR_GONE, "the Wii remote lost its settings");
    t->mode_lost = false;
    t->blind_ns = now;
    t->blind_limit_ms = t->blind_limit_ms < BLIND_MOST_MS ? 2 * t->blind_limit_ms : BLIND_MOST_MS;
    return set_up(t, deadline_ns, err);
}

// The camera may have lost its settings with the mode: that is not the
// blindness whose pauses grow.
static void lose_mode(struct tracker *t)
{
    if (t->mode_lost)
        return;
    t->mode_lost = true;
    t->blind_ns = clock_now_ns();
    t->blind_limit_ms = BLIND_MS;
}

static void narrow(char *out, size_t size, const wchar_t *wide)
{
    size_t n = 0;
    for (; wide && *wide && n + 1 < size; wide++)
        out[n++] = *wide > 0 && *wide < 128 ? (char)*wide : '?';
    out[n] = 0;
}

static bool open_path(struct tracker *t, const struct hid_device_info *info, struct error *err)
{
    t->hid = hid_open_path(info->path);
    narrow(t->model, sizeof t->model, info->product_string);
    if (t->hid)
        return true;
    if (access(info->path, R_OK | W_OK) != 0 && errno == EACCES)
        return fail(err, ERROR_SYSTEM,
                    "%s: no permission; install the udev rules " UDEV_RULES_FILE
                    " (boothcal list --udev) and reconnect",
                    info->path);
    return fail(err, ERROR_GONE, "%s: the Wii remote cannot be opened", info->path);
}

static bool find(struct tracker *t, struct error *err)
{
    struct error why = {0};
    for (const struct device_id *id = wiimote_ids; id->name && !t->hid; id++) {
        struct hid_device_info *list =
            hid_enumerate((unsigned short)id->vendor, (unsigned short)id->product);
        for (struct hid_device_info *info = list; info && !t->hid; info = info->next) {
            narrow(t->serial, sizeof t->serial, info->serial_number);
            if (!*t->options.serial || !strcmp(t->options.serial, t->serial))
                open_path(t, info, &why);
        }
        hid_free_enumeration(list);
    }
    if (t->hid)
        return true;
    if (why.code)
        return fail(err, why.code, "%s", why.text);
    return fail(err, ERROR_GONE, "no Wii remote%s%s",
                *t->options.serial ? " with serial number " : "", t->options.serial);
}

static void wiimote_close(struct tracker *t)
{
    if (!t)
        return;
    if (t->hid)
        hid_close(t->hid);
    free(t);
}

static struct tracker *wiimote_open(const struct tracker_options *options, int64_t deadline_ns,
                                    struct error *err)
{
    struct tracker *t = calloc(1, sizeof *t);
    if (!t) {
        fail_errno(err, "opening the Wii remote");
        return NULL;
    }
    t->options = *options;
    t->markers = head_markers(options->marker, options->fourth_m);
    t->blind_ns = clock_now_ns();
    t->blind_limit_ms = BLIND_MS;
    if (find(t, err) && set_up(t, deadline_ns, err))
        return t;
    wiimote_close(t);
    return NULL;
}

// Throws away what queued up since the last read: its time is not known.
static bool forget_backlog(struct tracker *t, struct error *err)
{
    uint8_t r[32];
    int count = 1;
    for (int i = 0; i < 256 && count > 0; i++)
        count = hid_read_timeout(t->hid, r, sizeof r, 0);
    return count >= 0 || gone(err);
}

static bool fresh_blobs(struct tracker *t, int64_t deadline_ns, struct wiimote_frame *frame,
                        struct error *err)
{
    const enum wiimote_format format = (enum wiimote_format)t->options.format;
    struct error why = {0};
    for (int wait; (wait = deadline_ms(deadline_ns, SILENCE_MS)) > 0;) {
        uint8_t r[32];
        bool whole = false;
        int count = hid_read_timeout(t->hid, r, sizeof r, wait);
        if (count < 0)
            return gone(err);
        if (count > 0 && wiimote_report(format, r, (size_t)count, frame, &whole, &why) && whole)
            return true;
        if (count > 0 && belongs(format, r[0]))
            continue;
        lose_mode(t);
        if (!assert_mode(t, err))
            return false;
    }
    if (++t->silent >= MOST_SILENT)
        return fail(err, ERROR_GONE, "the Wii remote sends no camera reports");
    return fail(err, ERROR_RETRY, "no camera report in time%s%s", why.code ? ": " : "", why.text);
}

static bool wiimote_read(struct tracker *t, int64_t deadline_ns, struct head_sample *out,
                         struct error *err)
{
    struct wiimote_frame frame = {0};
    double directions[WIIMOTE_BLOBS][2], focal = wiimote_focal_px(t->options.fov_deg);
    const double *offset = t->options.eye_from_marker_m;
    int seen = 0;
    if (!forget_backlog(t, err) || !fresh_blobs(t, deadline_ns, &frame, err))
        return false;
    t->silent = 0;
    int64_t now = clock_now_ns();
    int travel_ms = TRAVEL_MS + formats[t->options.format].frame_ms;
    out->taken = (struct interval){now - travel_ms * NS_PER_MS, now};
    for (int i = 0; i < WIIMOTE_BLOBS; i++)
        if (frame.blobs[i].seen)
            wiimote_direction(frame.blobs[i], focal, directions[seen++]);
    head_solve(&t->memory, &t->markers, (struct vec3){offset[0], offset[1], offset[2]}, directions,
               seen, focal, now, out);
    return cure_blindness(t, seen, deadline_ns, err);
}

static void wiimote_identify(const struct tracker *t, struct instrument_identity *out)
{
    memset(out, 0, sizeof *out);
    snprintf(out->model, sizeof out->model, "%s", *t->model ? t->model : "Wii remote");
    snprintf(out->serial, sizeof out->serial, "%s", t->serial);
    out->emulated = !strncmp(t->serial, "EMU", 3);
}

const struct tracker_driver wiimote_driver = {"wiimote", wiimote_open, wiimote_read,
                                              wiimote_identify, wiimote_close};
