// SPDX-License-Identifier: Apache-2.0
#include "drivers/iio.h"

#include <errno.h>
#include <iio.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "drivers/deadline.h"
#include "drivers/found.h"
#include "drivers/modbus_map.h"
#include "drivers/udev.h"

enum {
    AXES = 3,
    TEXT = 128,
    PACE_LEAST_MS = 5,
    PACE_MOST_MS = 100,
    PACE_MS = 10,
    MOST_FAILURES = 5
};

static const double rotation_slack = 0.01;

// One axis: its channel and how it counts.
struct axis {
    const struct iio_channel *channel;
    const char *attribute; // "raw", or "input" when the kernel scales itself
    double scale, offset;
};

struct accelerometer {
    struct accelerometer_options options;
    struct iio_context *context;
    const struct iio_device *device;
    struct axis axes[AXES];
    struct mat3 mount;
    int screen_from_device[3]; // as modbus_map's axes
    int pace_ms;
    int64_t due_ns; // of the next reading
    int failures;
};

bool iio_mount_matrix(const char *text, struct mat3 *out, struct error *err)
{
    struct mat3 m;
    const char *at = text;
    bool fits = true;
    for (int i = 0; i < 9 && fits; i++) {
        char *end;
        m.m[i / 3][i % 3] = strtod(at, &end);
        fits = end != at && isfinite(m.m[i / 3][i % 3]);
        at = end + strspn(end, " \t\n,;");
    }
    if (!fits || *at)
        return fail(err, ERROR_DATA, "mount matrix \"%.80s\" is not nine numbers", text);
    struct mat3 unit = mat3_mul(m, mat3_transpose(m));
    for (int i = 0; i < 9; i++)
        fits = fits && fabs(unit.m[i / 3][i % 3] - (i % 4 == 0)) <= rotation_slack;
    if (!fits)
        return fail(err, ERROR_DATA, "mount matrix \"%.80s\" does not keep lengths and angles",
                    text);
    *out = m;
    return true;
}

static const struct iio_channel *channel_of(const struct iio_device *device, int which)
{
    const char *const ids[] = {"accel_x", "accel_y", "accel_z"};
    return iio_device_find_channel(device, ids[which], false);
}

static bool has_axes(const struct iio_device *device)
{
    for (int i = 0; i < AXES; i++)
        if (!channel_of(device, i))
            return false;
    return true;
}

static const char *name_of(const struct iio_device *device)
{
    const char *name = iio_device_get_name(device);
    return name ? name : "";
}

static const char *label_of(const struct iio_device *device)
{
    const char *label = iio_device_get_label(device);
    return label ? label : "";
}

static bool is_wanted(const struct iio_device *device, const char *wanted)
{
    return !*wanted || !strcmp(wanted, name_of(device)) || !strcmp(wanted, label_of(device)) ||
           !strcmp(wanted, iio_device_get_id(device));
}

static bool find_device(struct accelerometer *a, struct error *err)
{
    const char *wanted = a->options.iio_device;
    a->context = iio_create_local_context();
    unsigned count = a->context ? iio_context_get_devices_count(a->context) : 0;
    for (unsigned i = 0; i < count && !a->device; i++) {
        const struct iio_device *device = iio_context_get_device(a->context, i);
        if (has_axes(device) && is_wanted(device, wanted))
            a->device = device;
    }
    return a->device || fail(err, ERROR_GONE, "no IIO accelerometer%s%s",
                             *wanted ? " of name, label or number " : " with three axes", wanted);
}

static bool read_number(const struct iio_channel *channel, const char *attribute, double *out)
{
    char text[TEXT] = "", *end;
    ssize_t count = iio_channel_attr_read(channel, attribute, text, sizeof text - 1);
    if (count < 0) {
        errno = (int)-count;
        return false;
    }
    double value = strtod(text, &end);
    errno = EINVAL;
    if (end == text || *(end + strspn(end, " \n")) || !isfinite(value))
        return false;
    *out = value;
    return true;
}

static bool fail_read(const struct accelerometer *a, const struct iio_channel *channel,
                      enum error_code code, struct error *err)
{
    if (errno == EACCES || errno == EPERM)
        return fail(err, ERROR_SYSTEM,
                    "%s: no permission to read %s; install the udev rules " UDEV_RULES_FILE
                    " (boothcal list --udev)",
                    name_of(a->device), iio_channel_get_id(channel));
    return fail(err, code, "%s: %s: %s", name_of(a->device), iio_channel_get_id(channel),
                strerror(errno));
}

static bool set_up_axis(struct accelerometer *a, int which, struct error *err)
{
    struct axis *axis = &a->axes[which];
    const struct iio_channel *channel = channel_of(a->device, which);
    *axis = (struct axis){channel, "input", 1, 0};
    if (iio_channel_find_attr(channel, "input"))
        return true;
    axis->attribute = "raw";
    if (!iio_channel_find_attr(channel, "raw") || !iio_channel_find_attr(channel, "scale"))
        return fail(err, ERROR_DATA, "%s: %s has no raw value or no scale", name_of(a->device),
                    iio_channel_get_id(channel));
    if (!read_number(channel, "scale", &axis->scale) ||
        (iio_channel_find_attr(channel, "offset") &&
         !read_number(channel, "offset", &axis->offset)))
        return fail_read(a, channel, ERROR_SYSTEM, err) || while_doing(err, "scale or offset");
    return true;
}

// libiio files the matrix under a channel of its own, or under each axis.
static bool mount_text(const struct iio_device *device, const char *file, char text[TEXT])
{
    for (unsigned i = 0; i < iio_device_get_channels_count(device); i++) {
        const struct iio_channel *channel = iio_device_get_channel(device, i);
        for (unsigned k = 0; k < iio_channel_get_attrs_count(channel); k++) {
            const char *attribute = iio_channel_get_attr(channel, k);
            if (!strcmp(iio_channel_attr_get_filename(channel, attribute), file))
                return iio_channel_attr_read(channel, attribute, text, TEXT - 1) > 0;
        }
    }
    return iio_device_find_attr(device, file) &&
           iio_device_attr_read(device, file, text, TEXT - 1) > 0;
}

static bool set_up_mount(struct accelerometer *a, struct error *err)
{
    char text[TEXT] = "";
    a->mount = mat3_identity();
    if (!mount_text(a->device, "in_accel_mount_matrix", text) &&
        !mount_text(a->device, "in_mount_matrix", text))
        return true;
    return iio_mount_matrix(text, &a->mount, err) || while_doing(err, "%s", name_of(a->device));
}

// Reading faster than the sensor samples tells nothing new.
static void set_up_pace(struct accelerometer *a)
{
    double hz = 0;
    a->pace_ms = PACE_MS;
    if (!iio_channel_find_attr(a->axes[0].channel, "sampling_frequency") ||
        !read_number(a->axes[0].channel, "sampling_frequency", &hz) || !(hz > 0))
        return;
    double ms = 1000 / hz;
    a->pace_ms = ms < PACE_LEAST_MS ? PACE_LEAST_MS : ms > PACE_MOST_MS ? PACE_MOST_MS : (int)ms;
}

static void iio_close(struct accelerometer *a)
{
    if (!a)
        return;
    if (a->context)
        iio_context_destroy(a->context);
    free(a);
}

static struct accelerometer *iio_open(const struct accelerometer_options *options,
                                      int64_t deadline_ns, struct error *err)
{
    (void)deadline_ns;
    struct accelerometer *a = calloc(1, sizeof *a);
    if (!a) {
        fail_errno(err, "opening the accelerometer");
        return NULL;
    }
    a->options = *options;
    bool ok =
        accelerometer_axes(options->accel_axes, a->screen_from_device, err) && find_device(a, err);
    for (int i = 0; i < AXES && ok; i++)
        ok = set_up_axis(a, i, err);
    if (ok && set_up_mount(a, err)) {
        set_up_pace(a);
        return a;
    }
    iio_close(a);
    return NULL;
}

static bool read_axes(struct accelerometer *a, double out[AXES], struct error *err)
{
    for (int i = 0; i < AXES; i++) {
        const struct axis *axis = &a->axes[i];
        if (!read_number(axis->channel, axis->attribute, &out[i])) {
            bool gone = errno == ENODEV || errno == ENOENT || errno == ENXIO;
            gone = ++a->failures >= MOST_FAILURES || gone;
            return fail_read(a, axis->channel, gone ? ERROR_GONE : ERROR_RETRY, err);
        }
        out[i] = (out[i] + axis->offset) * axis->scale;
    }
    a->failures = 0;
    return true;
}

// The kernel gives no line to wait on without a buffer, so the pace is kept here.
static bool await_turn(const struct accelerometer *a, int64_t deadline_ns, struct error *err)
{
    if (a->due_ns >= deadline_ns)
        return fail(err, ERROR_RETRY, "%s: no time left", name_of(a->device));
    for (int wait; (wait = deadline_ms(a->due_ns, PACE_MOST_MS)) > 0;)
        poll(NULL, 0, wait);
    return true;
}

static bool iio_read(struct accelerometer *a, int64_t deadline_ns, struct tilt_sample *out,
                     struct error *err)
{
    double v[AXES];
    if (!await_turn(a, deadline_ns, err))
        return false;
    int64_t asked = clock_now_ns();
    a->due_ns = asked + a->pace_ms * NS_PER_MS;
    if (!read_axes(a, v, err))
        return false;
    struct vec3 device = mat3_apply(a->mount, (struct vec3){v[0], v[1], v[2]});
    struct tilt_sample sample = {.taken = {asked - a->pace_ms * NS_PER_MS, clock_now_ns()},
                                 .gravity = accelerometer_turn(a->screen_from_device, device),
                                 .angle_deg = NAN};
    sample.tilt_deg = tilt_wrap(tilt_of_gravity(sample.gravity) + a->options.offset_deg);
    tilt_judge(&sample, true);
    *out = sample;
    return true;
}

static bool is_emulated(const struct iio_device *device)
{
    return !strncmp(name_of(device), "EMU", 3) || !strncmp(label_of(device), "EMU", 3);
}

static void iio_identify(const struct accelerometer *a, struct instrument_identity *out)
{
    memset(out, 0, sizeof *out);
    found_text(out->model, sizeof out->model, name_of(a->device));
    found_text(out->serial, sizeof out->serial, label_of(a->device));
    out->emulated = is_emulated(a->device);
}

static bool readable(const struct iio_device *device, const char *place)
{
    const struct iio_channel *channel = channel_of(device, 0);
    const char *attribute = iio_channel_find_attr(channel, "input") ? "input" : "raw";
    char path[192];
    snprintf(path, sizeof path, "%s/%s", place, iio_channel_attr_get_filename(channel, attribute));
    return access(path, R_OK) == 0 || (errno != EACCES && errno != EPERM);
}

void found_iio(struct found_list *list)
{
    struct iio_context *context = iio_create_local_context();
    unsigned count = context ? iio_context_get_devices_count(context) : 0;
    for (unsigned i = 0; i < count; i++) {
        const struct iio_device *device = iio_context_get_device(context, i);
        char place[128];
        snprintf(place, sizeof place, "/sys/bus/iio/devices/%s", iio_device_get_id(device));
        struct found *f = has_axes(device) ? found_add(list, "accelerometer", "iio", place) : NULL;
        if (!f)
            continue;
        found_text(f->model, sizeof f->model, name_of(device));
        found_text(f->serial, sizeof f->serial, label_of(device));
        f->emulated = is_emulated(device);
        f->access = FOUND_USABLE; // its files are only read, so not as found_add judged
        *f->note = 0;
        if (!readable(device, place))
            found_refuse(f);
    }
    if (context)
        iio_context_destroy(context);
}

const struct accelerometer_driver iio_driver = {"iio",        iio_open,  iio_read,
                                                iio_identify, iio_close, true};
