// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "files/write.h"
#include "simulator/hid_device.h"
#include "simulator/model_ooi.h"
#include "simulator/model_wiimote.h"
#include "simulator/usb_device.h"
#include "simulator/wire_inclinometer.h"
#include "simulator/wire_opentrack.h"
#include "simulator/wire_radiometer.h"
#include "simulator/wire_tcp.h"

enum { CALIBRATION_FIRST_NM = 340, CALIBRATION_LAST_NM = 1027 };
#define CALIBRATION_CENTRE_NM 560.0
#define CALIBRATION_SPAN_NM 180.0

enum { SPECTROMETERS = 2 };

struct spectrometer_end {
    struct ooi *model;
    struct usb_device *usb;
    bool blank; // without its firmware
};

struct wire {
    struct wire_options options;
    UMockdevTestbed *testbed;
    struct spectrometer_end spectrometers[SPECTROMETERS]; // the second may not be there
    struct wiimote *camera;
    struct hid_device_emulated *camera_hid;
    struct inclinometer *inclinometer;
    struct line *inclinometer_line; // or inclinometer_tcp
    struct tcp_end *inclinometer_tcp;
    struct radiometer_end *radiometer;
    struct line *radiometer_line;
    struct opentrack_end *opentrack; // may not run
    bool spotread_plugged;           // its instrument

    pthread_mutex_t lock; // plugs and pulls one at a time; guards what follows
    enum wire_fault fault[WIRE_COUNT];
    int64_t shows_ns[WIRE_COUNT]; // plugged in and not enumerated yet; 0 = neither
    int pulled[WIRE_COUNT];       // times
};

// ---- making ------------------------------------------------------------------------

static bool write_calibration(const struct wire *w, int which, struct error *err)
{
    const struct wire_options *o = &w->options;
    char path[512];
    struct whole_file file;
    snprintf(path, sizeof(path), "%s/spectrometer%s.cal", o->run_dir, which == 0 ? "" : "2");
    if (!whole_file_begin(&file, path, err))
        return false;
    fprintf(file.stream, "nm,uJ_per_count\n");
    for (int nm = CALIBRATION_FIRST_NM; nm <= CALIBRATION_LAST_NM; nm++) {
        double slope = (nm - CALIBRATION_CENTRE_NM) / CALIBRATION_SPAN_NM;
        double k = ooi_calibration(w->spectrometers[which].model, nm);
        fprintf(file.stream, "%d,%.8e\n", nm, k * (1 + o->calibration_error * slope));
    }
    return whole_file_commit(&file, err);
}

static bool make_spectrometer(struct wire *w, int which, enum wire_instrument instrument,
                              enum ooi_name kind, struct error *err)
{
    struct spectrometer_end *s = &w->spectrometers[which];
    struct ooi_options options = {.around = w->options.around,
                                  .kind = kind,
                                  .serial = w->options.serial[instrument],
                                  .seed = w->options.seed + (uint64_t)which,
                                  .collector_mm2 = w->options.collector_mm2,
                                  .powered_ns = clock_now_ns()};
    s->model = ooi_create(&options);
    if (!s->model)
        return fail(err, ERROR_SYSTEM, "out of memory");
    struct usb_model model = ooi_model(s->model);
    s->usb = usb_device_create(w->testbed, &w->lock, which + 1, &model, options.seed, err);
    return s->usb && write_calibration(w, which, err);
}

static bool is_there(const struct wire_options *o, enum wire_instrument instrument)
{
    const char *second = o->serial[WIRE_SPECTROMETER_2];
    if (instrument == WIRE_OPENTRACK)
        return o->opentrack_port > 0;
    return instrument != WIRE_SPECTROMETER_2 || (second && *second);
}

static bool make_spectrometers(struct wire *w, struct error *err)
{
    const struct wire_options *o = &w->options;
    return make_spectrometer(w, 0, WIRE_SPECTROMETER, o->model, err) &&
           (!is_there(o, WIRE_SPECTROMETER_2) ||
            make_spectrometer(w, 1, WIRE_SPECTROMETER_2, o->model_2, err));
}

static bool make_opentrack(struct wire *w, struct error *err)
{
    w->opentrack = opentrack_end_create(&w->options, err);
    return w->opentrack != NULL;
}

static bool make_camera(struct wire *w, struct error *err)
{
    struct wiimote_options options = {.around = w->options.around,
                                      .serial = w->options.serial[WIRE_CAMERA],
                                      .seed = w->options.seed,
                                      .pitch_deg = w->options.camera_pitch_deg};
    w->camera = wiimote_create(&options);
    if (!w->camera)
        return fail(err, ERROR_SYSTEM, "out of memory");
    struct hid_model model = wiimote_model(w->camera);
    w->camera_hid = hid_emulate(w->testbed, &model, w->options.seed, err);
    return w->camera_hid != NULL;
}

static struct line *make_line(struct wire *w, const char *name, struct line_end end,
                              struct error *err)
{
    char path[512];
    snprintf(path, sizeof(path), "%s/%s", w->options.run_dir, name);
    return line_create(path, &end, err);
}

static bool make_inclinometer(struct wire *w, struct error *err)
{
    char path[512];
    w->inclinometer = inclinometer_create(&w->options, err);
    if (!w->inclinometer)
        return false;
    struct line_end end = inclinometer_end(w->inclinometer);
    snprintf(path, sizeof(path), "%s/inclinometer.port", w->options.run_dir);
    if (w->options.inclinometer_tcp)
        w->inclinometer_tcp = tcp_create(w->options.inclinometer_port, path, &end, err);
    else
        w->inclinometer_line = make_line(w, "inclinometer", end, err);
    return w->inclinometer_tcp || w->inclinometer_line;
}

static bool make_lines(struct wire *w, struct error *err)
{
    if (!make_inclinometer(w, err))
        return false;
    w->radiometer = radiometer_create(&w->options, err);
    if (!w->radiometer)
        return false;
    w->radiometer_line = make_line(w, "radiometer", radiometer_end(w->radiometer), err);
    return w->radiometer_line != NULL;
}

// ---- plugs ---------------------------------------------------------------------------

static struct spectrometer_end *spectrometer(struct wire *w, enum wire_instrument instrument)
{
    return &w->spectrometers[instrument == WIRE_SPECTROMETER ? 0 : 1];
}

static bool plug(struct wire *w, enum wire_instrument instrument, struct error *err)
{
    switch (instrument) {
    case WIRE_SPECTROMETER:
    case WIRE_SPECTROMETER_2:
        return usb_device_plug(spectrometer(w, instrument)->usb, err);
    case WIRE_INCLINOMETER:
        return w->inclinometer_tcp ? tcp_plug(w->inclinometer_tcp, err)
                                   : line_plug(w->inclinometer_line, err);
    case WIRE_CAMERA:
        return hid_plug(w->camera_hid, err);
    case WIRE_RADIOMETER:
        return line_plug(w->radiometer_line, err);
    case WIRE_OPENTRACK: // a program has no plug
        return true;
    case WIRE_SPOTREAD:
        return w->spotread_plugged = true;
    case WIRE_COUNT:
        break;
    }
    return fail(err, ERROR_RANGE, "no such instrument: %d", (int)instrument);
}

static bool is_plugged(const struct wire *w, enum wire_instrument instrument)
{
    switch (instrument) {
    case WIRE_SPECTROMETER:
    case WIRE_SPECTROMETER_2:
        return usb_device_is_plugged(w->spectrometers[instrument == WIRE_SPECTROMETER_2].usb);
    case WIRE_INCLINOMETER:
        return w->inclinometer_tcp ? tcp_is_plugged(w->inclinometer_tcp)
                                   : line_is_plugged(w->inclinometer_line);
    case WIRE_CAMERA:
        return hid_is_plugged(w->camera_hid);
    case WIRE_RADIOMETER:
        return line_is_plugged(w->radiometer_line);
    case WIRE_OPENTRACK:
        return true;
    case WIRE_SPOTREAD:
        return w->spotread_plugged;
    case WIRE_COUNT:
        break;
    }
    return false;
}

static double enumeration_s(const struct wire *w, enum wire_instrument instrument)
{
    if (1u << instrument & (WIRE_ON_USB | WIRE_ON_HID | WIRE_ON_PROCESS))
        return w->options.enumeration_s;
    return w->inclinometer_tcp && instrument == WIRE_INCLINOMETER ? 0
                                                                  : w->options.line_enumeration_s;
}

static void unplug(struct wire *w, enum wire_instrument instrument)
{
    switch (instrument) {
    case WIRE_SPECTROMETER:
    case WIRE_SPECTROMETER_2:
        usb_device_unplug(spectrometer(w, instrument)->usb);
        break;
    case WIRE_INCLINOMETER:
        if (w->inclinometer_tcp)
            tcp_unplug(w->inclinometer_tcp);
        else
            line_unplug(w->inclinometer_line);
        break;
    case WIRE_CAMERA:
        hid_unplug(w->camera_hid);
        wiimote_connect(w->camera);
        break;
    case WIRE_RADIOMETER:
        line_unplug(w->radiometer_line);
        break;
    case WIRE_OPENTRACK:
        break;
    case WIRE_SPOTREAD:
        w->spotread_plugged = false;
        break;
    case WIRE_COUNT:
        break;
    }
}

static void upset_camera(void *context)
{
    wiimote_upset(context);
}

struct upset {
    struct ooi *model;
    enum ooi_upset how;
};

static void upset_model(void *context)
{
    struct upset *upset = context;
    ooi_upset(upset->model, upset->how);
}

static enum ooi_upset upset_of(enum wire_fault fault)
{
    return fault == WIRE_DEAF           ? OOI_DEAF
           : fault == WIRE_NO_SYNC      ? OOI_NO_SYNC
           : fault == WIRE_BAD_SYNC     ? OOI_BAD_SYNC
           : fault == WIRE_OUT_OF_STEP  ? OOI_OUT_OF_STEP
           : fault == WIRE_OTHER_PIXELS ? OOI_OTHER_PIXELS
                                        : OOI_WELL;
}

static void set_usb_fault(struct spectrometer_end *s, enum wire_fault fault)
{
    struct upset upset = {s->model, upset_of(fault)};
    usb_device_set_fault(s->usb, fault);
    usb_with_model(s->usb, upset_model, &upset);
}

static void set_fault(struct wire *w, enum wire_instrument instrument, enum wire_fault fault)
{
    switch (instrument) {
    case WIRE_SPECTROMETER:
    case WIRE_SPECTROMETER_2:
        set_usb_fault(spectrometer(w, instrument), fault);
        break;
    case WIRE_INCLINOMETER:
        if (w->inclinometer_tcp)
            tcp_set_fault(w->inclinometer_tcp, fault);
        else
            line_set_fault(w->inclinometer_line, fault);
        break;
    case WIRE_CAMERA:
        hid_set_fault(w->camera_hid, fault);
        if (fault == WIRE_STALL)
            hid_with_model(w->camera_hid, upset_camera, w->camera);
        break;
    case WIRE_RADIOMETER:
        line_set_fault(w->radiometer_line, fault);
        break;
    case WIRE_OPENTRACK:
        opentrack_end_set_fault(w->opentrack, fault);
        break;
    case WIRE_SPOTREAD: // asks for it
        break;
    case WIRE_COUNT:
        break;
    }
}

static void pull_usb(struct spectrometer_end *s, enum wire_fault fault)
{
    bool blank = fault == WIRE_BLANK;
    if (blank != s->blank) {
        struct usb_model face = blank ? usb_blank_model() : ooi_model(s->model);
        usb_device_become(s->usb, &face);
        s->blank = blank;
    }
    if (fault == WIRE_MOVED)
        usb_device_move(s->usb);
}

static void show(struct wire *w, enum wire_instrument instrument)
{
    w->shows_ns[instrument] = 0;
    plug(w, instrument, NULL);
    set_fault(w, instrument, w->fault[instrument]);
}

static void come_back(struct wire *w, enum wire_instrument instrument)
{
    double takes_s = enumeration_s(w, instrument);
    if (is_plugged(w, instrument) || w->shows_ns[instrument])
        return;
    if (takes_s > 0)
        w->shows_ns[instrument] = clock_now_ns() + (int64_t)(takes_s * NS_PER_S);
    else
        plug(w, instrument, NULL); // stays pulled when the system has no terminal left
}

void wire_set_fault(struct wire *wire, enum wire_instrument instrument, enum wire_fault fault)
{
    struct wire *w = wire;
    if (!wire_fault_suits(instrument, fault) || !is_there(&w->options, instrument))
        return;
    pthread_mutex_lock(&w->lock);
    w->fault[instrument] = fault;
    if (fault == WIRE_UNPLUGGED) {
        w->shows_ns[instrument] = 0;
        w->pulled[instrument]++;
        unplug(w, instrument);
    } else {
        if (1u << instrument & WIRE_ON_USB)
            pull_usb(spectrometer(w, instrument), fault);
        if (fault == WIRE_FORBIDDEN) // nobody is to open it before
            set_fault(w, instrument, fault);
        come_back(w, instrument);
    }
    set_fault(w, instrument, fault);
    pthread_mutex_unlock(&w->lock);
}

enum wire_fault wire_fault_of(struct wire *wire, enum wire_instrument instrument, int *pulled)
{
    pthread_mutex_lock(&wire->lock);
    enum wire_fault fault = wire->fault[instrument];
    if (!is_plugged(wire, instrument))
        fault = WIRE_UNPLUGGED;
    *pulled = wire->pulled[instrument];
    pthread_mutex_unlock(&wire->lock);
    return fault;
}

void wire_enumerate(struct wire *wire, int64_t now_ns)
{
    pthread_mutex_lock(&wire->lock);
    for (int i = 0; i < WIRE_COUNT; i++)
        if (wire->shows_ns[i] && wire->shows_ns[i] <= now_ns)
            show(wire, (enum wire_instrument)i);
    pthread_mutex_unlock(&wire->lock);
}

// ---- start and stop --------------------------------------------------------------------

static bool check(const struct wire_options *o, struct error *err)
{
    for (int i = 0; i < WIRE_COUNT; i++)
        if (i == WIRE_OPENTRACK || i == WIRE_SPOTREAD || !is_there(o, (enum wire_instrument)i))
            continue; // has no serial number
        else if (!o->serial[i] || strncmp(o->serial[i], "EMU", 3) != 0)
            return fail(err, ERROR_CONFIG, "serial \"%s\": an emulated one begins with EMU",
                        o->serial[i] ? o->serial[i] : "");
    if (!(o->radiometer_hurry >= 1))
        return fail(err, ERROR_RANGE, "radiometer_hurry: %g is below 1", o->radiometer_hurry);
    if (!(o->enumeration_s >= 0 && o->line_enumeration_s >= 0))
        return fail(err, ERROR_RANGE, "enumeration_s: is below 0");
    if (o->radiometer_lapses.misread_every < 1)
        return fail(err, ERROR_RANGE, "misread_every: %d is below 1",
                    o->radiometer_lapses.misread_every);
    if (!(o->collector_mm2 > 0))
        return fail(err, ERROR_RANGE, "collector_mm2: %g is not above 0", o->collector_mm2);
    if (is_there(o, WIRE_OPENTRACK) && !(o->opentrack_rate_hz > 0 && o->around.head))
        return fail(err, ERROR_RANGE, "opentrack: needs a rate and a head");
    return true;
}

static bool start(struct wire *w, struct error *err)
{
    w->testbed = umockdev_testbed_new();
    if (!umockdev_in_mock_environment()) // right only once there is a testbed
        return fail(err, ERROR_CONFIG, "umockdev-wrapper must run the program");
    if (!make_spectrometers(w, err) || !make_camera(w, err) || !make_lines(w, err))
        return false;
    bool good = true;
    pthread_mutex_lock(&w->lock);
    for (int i = 0; good && i < WIRE_COUNT; i++)
        if (is_there(&w->options, (enum wire_instrument)i))
            good = plug(w, (enum wire_instrument)i, err);
    pthread_mutex_unlock(&w->lock);
    return good && (!is_there(&w->options, WIRE_OPENTRACK) || make_opentrack(w, err));
}

struct wire *wire_start(const struct wire_options *options, struct error *err)
{
    if (!check(options, err))
        return NULL;
    struct wire *w = calloc(1, sizeof(*w));
    if (!w) {
        fail(err, ERROR_SYSTEM, "out of memory");
        return NULL;
    }
    w->options = *options;
    pthread_mutex_init(&w->lock, NULL);
    if (start(w, err))
        return w;
    while_doing(err, "emulating the instruments");
    wire_stop(w);
    return NULL;
}

void wire_stop(struct wire *wire)
{
    if (!wire)
        return;
    opentrack_end_destroy(wire->opentrack);
    for (int i = 0; i < SPECTROMETERS; i++)
        usb_device_destroy(wire->spectrometers[i].usb);
    hid_emulation_end(wire->camera_hid);
    line_destroy(wire->inclinometer_line);
    tcp_destroy(wire->inclinometer_tcp);
    line_destroy(wire->radiometer_line);
    for (int i = 0; i < SPECTROMETERS; i++)
        ooi_destroy(wire->spectrometers[i].model);
    wiimote_destroy(wire->camera);
    inclinometer_destroy(wire->inclinometer);
    radiometer_destroy(wire->radiometer);
    g_clear_object(&wire->testbed);
    pthread_mutex_destroy(&wire->lock);
    free(wire);
}
