// SPDX-License-Identifier: Apache-2.0
// The two ends of the control socket: where a server may listen, and what a
// client makes of a place where nobody sound listens.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/control.h"

// Long enough that only a hang reaches it.
enum { PATIENCE_MS = 20000 };

static void a_socket_file_that_nobody_serves_is_replaced(void **state)
{
    (void)state;
    char folder[] = "/tmp/control-XXXXXX", path[64];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/s", folder);
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    strcpy(address.sun_path, path);
    int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_int_equal(bind(fd, (struct sockaddr *)&address, sizeof address), 0);
    close(fd);
    assert_int_equal(access(path, F_OK), 0);
    struct control_server *server = control_listen(path, NULL);
    assert_non_null(server);
    struct stat there;
    assert_int_equal(stat(path, &there), 0);
    assert_int_equal(there.st_mode & 0777, 0600);
    control_unlisten(server);
    assert_int_equal(access(path, F_OK), -1);
    rmdir(folder);
}

struct racer {
    char path[64];
    pthread_barrier_t *start;
    struct control_server *server;
};

static void *race(void *argument)
{
    struct racer *r = argument;
    pthread_barrier_wait(r->start);
    r->server = control_listen(r->path, NULL);
    return NULL;
}

// Each may see the stale socket; only one may put its own there.
static void of_servers_that_start_at_once_one_at_most_listens(void **state)
{
    (void)state;
    enum { RACERS = 4, RACES = 50 };
    char folder[] = "/tmp/control-XXXXXX";
    pthread_barrier_t start;
    assert_non_null(mkdtemp(folder));
    pthread_barrier_init(&start, NULL, RACERS);
    for (int n = 0; n < RACES; n++) {
        struct racer racers[RACERS];
        pthread_t threads[RACERS];
        struct sockaddr_un address = {.sun_family = AF_UNIX};
        snprintf(address.sun_path, sizeof address.sun_path, "%s/s", folder);
        int fd = socket(AF_UNIX, SOCK_STREAM, 0), listening = 0;
        assert_int_equal(bind(fd, (struct sockaddr *)&address, sizeof address), 0);
        close(fd);
        for (int i = 0; i < RACERS; i++) {
            racers[i] = (struct racer){.start = &start};
            strcpy(racers[i].path, address.sun_path);
            assert_int_equal(pthread_create(&threads[i], NULL, race, &racers[i]), 0);
        }
        for (int i = 0; i < RACERS; i++) {
            pthread_join(threads[i], NULL);
            listening += racers[i].server != NULL;
        }
        assert_int_equal(listening, 1);
        for (int i = 0; i < RACERS; i++)
            control_unlisten(racers[i].server);
    }
    pthread_barrier_destroy(&start);
    assert_int_equal(rmdir(folder), 0); // neither socket nor lock is left
}

static void a_server_does_not_remove_the_socket_of_its_successor(void **state)
{
    (void)state;
    char folder[] = "/tmp/control-XXXXXX", path[64];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/s", folder);
    struct control_server *first = control_listen(path, NULL);
    assert_int_equal(unlink(path), 0);
    struct control_server *second = control_listen(path, NULL);
    assert_non_null(second);
    control_unlisten(first);
    assert_int_equal(access(path, F_OK), 0);
    control_unlisten(second);
    rmdir(folder);
}

static void calling_where_nobody_listens_is_gone(void **state)
{
    (void)state;
    struct error err = {0};
    assert_null(control_connect("/tmp/no-such-folder/no-such-socket", &err));
    assert_int_equal(err.code, ERROR_GONE);
    char longer[200];
    memset(longer, 'a', sizeof longer);
    longer[199] = 0;
    assert_null(control_connect(longer, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    assert_null(control_listen(longer, &err));
    assert_int_equal(err.code, ERROR_RANGE);
}

static void answers_that_are_no_replies_are_data_errors(void **state)
{
    (void)state;
    static const char *const BAD[] = {"hello\n",          "[]\n",  "{}\n", "{\"ok\":1}\n",
                                      "{\"ok\":false}\n", "\xff\n"};
    char folder[] = "/tmp/control-XXXXXX";
    assert_non_null(mkdtemp(folder));
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    snprintf(address.sun_path, sizeof address.sun_path, "%s/s", folder);
    int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_int_equal(bind(fd, (struct sockaddr *)&address, sizeof address), 0);
    assert_int_equal(listen(fd, 5), 0);
    struct control_client *client = control_connect(address.sun_path, NULL);
    int peer = accept(fd, NULL, NULL);
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        struct error err = {0};
        assert_int_equal(write(peer, BAD[i], strlen(BAD[i])), strlen(BAD[i]));
        assert_null(control_call(client, json_pack("{s:s}", "do", "status"), PATIENCE_MS, &err));
        assert_int_equal(err.code, ERROR_DATA);
    }
    close(peer);
    close(fd);
    control_close(client);
    control_close(NULL);
    control_unlisten(NULL);
    unlink(address.sun_path);
    rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_socket_file_that_nobody_serves_is_replaced),
        cmocka_unit_test(of_servers_that_start_at_once_one_at_most_listens),
        cmocka_unit_test(a_server_does_not_remove_the_socket_of_its_successor),
        cmocka_unit_test(calling_where_nobody_listens_is_gone),
        cmocka_unit_test(answers_that_are_no_replies_are_data_errors),
    };
    return cmocka_run_group_tests_name("control ends", tests, NULL, NULL);
}
