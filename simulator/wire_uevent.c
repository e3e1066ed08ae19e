// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_uevent.h"

#include <arpa/inet.h>
#include <glob.h>
#include <inttypes.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"

enum { MAGIC = 0xFEEDCAFE, READ_WITHIN_US = 200000 };

struct header {
    char prefix[8];
    uint32_t magic, header_size, properties_at, properties_size;
    uint32_t subsystem_hash, devtype_hash, tags[2]; // the numbers that filters look at: big-endian
};

void umockdev_testbed_uevent(UMockdevTestbed *self, const gchar *devpath, const gchar *action)
{
    (void)self, (void)devpath, (void)action;
}

static uint32_t murmur2(const char *text)
{
    const uint32_t m = 0x5BD1E995;
    size_t left = strlen(text);
    uint32_t hash = (uint32_t)left;
    for (; left >= 4; left -= 4, text += 4) {
        uint32_t word;
        memcpy(&word, text, 4);
        word *= m;
        hash = hash * m ^ (word ^ word >> 24) * m;
    }
    if (left > 0) {
        uint32_t word = 0;
        memcpy(&word, text, left);
        hash = (hash ^ word) * m;
    }
    hash = (hash ^ hash >> 13) * m;
    return hash ^ hash >> 15;
}

static void put(GString *properties, const char *name, const char *value)
{
    g_string_append_printf(properties, "%s=%s", name, value);
    g_string_append_c(properties, 0);
}

static void put_number(GString *properties, const char *name, int64_t value)
{
    char text[24];
    snprintf(text, sizeof(text), "%" PRId64, value);
    put(properties, name, text);
}

static GString *properties_of(const struct uevent *u, const char *action)
{
    GString *p = g_string_new(NULL);
    put(p, "ACTION", action);
    put(p, "DEVPATH", u->sysfs + strlen("/sys"));
    put(p, "SUBSYSTEM", u->subsystem);
    put_number(p, "SEQNUM", clock_now_ns()); // only has to grow
    if (u->devtype)
        put(p, "DEVTYPE", u->devtype);
    if (u->devnode) {
        put(p, "DEVNAME", u->devnode);
        put_number(p, "MAJOR", u->major_number);
        put_number(p, "MINOR", u->minor_number);
    }
    return p;
}

static void send_to(int fd, const char *path, struct iovec parts[2])
{
    struct sockaddr_un at = {.sun_family = AF_UNIX};
    struct msghdr message = {
        .msg_name = &at, .msg_namelen = sizeof(at), .msg_iov = parts, .msg_iovlen = 2};
    if (strlen(path) >= sizeof(at.sun_path))
        return;
    memcpy(at.sun_path, path, strlen(path));
    sendmsg(fd, &message, MSG_NOSIGNAL);
}

static void send_to_all(UMockdevTestbed *testbed, struct iovec parts[2])
{
    char pattern[256];
    glob_t sockets;
    const struct timeval patience = {0, READ_WITHIN_US};
    int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    char *root = umockdev_testbed_get_root_dir(testbed);
    snprintf(pattern, sizeof(pattern), "%s/event[0-9]*", root);
    g_free(root);
    setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
    if (glob(pattern, GLOB_NOSORT, NULL, &sockets) == 0)
        for (size_t i = 0; i < sockets.gl_pathc; i++)
            send_to(fd, sockets.gl_pathv[i], parts);
    globfree(&sockets);
    close(fd);
}

void uevent_tell(UMockdevTestbed *testbed, const struct uevent *uevent, const char *action)
{
    GString *properties = properties_of(uevent, action);
    struct header header = {
        .prefix = "libudev",
        .magic = htonl(MAGIC),
        .header_size = sizeof(header),
        .properties_at = sizeof(header),
        .properties_size = (uint32_t)properties->len,
        .subsystem_hash = htonl(murmur2(uevent->subsystem)),
        .devtype_hash = uevent->devtype ? htonl(murmur2(uevent->devtype)) : 0,
    };
    struct iovec parts[2] = {{&header, sizeof(header)}, {properties->str, properties->len}};
    send_to_all(testbed, parts);
    g_string_free(properties, TRUE);
}
