// SPDX-License-Identifier: Apache-2.0
#include "daemon/notify.h"

#include <stdio.h>
#include <string.h>
#include <systemd/sd-daemon.h>

#include "base/clock.h"

static const int64_t BLIND_MOST_NS = 5 * NS_PER_S;

void notify_init(struct notifier *n)
{
    uint64_t patience_us = 0;
    *n = (struct notifier){0};
    if (sd_watchdog_enabled(0, &patience_us) > 0)
        n->every_ns = (int64_t)patience_us * NS_PER_US / 2;
}

void notify_ready(void)
{
    sd_notify(0, "READY=1");
}

void notify_line(struct notifier *n, const char *line)
{
    if (!strcmp(n->line, line))
        return;
    snprintf(n->line, sizeof n->line, "%s", line);
    sd_notifyf(0, "STATUS=%s", n->line);
}

void notify_alive(struct notifier *n, int64_t now_ns, bool drawing)
{
    if (drawing || !n->drawn_ns)
        n->drawn_ns = now_ns;
    if (!n->every_ns || now_ns < n->next_ns || now_ns - n->drawn_ns > BLIND_MOST_NS)
        return;
    n->next_ns = now_ns + n->every_ns;
    sd_notify(0, "WATCHDOG=1");
}

void notify_stopping(void)
{
    sd_notify(0, "STOPPING=1");
}
