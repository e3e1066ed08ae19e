// SPDX-License-Identifier: Apache-2.0
// Tells the programs in a testbed that a device came or went, as udevd does over
// netlink. umockdev 0.17 stands for netlink with a datagram socket per listener, named
// "event" and a number in the testbed's root. Its own sender aborts the process
// when a listener closes its socket meanwhile or leaves ten messages unread; so
// this file takes that sender's place, umockdev_testbed_uevent included, which
// says nothing here: it would tell of a device before its node is there.
#ifndef SIMULATOR_WIRE_UEVENT_H
#define SIMULATOR_WIRE_UEVENT_H

#include <umockdev.h>

struct uevent {
    const char *sysfs; // "/sys/devices/..."
    const char *subsystem;
    const char *devtype, *devnode;  // NULL = none
    int major_number, minor_number; // of devnode
};

// Sends "add" or "remove" to whoever listens; who ceases to, or does not read
// for 0.2 s, is passed over. Message: libudev's monitor (systemd, sd-device),
// filtered by MurmurHash2 (Appleby, 2008) of subsystem and devtype. Any thread.
void uevent_tell(UMockdevTestbed *testbed, const struct uevent *uevent, const char *action);

#endif
