// SPDX-License-Identifier: Apache-2.0
// The control socket among friends and among those who mean it harm.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/control.h"

// Long enough that only a hang reaches it.
enum { PATIENCE_MS = 20000, MIB = 1 << 20 };

struct stage {
    struct control_server *server;
    char folder[64], path[96];
    pthread_t thread;
    int stop, handled; // atomic
};

static json_t *handle(void *context, const char *what, json_t *request, struct error *err)
{
    struct stage *s = context;
    __atomic_add_fetch(&s->handled, 1, __ATOMIC_SEQ_CST);
    if (!strcmp(what, "echo"))
        return json_pack("{s:O}", "value", json_object_get(request, "value"));
    if (!strcmp(what, "big")) {
        char *text = calloc(1, 4 * MIB + 1);
        memset(text, 'x', 4 * MIB);
        json_t *reply = json_pack("{s:s}", "text", text);
        free(text);
        return reply;
    }
    if (!strcmp(what, "silent"))
        return NULL;
    if (!strcmp(what, "list"))
        return json_array();
    if (!strcmp(what, "latin1")) {
        fail(err, ERROR_CONFIG, "caf\xe9.ini:3: bad");
        return NULL;
    }
    if (!strcmp(what, "gone")) {
        fail(err, ERROR_GONE, "spectrometer: unplugged");
        return NULL;
    }
    fail(err, ERROR_RANGE, "%s: no such request", what);
    return NULL;
}

static void *serve(void *context)
{
    struct stage *s = context;
    while (!__atomic_load_n(&s->stop, __ATOMIC_SEQ_CST))
        if (!control_serve(s->server, 5, handle, s, NULL))
            return s;
    return NULL;
}

static void find_place(struct stage *s)
{
    *s = (struct stage){.folder = "/tmp/control-XXXXXX"};
    assert_non_null(mkdtemp(s->folder));
    snprintf(s->path, sizeof s->path, "%s/s", s->folder);
}

static void listen_unserved(struct stage *s)
{
    find_place(s);
    s->server = control_listen(s->path, NULL);
    assert_non_null(s->server);
}

static int open_stage(void **state)
{
    struct stage *s = calloc(1, sizeof *s);
    listen_unserved(s);
    *state = s;
    return pthread_create(&s->thread, NULL, serve, s);
}

static int close_stage(void **state)
{
    struct stage *s = *state;
    void *failed;
    __atomic_store_n(&s->stop, 1, __ATOMIC_SEQ_CST);
    pthread_join(s->thread, &failed);
    control_unlisten(s->server);
    bool left = !access(s->path, F_OK);
    rmdir(s->folder);
    free(s);
    return failed || left ? -1 : 0;
}

static struct control_client *connect_client(struct stage *s)
{
    struct error err = {0};
    struct control_client *client = control_connect(s->path, &err);
    if (!client)
        print_error("%s\n", err.text);
    assert_non_null(client);
    return client;
}

static void assert_still_serving(struct stage *s)
{
    struct control_client *client = connect_client(s);
    struct error err = {0};
    json_t *reply =
        control_call(client, json_pack("{s:s, s:i}", "do", "echo", "value", 7), PATIENCE_MS, &err);
    if (!reply)
        print_error("%s\n", err.text);
    assert_non_null(reply);
    assert_int_equal(json_integer_value(json_object_get(reply, "value")), 7);
    json_decref(reply);
    control_close(client);
}

static int raw_connect(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    strcpy(address.sun_path, path);
    int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_int_equal(connect(fd, (struct sockaddr *)&address, sizeof address), 0);
    return fd;
}

// False when the server has closed the connection.
static bool raw_send(int fd, const void *bytes, size_t size)
{
    for (size_t sent = 0; sent < size;) {
        ssize_t n = send(fd, (const char *)bytes + sent, size - sent, MSG_NOSIGNAL);
        if (n < 0)
            return false;
        sent += n;
    }
    return true;
}

// Bytes up to and without the line end; -1 when the connection ends first.
static ssize_t raw_line(int fd, char *line, size_t room)
{
    for (size_t used = 0; used < room;) {
        struct pollfd p = {fd, POLLIN, 0};
        assert_int_equal(poll(&p, 1, PATIENCE_MS), 1);
        if (recv(fd, line + used, 1, 0) != 1)
            return -1;
        if (line[used] == '\n') {
            line[used] = 0;
            return used;
        }
        used++;
    }
    return -1;
}

static void assert_refused(const char *line, const char *code)
{
    json_t *reply = json_loads(line, 0, NULL);
    assert_non_null(reply);
    assert_true(json_is_false(json_object_get(reply, "ok")));
    assert_string_equal(json_string_value(json_object_get(reply, "code")), code);
    assert_non_null(json_string_value(json_object_get(reply, "error")));
    json_decref(reply);
}

static void a_request_gets_its_reply(void **state)
{
    assert_still_serving(*state);
}

static void a_number_comes_back_to_the_last_bit(void **state)
{
    struct control_client *client = connect_client(*state);
    const double value = 0.1 + 1e-17 + 1.0 / 3;
    json_t *reply = control_call(client, json_pack("{s:s, s:f}", "do", "echo", "value", value),
                                 PATIENCE_MS, NULL);
    assert_true(json_real_value(json_object_get(reply, "value")) == value);
    json_decref(reply);
    control_close(client);
}

static void assert_call_fails(struct stage *s, const char *what, enum error_code code,
                              const char *text)
{
    struct control_client *client = connect_client(s);
    struct error err = {0};
    assert_null(control_call(client, json_pack("{s:s}", "do", what), PATIENCE_MS, &err));
    assert_int_equal(err.code, code);
    assert_string_equal(err.text, text);
    control_close(client);
}

static void a_failure_keeps_its_code_and_text(void **state)
{
    assert_call_fails(*state, "gone", ERROR_GONE, "spectrometer: unplugged");
    assert_call_fails(*state, "dance", ERROR_RANGE, "dance: no such request");
}

static void a_handler_that_says_nothing_or_no_object_is_a_failure(void **state)
{
    assert_call_fails(*state, "silent", ERROR_SYSTEM, "no answer");
    assert_call_fails(*state, "list", ERROR_SYSTEM, "no answer");
}

static void an_error_text_that_is_no_utf8_still_arrives(void **state)
{
    assert_call_fails(*state, "latin1", ERROR_CONFIG, "caf?.ini:3: bad");
}

static void every_bad_line_is_answered_with_code_data(void **state)
{
    struct stage *s = *state;
    static const char *const BAD[] = {"",
                                      "{",
                                      "{}",
                                      "[]",
                                      "null",
                                      "\"status\"",
                                      "{\"do\": 3}",
                                      "{\"do\": null}",
                                      "{\"do\":\"echo\",\"do\":\"quit\"}",
                                      "{\"do\":\"echo\"} trailing",
                                      "\xff\xfe{}",
                                      "{\"do\":\"\xc3\x28\"}",
                                      "GET / HTTP/1.1\r",
                                      "{\"do\": NaN}",
                                      "{\"do\":\"a\x01\"}"};
    int fd = raw_connect(s->path);
    for (size_t i = 0; i < sizeof BAD / sizeof *BAD; i++) {
        char line[4096];
        assert_true(raw_send(fd, BAD[i], strlen(BAD[i])) && raw_send(fd, "\n", 1));
        assert_true(raw_line(fd, line, sizeof line) > 0);
        assert_refused(line, "data");
    }
    assert_int_equal(__atomic_load_n(&s->handled, __ATOMIC_SEQ_CST), 0);
    close(fd);
}

static void a_nul_byte_in_a_line_is_refused(void **state)
{
    struct stage *s = *state;
    char line[4096];
    int fd = raw_connect(s->path);
    assert_true(raw_send(fd, "{\"do\":\"echo\0\"}\n", 15));
    assert_true(raw_line(fd, line, sizeof line) > 0);
    assert_refused(line, "data");
    close(fd);
}

static void deep_nesting_is_refused_and_harms_nobody(void **state)
{
    struct stage *s = *state;
    char *deep = malloc(MIB / 2), line[4096];
    memset(deep, '[', MIB / 2);
    deep[MIB / 2 - 1] = '\n';
    int fd = raw_connect(s->path);
    assert_true(raw_send(fd, deep, MIB / 2));
    assert_true(raw_line(fd, line, sizeof line) > 0);
    assert_refused(line, "data");
    close(fd);
    free(deep);
    assert_still_serving(s);
}

static void one_byte_at_a_time_is_a_request_too(void **state)
{
    struct stage *s = *state;
    const char *request = "{\"do\":\"echo\",\"value\":[1,2]}\r\n";
    char line[256];
    int fd = raw_connect(s->path);
    for (const char *at = request; *at; at++)
        assert_true(raw_send(fd, at, 1));
    assert_true(raw_line(fd, line, sizeof line) > 0);
    assert_string_equal(line, "{\"value\":[1,2],\"ok\":true}");
    close(fd);
}

static void many_lines_in_one_write_are_answered_in_order(void **state)
{
    struct stage *s = *state;
    char text[64 * 40] = "", line[256];
    for (int i = 0; i < 40; i++)
        sprintf(text + strlen(text), "{\"do\":\"echo\",\"value\":%d}\n", i);
    int fd = raw_connect(s->path);
    assert_true(raw_send(fd, text, strlen(text)));
    for (int i = 0; i < 40; i++) {
        char expected[64];
        sprintf(expected, "{\"value\":%d,\"ok\":true}", i);
        assert_true(raw_line(fd, line, sizeof line) > 0);
        assert_string_equal(line, expected);
    }
    close(fd);
}

static void a_client_that_shuts_its_side_still_gets_its_answers(void **state)
{
    struct stage *s = *state;
    const char *text = "{\"do\":\"echo\",\"value\":1}\n{\"do\":\"echo\",\"value\":2}\n{\"do\":";
    char line[256];
    int fd = raw_connect(s->path);
    assert_true(raw_send(fd, text, strlen(text)));
    shutdown(fd, SHUT_WR);
    assert_true(raw_line(fd, line, sizeof line) > 0);
    assert_true(raw_line(fd, line, sizeof line) > 0);
    assert_string_equal(line, "{\"value\":2,\"ok\":true}");
    assert_int_equal(raw_line(fd, line, sizeof line), -1);
    close(fd);
}

static void a_line_of_one_mebibyte_passes_and_a_longer_one_ends_the_connection(void **state)
{
    struct stage *s = *state;
    struct control_client *client = connect_client(s);
    char *text = calloc(1, 2 * MIB);
    memset(text, 'y', MIB - 100);
    json_t *reply = control_call(client, json_pack("{s:s, s:s}", "do", "echo", "value", text),
                                 PATIENCE_MS, NULL);
    assert_int_equal(json_string_length(json_object_get(reply, "value")), MIB - 100);
    json_decref(reply);
    control_close(client);
    memset(text, 'y', 2 * MIB);
    int fd = raw_connect(s->path);
    char byte;
    bool closed = !raw_send(fd, text, 2 * MIB) || recv(fd, &byte, 1, 0) <= 0;
    assert_true(closed);
    close(fd);
    free(text);
    assert_still_serving(s);
}

static void a_reply_larger_than_the_socket_buffer_arrives_whole(void **state)
{
    struct control_client *client = connect_client(*state);
    for (int i = 0; i < 2; i++) {
        json_t *reply = control_call(client, json_pack("{s:s}", "do", "big"), PATIENCE_MS, NULL);
        assert_int_equal(json_string_length(json_object_get(reply, "text")), 4 * MIB);
        json_decref(reply);
    }
    control_close(client);
}

static void one_who_never_reads_costs_at_most_one_reply(void **state)
{
    struct stage *s = *state;
    const char *request = "{\"do\":\"big\"}\n";
    int fd = raw_connect(s->path);
    for (int i = 0; i < 50; i++)
        assert_true(raw_send(fd, request, strlen(request)));
    for (int i = 0; i < 5; i++)
        assert_still_serving(s);
    // 5 calls above, and the one big reply that waits.
    assert_int_equal(__atomic_load_n(&s->handled, __ATOMIC_SEQ_CST), 6);
    close(fd);
    assert_still_serving(s);
}

static void clients_that_vanish_at_any_moment_harm_nobody(void **state)
{
    struct stage *s = *state;
    const char *request = "{\"do\":\"big\"}\n{\"do\":\"echo\",\"value\":1}\n{\"do\"";
    for (size_t cut = 0; cut <= strlen(request); cut++) {
        int fd = raw_connect(s->path);
        raw_send(fd, request, cut);
        if (cut % 2)
            setsockopt(fd, SOL_SOCKET, SO_LINGER, &(struct linger){1, 0}, sizeof(struct linger));
        close(fd);
    }
    assert_still_serving(s);
}

static void random_bytes_harm_nobody(void **state)
{
    struct stage *s = *state;
    uint32_t random = 12345;
    for (int round = 0; round < 20; round++) {
        uint8_t noise[5000];
        for (size_t i = 0; i < sizeof noise; i++)
            noise[i] = (random = random * 1664525 + 1013904223) >> 24;
        int fd = raw_connect(s->path);
        raw_send(fd, noise, sizeof noise);
        close(fd);
    }
    assert_still_serving(s);
}

static void the_seventeenth_client_is_told_to_try_later(void **state)
{
    struct stage *s = *state;
    struct control_client *clients[16];
    struct error err = {0};
    for (int i = 0; i < 16; i++) {
        clients[i] = connect_client(s);
        json_t *reply = control_call(clients[i], json_pack("{s:s, s:i}", "do", "echo", "value", i),
                                     PATIENCE_MS, NULL);
        assert_non_null(reply);
        json_decref(reply);
    }
    struct control_client *extra = connect_client(s);
    assert_null(control_call(extra, json_pack("{s:s}", "do", "big"), PATIENCE_MS, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    control_close(extra);
    for (int i = 0; i < 16; i++)
        control_close(clients[i]);
    // Its place is free as soon as the server has noticed.
    for (bool served = false; !served;) {
        struct control_client *client = connect_client(s);
        json_t *reply = control_call(client, json_pack("{s:s, s:i}", "do", "echo", "value", 1),
                                     PATIENCE_MS, &err);
        served = reply;
        assert_true(served || err.code == ERROR_RETRY);
        json_decref(reply);
        control_close(client);
    }
}

static void a_call_that_cannot_become_json_is_refused_before_it_is_sent(void **state)
{
    struct control_client *client = connect_client(*state);
    struct error err = {0};
    assert_null(control_call(client, NULL, PATIENCE_MS, &err));
    assert_int_equal(err.code, ERROR_RANGE);
    control_close(client);
}

static void a_socket_that_is_served_and_a_plain_file_are_left_alone(void **state)
{
    struct stage *s = *state;
    struct error err = {0};
    assert_null(control_listen(s->path, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_still_serving(s);
    char file[128];
    snprintf(file, sizeof file, "%s/file", s->folder);
    fclose(fopen(file, "w"));
    assert_null(control_listen(file, &err));
    assert_int_equal(err.code, ERROR_CONFIG);
    assert_int_equal(unlink(file), 0);
}

// A server that nobody runs: replies come only when the test serves.
static void the_reply_to_a_call_that_timed_out_is_not_taken_for_the_next(void **state)
{
    (void)state;
    struct stage s;
    listen_unserved(&s);
    struct control_client *client = control_connect(s.path, NULL);
    struct error err = {0};
    assert_null(control_call(client, json_pack("{s:s, s:i}", "do", "echo", "value", 1), 1, &err));
    assert_int_equal(err.code, ERROR_RETRY);
    pthread_create(&s.thread, NULL, serve, &s);
    json_t *reply =
        control_call(client, json_pack("{s:s, s:i}", "do", "echo", "value", 2), PATIENCE_MS, &err);
    assert_int_equal(json_integer_value(json_object_get(reply, "value")), 2);
    json_decref(reply);
    __atomic_store_n(&s.stop, 1, __ATOMIC_SEQ_CST);
    pthread_join(s.thread, NULL);
    control_unlisten(s.server);
    assert_null(control_call(client, json_pack("{s:s}", "do", "echo"), PATIENCE_MS, &err));
    assert_int_equal(err.code, ERROR_GONE);
    assert_null(control_call(client, json_pack("{s:s}", "do", "echo"), PATIENCE_MS, &err));
    assert_int_equal(err.code, ERROR_GONE);
    control_close(client);
    rmdir(s.folder);
}

static void nobody_is_turned_away_for_clients_that_have_gone(void **state)
{
    (void)state;
    char line[256] = "";
    struct stage s;
    listen_unserved(&s);
    // All of them wait in the queue before the server first looks.
    for (int i = 0; i < 16; i++) {
        int gone = raw_connect(s.path);
        assert_true(raw_send(gone, "{\"do\"", 5));
        close(gone);
    }
    int fd = raw_connect(s.path);
    assert_true(raw_send(fd, "{\"do\":\"echo\",\"value\":1}\n", 24));
    for (int i = 0; i < 4; i++)
        assert_true(control_serve(s.server, 0, handle, &s, NULL));
    assert_true(raw_line(fd, line, sizeof line) > 0);
    assert_string_equal(line, "{\"value\":1,\"ok\":true}");
    close(fd);
    control_unlisten(s.server);
    rmdir(s.folder);
}

static void who_has_been_idle_too_long_makes_room_for_who_asks(void **state)
{
    (void)state;
    char line[256] = "";
    struct stage s;
    int idle[16], fd;
    listen_unserved(&s);
    for (int i = 0; i < 16; i++) {
        idle[i] = raw_connect(s.path);
        assert_true(control_serve(s.server, 0, handle, &s, NULL));
    }
    assert_true(raw_send(idle[0], "{\"do\":\"echo\",\"value\":0}\n", 24)); // no longer the idlest
    control_idle_after(s.server, 0);
    fd = raw_connect(s.path);
    assert_true(raw_send(fd, "{\"do\":\"echo\",\"value\":1}\n", 24));
    for (int i = 0; i < 4; i++)
        assert_true(control_serve(s.server, 0, handle, &s, NULL));
    assert_true(raw_line(fd, line, sizeof line) > 0);
    assert_string_equal(line, "{\"value\":1,\"ok\":true}");
    assert_true(raw_line(idle[0], line, sizeof line) > 0);
    assert_string_equal(line, "{\"value\":0,\"ok\":true}");
    char byte;
    assert_int_equal(recv(idle[1], &byte, 1, MSG_DONTWAIT), 0);  // hung up
    assert_int_equal(recv(idle[2], &byte, 1, MSG_DONTWAIT), -1); // still there
    for (int i = 0; i < 16; i++)
        close(idle[i]);
    close(fd);
    control_unlisten(s.server);
    rmdir(s.folder);
}

int main(void)
{
#define staged(test) cmocka_unit_test_setup_teardown(test, open_stage, close_stage)
    const struct CMUnitTest tests[] = {
        staged(a_request_gets_its_reply),
        staged(a_number_comes_back_to_the_last_bit),
        staged(a_failure_keeps_its_code_and_text),
        staged(a_handler_that_says_nothing_or_no_object_is_a_failure),
        staged(an_error_text_that_is_no_utf8_still_arrives),
        staged(every_bad_line_is_answered_with_code_data),
        staged(a_nul_byte_in_a_line_is_refused),
        staged(deep_nesting_is_refused_and_harms_nobody),
        staged(one_byte_at_a_time_is_a_request_too),
        staged(many_lines_in_one_write_are_answered_in_order),
        staged(a_client_that_shuts_its_side_still_gets_its_answers),
        staged(a_line_of_one_mebibyte_passes_and_a_longer_one_ends_the_connection),
        staged(a_reply_larger_than_the_socket_buffer_arrives_whole),
        staged(one_who_never_reads_costs_at_most_one_reply),
        staged(clients_that_vanish_at_any_moment_harm_nobody),
        staged(random_bytes_harm_nobody),
        staged(the_seventeenth_client_is_told_to_try_later),
        staged(a_call_that_cannot_become_json_is_refused_before_it_is_sent),
        staged(a_socket_that_is_served_and_a_plain_file_are_left_alone),
        cmocka_unit_test(the_reply_to_a_call_that_timed_out_is_not_taken_for_the_next),
        cmocka_unit_test(nobody_is_turned_away_for_clients_that_have_gone),
        cmocka_unit_test(who_has_been_idle_too_long_makes_room_for_who_asks),
    };
    return cmocka_run_group_tests_name("control", tests, NULL, NULL);
}
