// SPDX-License-Identifier: Apache-2.0
// Which instruments are plugged in, and whether this user may open them.
#ifndef DRIVERS_FOUND_H
#define DRIVERS_FOUND_H

#include <stddef.h>
#include <stdint.h>

#include "base/error.h"

#define FOUND_ACCESSES(X)                                                                          \
    X(USABLE, "usable")                                                                            \
    X(REFUSED, "refused") /* no permission: the udev rules are missing */                          \
    X(IN_USE, "in use")   /* another program holds it, such as boothd */                           \
    X(FAULTY, "faulty")   /* opened, but it does not answer as it should */

enum found_access {
#define X(name, text) FOUND_##name,
    FOUND_ACCESSES(X)
#undef X
};

const char *found_access_name(enum found_access access);

// Texts are printable ASCII; empty where the instrument does not tell.
struct found {
    char kind[24];   // "spectrometer", "tracker", "accelerometer", "radiometer", "serial line"
    char driver[24]; // as in the settings; "" for a line that several drivers could use
    char place[128]; // node or port: "/dev/bus/usb/001/004", "/dev/ttyUSB0"
    char model[64], serial[64], firmware[64];
    bool emulated; // it says of itself that it is emulated
    enum found_access access;
    char note[200]; // why it is not usable, "" when it is
};

enum { FOUND_MOST = 64 };

// Devices beyond the room are left out.
struct found_list {
    int count;
    struct found of[FOUND_MOST];
};

// Each adds what it finds; nothing found is no error. Spectrometers are asked
// for serial number and firmware, which needs them free; the others are
// described by what their buses know. Serial lines are not spoken to: anything
// may hang on them. Returns soon after deadline_ns even when a unit is silent.
void found_spectrometers(struct found_list *list, int64_t deadline_ns);
void found_trackers(struct found_list *list);
void found_iio(struct found_list *list);
void found_serial_lines(struct found_list *list);

// All of the above.
void found_all(struct found_list *list, int64_t deadline_ns);

// The next free entry of the list with kind, driver and place set and access
// as the node's permissions say; NULL when there is no room.
struct found *found_add(struct found_list *list, const char *kind, const char *driver,
                        const char *place);

// Access is refused, and the note names the udev rules.
void found_refuse(struct found *found);

// Why it could not be opened: refused when the error names the udev rules, in
// use when the system said no otherwise, else faulty; the note is its text.
void found_blame(struct found *found, const struct error *err);

// Copies at most size - 1 characters, '?' for anything but printable ASCII,
// without blanks at either end. text may be NULL.
void found_text(char *out, size_t size, const char *text);

#endif
