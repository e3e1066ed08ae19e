// SPDX-License-Identifier: Apache-2.0
// A device node of the testbed that can be polled: the path under /dev leads
// to a pseudo terminal whose own readiness stands for that of the device, as
// umockdev's nodes are always ready. Closing it hangs up on whoever has it open.
#ifndef SIMULATOR_WIRE_NODE_H
#define SIMULATOR_WIRE_NODE_H

#include <stdbool.h>
#include <umockdev.h>

#include "base/error.h"

struct node {
    int master, slave;
    int major_number, minor_number; // of the slave
    bool forbidden;
    char path[512]; // of the link to it
    char slave_path[64];
};

// Opens the pseudo terminal, raw and not inherited by child processes.
bool node_open(struct node *node, struct error *err);

// Puts a link to it at path, in place of what is there.
bool node_link(struct node *node, const char *path, struct error *err);

// The same at devnode ("/dev/hidraw0") of the testbed.
bool node_link_device(struct node *node, UMockdevTestbed *testbed, const char *devnode,
                      struct error *err);

// Whether opening the node fails with EACCES, for root as for anybody, from now
// on or once it is linked. Leaves those alone that have it open.
void node_forbid(struct node *node, bool forbidden);

// Whether the host may write (usbfs: whether something can be reaped).
void node_set_writable(struct node *node, bool writable);

// Whether the host may read. Call on changes only.
void node_set_readable(struct node *node, bool readable);

// Forgets the number of a device that was removed from the testbed, which
// umockdev 0.17 does not: the next device with that number would abort.
void node_forget_number(UMockdevTestbed *testbed, int major_number, int minor_number);

// Removes the link and hangs up. Accepts a node closed before (master < 0).
void node_close(struct node *node);

#endif
