// SPDX-License-Identifier: Apache-2.0
// The emulated spotread by hand, in a time of its own. Include after cmocka.h.
#ifndef TESTS_SIMULATOR_SPOTREAD_HERE_H
#define TESTS_SIMULATOR_SPOTREAD_HERE_H

#include <string.h>

#include "base/clock.h"
#include "simulator/model_spotread.h"

static struct spotread *spotread;
static struct spotread_sight sight;
static int64_t now_ns;

static inline void begin(enum spotread_kind kind, int argc, char **argv)
{
    struct spotread_settings settings = {
        .kind = kind, .serial = "EMU1", .seed = 3, .hurry = 1, .lapses = {0.01, 2}};
    spotread_destroy(spotread);
    spotread = spotread_create(&settings, argc, argv);
    assert_non_null(spotread);
}

// As begin, with arguments in one line.
static inline void start(enum spotread_kind kind, const char *line)
{
    static char words[256];
    static char *argv[16];
    int argc = 0;
    strcpy(words, line);
    for (char *rest = words, *word; (word = strtok_r(rest, " ", &rest));)
        argv[argc++] = word;
    begin(kind, argc, argv);
}

// All that it says until it wants something that a person gives.
static inline const char *listen(void)
{
    static char said[65536];
    said[0] = 0;
    for (int steps = 0; steps < 10000; steps++) {
        int64_t until_ns;
        strcat(said, spotread_err(spotread));
        strcat(said, spotread_out(spotread));
        enum spotread_want want = spotread_wants(spotread, now_ns, &until_ns);
        if (want == SPOTREAD_SIGHT) {
            spotread_sight(spotread, now_ns, &sight);
        } else if (want == SPOTREAD_TIME) {
            now_ns = until_ns;
            spotread_time(spotread, now_ns);
        } else {
            break;
        }
    }
    return said;
}

static inline const char *press(int key)
{
    spotread_key(spotread, now_ns, key);
    return listen();
}

static inline enum spotread_want wants(void)
{
    int64_t until_ns;
    return spotread_wants(spotread, now_ns, &until_ns);
}

static inline void shine(double radiance)
{
    for (int i = 0; i < SPECTRUM_COUNT; i++)
        sight.radiance.v[i] = radiance;
}

static int fresh(void **state)
{
    (void)state;
    sight = (struct spotread_sight){.plug = 1};
    shine(0.002);
    now_ns = 0;
    return 0;
}

static int gone(void **state)
{
    (void)state;
    spotread_destroy(spotread);
    spotread = NULL;
    return 0;
}

#define WITH(test) cmocka_unit_test_setup_teardown(test, fresh, gone)

#define assert_says(text, part)                                                                    \
    do {                                                                                           \
        if (!strstr(text, part)) {                                                                 \
            print_error("\"%s\" does not hold \"%s\"\n", text, part);                              \
            _fail(__FILE__, __LINE__);                                                             \
        }                                                                                          \
    } while (0)

#endif
