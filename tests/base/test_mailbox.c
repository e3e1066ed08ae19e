// SPDX-License-Identifier: Apache-2.0
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include <string.h>

#include "base/mailbox.h"

enum { WORDS = 512, POSTS = 20000, WRITERS = 3 };

// Every word of a value is the same, so that a torn copy shows.
struct value {
    uint64_t words[WORDS];
};

static void an_empty_mailbox_gives_nothing_and_touches_nothing(void **state)
{
    (void)state;
    struct mailbox box;
    int value = 5;
    assert_true(mailbox_init(&box, sizeof value));
    assert_int_equal(mailbox_read(&box, &value), 0);
    assert_int_equal(value, 5);
    mailbox_fini(&box);
}

static void only_the_newest_value_is_kept_and_stays(void **state)
{
    (void)state;
    struct mailbox box;
    int value = 0;
    assert_true(mailbox_init(&box, sizeof value));
    for (int i = 10; i < 15; i++)
        mailbox_post(&box, &i);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(mailbox_read(&box, &value), 5);
        assert_int_equal(value, 14);
    }
    mailbox_fini(&box);
    mailbox_fini(&box);
    mailbox_fini(&(struct mailbox){0});
}

static void *post(void *context)
{
    struct mailbox *box = context;
    struct value value;
    for (uint64_t i = 1; i <= POSTS; i++) {
        for (int w = 0; w < WORDS; w++)
            value.words[w] = i;
        mailbox_post(box, &value);
    }
    return NULL;
}

static void assert_whole(const struct value *value)
{
    for (int w = 1; w < WORDS; w++)
        assert_true(value->words[w] == value->words[0]);
}

static void across_threads_no_value_is_torn_and_none_is_older_than_one_seen(void **state)
{
    (void)state;
    struct mailbox box;
    struct value value;
    pthread_t thread;
    assert_true(mailbox_init(&box, sizeof value));
    assert_int_equal(pthread_create(&thread, NULL, post, &box), 0);
    for (uint64_t last = 0; last < POSTS;) {
        uint64_t number = mailbox_read(&box, &value);
        if (!number)
            continue;
        assert_whole(&value);
        assert_true(number >= last && value.words[0] == number);
        last = number;
    }
    pthread_join(thread, NULL);
    mailbox_fini(&box);
}

static void several_writers_lose_no_count(void **state)
{
    (void)state;
    struct mailbox box;
    struct value value;
    pthread_t threads[WRITERS];
    assert_true(mailbox_init(&box, sizeof value));
    for (int i = 0; i < WRITERS; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, post, &box), 0);
    for (int i = 0; i < WRITERS; i++)
        pthread_join(threads[i], NULL);
    assert_int_equal(mailbox_read(&box, &value), WRITERS * POSTS);
    assert_whole(&value);
    assert_int_equal(value.words[0], POSTS);
    mailbox_fini(&box);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_empty_mailbox_gives_nothing_and_touches_nothing),
        cmocka_unit_test(only_the_newest_value_is_kept_and_stays),
        cmocka_unit_test(across_threads_no_value_is_torn_and_none_is_older_than_one_seen),
        cmocka_unit_test(several_writers_lose_no_count),
    };
    return cmocka_run_group_tests_name("mailbox", tests, NULL, NULL);
}
