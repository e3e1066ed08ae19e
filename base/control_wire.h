// SPDX-License-Identifier: Apache-2.0
// What both sides of the control socket share: a buffer of bytes, addresses,
// limits. Private to control_client.c and control_server.c.
#ifndef BASE_CONTROL_WIRE_H
#define BASE_CONTROL_WIRE_H

#include <stdbool.h>
#include <stddef.h>
#include <sys/un.h>

#include "base/error.h"

enum {
    CONTROL_LINE_MOST = 1 << 20,  // bytes of a request
    CONTROL_REPLY_MOST = 1 << 26, // bytes of a reply
    CONTROL_CHUNK = 1 << 16,      // bytes read or kept at once
};

// Bytes waiting to be parsed or sent. Zeroed is empty; free(text) ends it.
struct control_bytes {
    char *text;
    size_t used, room;
};

// Makes room for more bytes behind those used. False when out of memory.
bool control_bytes_reserve(struct control_bytes *b, size_t more);

// Drops the first count (<= used) bytes; an emptied large buffer is freed.
void control_bytes_drop(struct control_bytes *b, size_t count);

// Error RANGE when the path is empty or too long for a socket.
bool control_address(const char *path, struct sockaddr_un *address, struct error *err);

#endif
