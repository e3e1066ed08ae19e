// SPDX-License-Identifier: Apache-2.0
#include <stdlib.h>

#include "base/control.h"
#include "base/log.h"
#include "config/booth.h"
#include "daemon/ctl.h"

enum { EXIT_FINE = 0, EXIT_FAILED = 1, EXIT_WARNED = 3 };

static int give_up(const struct error *err)
{
    log_line(LOG_LEVEL_ERROR, "%s", err->text);
    return error_exit_code(err);
}

static int finish(int code)
{
    if (!fflush(stdout) && !ferror(stdout))
        return code;
    log_line(LOG_LEVEL_ERROR, "standard output cannot be written");
    return EXIT_FAILED;
}

static json_t *ask(struct ctl *c, struct error *err)
{
    struct control_client *client = NULL;
    json_t *reply = NULL;
    if (*c->socket ||
        booth_socket_default(getenv("XDG_RUNTIME_DIR"), c->socket, sizeof c->socket, err))
        client = control_connect(c->socket, err);
    if (client)
        reply = control_call(client, c->request, ctl_timeout_ms(c), err);
    else
        json_decref(c->request);
    control_close(client);
    return reply;
}

int main(int argc, char **argv)
{
    struct ctl c;
    struct error err = {0};
    log_init("boothctl", LOG_LEVEL_INFO);
    if (!ctl_parse(argc, argv, &c, &err))
        return give_up(&err);
    if (c.help || c.version) {
        printf("%s", c.help ? ctl_help : "boothctl " BOOTHD_VERSION "\n");
        return finish(EXIT_FINE);
    }
    json_t *reply = ask(&c, &err);
    if (!reply)
        return give_up(&err);
    bool warned = ctl_warned(reply);
    if (c.json)
        json_dumpf(reply, stdout, JSON_INDENT(2));
    else
        ctl_print(c.what, reply, stdout);
    fputs(c.json ? "\n" : "", stdout);
    json_decref(reply);
    return finish(warned ? EXIT_WARNED : EXIT_FINE);
}
