// SPDX-License-Identifier: Apache-2.0
// A server that answers later: other clients are served meanwhile.
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#undef fail // ours is a function

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/control.h"

enum { PATIENCE_MS = 20000 };

struct stage {
    struct control_server *server;
    char folder[64], path[96];
    uint64_t ticket;
    int handled;
};

static json_t *handle(void *context, const char *what, json_t *request, struct error *err)
{
    struct stage *s = context;
    s->handled++;
    if (!strcmp(what, "slow")) {
        s->ticket = control_later(s->server);
        return NULL;
    }
    if (!strcmp(what, "finish")) {
        struct error no = {0};
        if (json_object_get(request, "fail"))
            fail(&no, ERROR_RETRY, "not today");
        control_answer(s->server, s->ticket, no.code ? NULL : json_pack("{s:s}", "said", "late"),
                       &no);
        return json_object();
    }
    if (!strcmp(what, "quick"))
        return json_pack("{s:s}", "said", "quick");
    fail(err, ERROR_RANGE, "no such request");
    return NULL;
}

struct call {
    const char *path;
    json_t *reply;
    struct error err;
};

static void *call_slow(void *argument)
{
    struct call *call = argument;
    struct control_client *client = control_connect(call->path, &call->err);
    call->reply = control_call(client, json_pack("{s:s}", "do", "slow"), PATIENCE_MS, &call->err);
    control_close(client);
    return NULL;
}

struct quick_calls {
    const char *path;
    bool fail;
    json_t *quick, *finish;
    int done; // atomic
};

static void *call_quick(void *argument)
{
    struct quick_calls *q = argument;
    struct control_client *client = control_connect(q->path, NULL);
    q->quick = control_call(client, json_pack("{s:s}", "do", "quick"), PATIENCE_MS, NULL);
    json_t *finish = json_pack("{s:s}", "do", "finish");
    if (q->fail)
        json_object_set_new(finish, "fail", json_true());
    q->finish = control_call(client, finish, PATIENCE_MS, NULL);
    control_close(client);
    __atomic_store_n(&q->done, 1, __ATOMIC_SEQ_CST);
    return NULL;
}

static void open_stage(struct stage *s)
{
    struct error err = {0};
    *s = (struct stage){.folder = "/tmp/control-later-XXXXXX"};
    assert_non_null(mkdtemp(s->folder));
    snprintf(s->path, sizeof s->path, "%s/s", s->folder);
    s->server = control_listen(s->path, &err);
    assert_non_null(s->server);
}

static void close_stage(struct stage *s)
{
    control_unlisten(s->server);
    rmdir(s->folder);
}

static void play(struct stage *s, struct call *slow, struct quick_calls *quick)
{
    pthread_t slow_thread, quick_thread;
    assert_int_equal(pthread_create(&slow_thread, NULL, call_slow, slow), 0);
    while (!s->ticket)
        assert_true(control_serve(s->server, 20, handle, s, NULL));
    assert_int_equal(pthread_create(&quick_thread, NULL, call_quick, quick), 0);
    while (!__atomic_load_n(&quick->done, __ATOMIC_SEQ_CST))
        assert_true(control_serve(s->server, 20, handle, s, NULL));
    pthread_join(slow_thread, NULL);
    pthread_join(quick_thread, NULL);
}

static void others_are_served_while_one_answer_is_still_to_come(void **state)
{
    (void)state;
    struct stage s;
    open_stage(&s);
    struct call slow = {.path = s.path};
    struct quick_calls quick = {.path = s.path};
    play(&s, &slow, &quick);
    assert_string_equal(json_string_value(json_object_get(quick.quick, "said")), "quick");
    assert_non_null(slow.reply);
    assert_string_equal(json_string_value(json_object_get(slow.reply, "said")), "late");
    json_decref(slow.reply);
    json_decref(quick.quick);
    json_decref(quick.finish);
    close_stage(&s);
}

static void a_late_failure_reaches_its_client_with_code_and_text(void **state)
{
    (void)state;
    struct stage s;
    open_stage(&s);
    struct call slow = {.path = s.path};
    struct quick_calls quick = {.path = s.path, .fail = true};
    play(&s, &slow, &quick);
    assert_null(slow.reply);
    assert_int_equal(slow.err.code, ERROR_RETRY);
    assert_string_equal(slow.err.text, "not today");
    json_decref(quick.quick);
    json_decref(quick.finish);
    close_stage(&s);
}

static void an_answer_for_a_client_that_went_away_is_forgotten(void **state)
{
    (void)state;
    struct stage s;
    open_stage(&s);
    struct control_client *client = control_connect(s.path, NULL);
    assert_non_null(client);
    struct error err = {0};
    assert_null(control_call(client, json_pack("{s:s}", "do", "slow"), 1, &err));
    while (!s.ticket)
        assert_true(control_serve(s.server, 20, handle, &s, NULL));
    control_close(client);
    assert_true(control_serve(s.server, 20, handle, &s, NULL));
    control_answer(s.server, s.ticket, json_object(), NULL);
    control_answer(s.server, 999, json_object(), NULL);
    assert_int_equal(s.handled, 1);
    close_stage(&s);
}

static void lines_sent_behind_a_slow_request_are_answered_after_it_in_order(void **state)
{
    (void)state;
    struct stage s;
    open_stage(&s);
    struct control_client *client = control_connect(s.path, NULL);
    struct error err = {0};
    assert_null(control_call(client, json_pack("{s:s}", "do", "slow"), 1, &err));
    assert_null(control_call(client, json_pack("{s:s}", "do", "quick"), 1, &err));
    for (int i = 0; i < 5; i++)
        assert_true(control_serve(s.server, 5, handle, &s, NULL));
    assert_int_equal(s.handled, 1);
    control_answer(s.server, s.ticket, json_pack("{s:s}", "said", "late"), NULL);
    for (int i = 0; i < 5; i++)
        assert_true(control_serve(s.server, 5, handle, &s, NULL));
    assert_int_equal(s.handled, 2);
    control_close(client);
    close_stage(&s);
}

static void there_is_no_ticket_outside_a_handler(void **state)
{
    (void)state;
    struct stage s;
    open_stage(&s);
    assert_int_equal(control_later(s.server), 0);
    close_stage(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(others_are_served_while_one_answer_is_still_to_come),
        cmocka_unit_test(a_late_failure_reaches_its_client_with_code_and_text),
        cmocka_unit_test(an_answer_for_a_client_that_went_away_is_forgotten),
        cmocka_unit_test(lines_sent_behind_a_slow_request_are_answered_after_it_in_order),
        cmocka_unit_test(there_is_no_ticket_outside_a_handler),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
