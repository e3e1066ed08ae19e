// SPDX-License-Identifier: Apache-2.0
#include "base/control_wire.h"

#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

bool control_bytes_reserve(struct control_bytes *b, size_t more)
{
    if (b->used + more <= b->room)
        return true;
    size_t room = 2 * b->room > b->used + more ? 2 * b->room : b->used + more;
    char *text = realloc(b->text, room);
    if (!text)
        return false;
    b->text = text;
    b->room = room;
    return true;
}

void control_bytes_drop(struct control_bytes *b, size_t count)
{
    memmove(b->text, b->text + count, b->used - count);
    b->used -= count;
    if (b->used || b->room <= CONTROL_CHUNK)
        return;
    free(b->text);
    *b = (struct control_bytes){0};
}

bool control_address(const char *path, struct sockaddr_un *address, struct error *err)
{
    *address = (struct sockaddr_un){.sun_family = AF_UNIX};
    if (!*path || strlen(path) >= sizeof address->sun_path)
        return fail(err, ERROR_RANGE, "%s: a socket path must have 1..%zu bytes", path,
                    sizeof address->sun_path - 1);
    strcpy(address->sun_path, path);
    return true;
}
