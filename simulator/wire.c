// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "files/write.h"
#include "simulator/hid_device.h"
#include "simulator/model_detector.h"
#include "simulator/model_usb2000plus.h"
#include "simulator/model_wiimote.h"
#include "simulator/usb_device.h"
#include "simulator/wire_inclinometer.h"
#include "simulator/wire_radiometer.h"

enum { CALIBRATION_FIRST_NM = 340, CALIBRATION_LAST_NM = 1027 };
#define CALIBRATION_CENTRE_NM 560.0
#define CALIBRATION_SPAN_NM 180.0

struct wire {
    struct wire_options options;
    UMockdevTestbed *testbed;
    struct usb2000plus *spectrometer;
    struct usb_device *spectrometer_usb;
    struct wiimote *camera;
    struct hid_device_emulated *camera_hid;
    struct inclinometer *inclinometer;
    struct line *inclinometer_line;
    struct radiometer_end *radiometer;
    struct line *radiometer_line;

    pthread_mutex_t lock; // plugs and pulls one at a time
    bool pulled[WIRE_COUNT];
};

// ---- making ------------------------------------------------------------------------

static bool write_calibration(const struct wire_options *o, struct error *err)
{
    char path[512];
    struct whole_file file;
    snprintf(path, sizeof(path), "%s/spectrometer.cal", o->run_dir);
    if (!whole_file_begin(&file, path, err))
        return false;
    fprintf(file.stream, "nm,uJ_per_count\n");
    for (int nm = CALIBRATION_FIRST_NM; nm <= CALIBRATION_LAST_NM; nm++) {
        double slope = (nm - CALIBRATION_CENTRE_NM) / CALIBRATION_SPAN_NM;
        double k = detector_calibration(nm) * (1 + o->calibration_error * slope);
        fprintf(file.stream, "%d,%.8e\n", nm, k);
    }
    return whole_file_commit(&file, err);
}

static bool make_spectrometer(struct wire *w, struct error *err)
{
    struct usb2000plus_options options = {.around = w->options.around,
                                          .serial = w->options.serial[WIRE_SPECTROMETER],
                                          .seed = w->options.seed,
                                          .collector_mm2 = w->options.collector_mm2,
                                          .powered_ns = clock_now_ns()};
    w->spectrometer = usb2000plus_create(&options);
    if (!w->spectrometer)
        return fail(err, ERROR_SYSTEM, "out of memory");
    struct usb_model model = usb2000plus_model(w->spectrometer);
    w->spectrometer_usb = usb_device_create(w->testbed, &model, w->options.seed, err);
    return w->spectrometer_usb != NULL;
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

static bool make_lines(struct wire *w, struct error *err)
{
    w->inclinometer = inclinometer_create(&w->options, err);
    if (!w->inclinometer)
        return false;
    w->inclinometer_line = make_line(w, "inclinometer", inclinometer_end(w->inclinometer), err);
    if (!w->inclinometer_line)
        return false;
    w->radiometer = radiometer_create(&w->options, err);
    if (!w->radiometer)
        return false;
    w->radiometer_line = make_line(w, "radiometer", radiometer_end(w->radiometer), err);
    return w->radiometer_line != NULL;
}

// ---- plugs ---------------------------------------------------------------------------

static bool plug(struct wire *w, enum wire_instrument instrument, struct error *err)
{
    switch (instrument) {
    case WIRE_SPECTROMETER:
        return usb_device_plug(w->spectrometer_usb, err);
    case WIRE_INCLINOMETER:
        return line_plug(w->inclinometer_line, err);
    case WIRE_CAMERA:
        return hid_plug(w->camera_hid, err);
    case WIRE_RADIOMETER:
        return line_plug(w->radiometer_line, err);
    case WIRE_COUNT:
        break;
    }
    return fail(err, ERROR_RANGE, "no such instrument: %d", (int)instrument);
}

static void unplug(struct wire *w, enum wire_instrument instrument)
{
    switch (instrument) {
    case WIRE_SPECTROMETER:
        usb_device_unplug(w->spectrometer_usb);
        usb2000plus_power_on(w->spectrometer, clock_now_ns());
        break;
    case WIRE_INCLINOMETER:
        line_unplug(w->inclinometer_line);
        break;
    case WIRE_CAMERA:
        hid_unplug(w->camera_hid);
        wiimote_connect(w->camera);
        break;
    case WIRE_RADIOMETER:
        line_unplug(w->radiometer_line);
        break;
    case WIRE_COUNT:
        break;
    }
}

static void upset_camera(void *context)
{
    wiimote_upset(context);
}

static void set_fault(struct wire *w, enum wire_instrument instrument, enum wire_fault fault)
{
    switch (instrument) {
    case WIRE_SPECTROMETER:
        usb_device_set_fault(w->spectrometer_usb, fault);
        break;
    case WIRE_INCLINOMETER:
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
    case WIRE_COUNT:
        break;
    }
}

void wire_set_fault(struct wire *wire, enum wire_instrument instrument, enum wire_fault fault)
{
    if (instrument < 0 || instrument >= WIRE_COUNT)
        return;
    pthread_mutex_lock(&wire->lock);
    bool pulled = fault == WIRE_UNPLUGGED;
    if (pulled && !wire->pulled[instrument])
        unplug(wire, instrument);
    else if (!pulled && wire->pulled[instrument])
        pulled = !plug(wire, instrument, NULL); // stays pulled when the system has no terminal left
    wire->pulled[instrument] = pulled;
    set_fault(wire, instrument, fault);
    pthread_mutex_unlock(&wire->lock);
}

// ---- start and stop --------------------------------------------------------------------

static bool check(const struct wire_options *o, struct error *err)
{
    for (int i = 0; i < WIRE_COUNT; i++)
        if (!o->serial[i] || strncmp(o->serial[i], "EMU", 3) != 0)
            return fail(err, ERROR_CONFIG, "serial \"%s\": an emulated one begins with EMU",
                        o->serial[i] ? o->serial[i] : "");
    if (!(o->radiometer_hurry >= 1))
        return fail(err, ERROR_RANGE, "radiometer_hurry: %g is below 1", o->radiometer_hurry);
    if (!(o->collector_mm2 > 0))
        return fail(err, ERROR_RANGE, "collector_mm2: %g is not above 0", o->collector_mm2);
    return true;
}

static bool start(struct wire *w, struct error *err)
{
    w->testbed = umockdev_testbed_new();
    if (!umockdev_in_mock_environment()) // right only once there is a testbed
        return fail(err, ERROR_CONFIG, "umockdev-wrapper must run the program");
    if (!write_calibration(&w->options, err) || !make_spectrometer(w, err) ||
        !make_camera(w, err) || !make_lines(w, err))
        return false;
    for (int i = 0; i < WIRE_COUNT; i++)
        if (!plug(w, (enum wire_instrument)i, err))
            return false;
    return true;
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
    usb_device_destroy(wire->spectrometer_usb);
    hid_emulation_end(wire->camera_hid);
    line_destroy(wire->inclinometer_line);
    line_destroy(wire->radiometer_line);
    usb2000plus_destroy(wire->spectrometer);
    wiimote_destroy(wire->camera);
    inclinometer_destroy(wire->inclinometer);
    radiometer_destroy(wire->radiometer);
    g_clear_object(&wire->testbed);
    pthread_mutex_destroy(&wire->lock);
    free(wire);
}
