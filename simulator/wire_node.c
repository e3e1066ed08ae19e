// SPDX-License-Identifier: Apache-2.0
#include "simulator/wire_node.h"

#include <fcntl.h>
#include <pty.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

bool node_open(struct node *node, struct error *err)
{
    *node = (struct node){.master = -1, .slave = -1, .forbidden = node->forbidden};
    if (openpty(&node->master, &node->slave, node->slave_path, NULL, NULL) != 0)
        return fail_errno(err, "opening a pseudo terminal");
    fcntl(node->master, F_SETFD, FD_CLOEXEC);
    fcntl(node->slave, F_SETFD, FD_CLOEXEC);
    struct termios raw;
    tcgetattr(node->slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(node->slave, TCSANOW, &raw);
    struct stat about;
    fstat(node->slave, &about);
    node->major_number = (int)major(about.st_rdev);
    node->minor_number = (int)minor(about.st_rdev);
    return true;
}

// The kernel lets nobody write here, root included.
static const char unwritable[] = "/proc/sys/kernel/osrelease";

static bool point_to(const char *path, const char *target)
{
    char fresh[520];
    snprintf(fresh, sizeof(fresh), "%s.new", path);
    unlink(fresh);
    return symlink(target, fresh) == 0 && rename(fresh, path) == 0;
}

static bool link_again(struct node *node)
{
    return point_to(node->path, node->forbidden ? unwritable : node->slave_path);
}

bool node_link(struct node *node, const char *path, struct error *err)
{
    snprintf(node->path, sizeof(node->path), "%s", path);
    return link_again(node) || fail_errno(err, "linking %s", node->path);
}

bool node_link_device(struct node *node, UMockdevTestbed *testbed, const char *devnode,
                      struct error *err)
{
    char path[sizeof(node->path)];
    char *root = umockdev_testbed_get_root_dir(testbed);
    snprintf(path, sizeof(path), "%s%s", root, devnode);
    g_free(root);
    return node_link(node, path, err);
}

void node_forbid(struct node *node, bool forbidden)
{
    node->forbidden = forbidden;
    if (node->path[0])
        link_again(node);
}

void node_forget_number(UMockdevTestbed *testbed, int major_number, int minor_number)
{
    char link[256];
    char *root = umockdev_testbed_get_root_dir(testbed);
    snprintf(link, sizeof(link), "%s/sys/dev/char/%d:%d", root, major_number, minor_number);
    g_free(root);
    unlink(link);
}

void node_set_writable(struct node *node, bool writable)
{
    tcflow(node->slave, writable ? TCOON : TCOOFF);
}

void node_set_readable(struct node *node, bool readable)
{
    if (!readable)
        tcflush(node->slave, TCIFLUSH);
    else if (write(node->master, "", 1) != 1)
        return; // a full terminal is readable already
}

void node_close(struct node *node)
{
    if (node->master < 0)
        return;
    if (node->path[0])
        unlink(node->path);
    close(node->slave);
    close(node->master);
    node->master = node->slave = -1;
    node->path[0] = 0;
}
