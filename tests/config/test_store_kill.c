// SPDX-License-Identifier: Apache-2.0
// A writer of the store, killed with SIGKILL at random instants of its work: what
// it had said was done is there, the calibration in force can be read, and the
// next writer leaves no litter behind.
#include "tests/fakes/support.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>

#include "base/clock.h"
#include "config/store.h"
#include "files/write.h"
#include "tests/fakes/folder.h"

#ifdef __SANITIZE_ADDRESS__
enum { KILLS = 200 };
#else
enum { KILLS = 1000 };
#endif
enum { PER_STORE = 100, FILES = 6 }; // kills before a store is begun anew; files of a version

static struct folder here;
static struct store_place place;
static uint64_t chance = 88172645463325252u;

static uint64_t next_chance(void) // xorshift64, Marsaglia 2003
{
    chance ^= chance << 13;
    chance ^= chance >> 7;
    chance ^= chance << 17;
    return chance;
}

// In memory where there is a file system for it: a thousand fsyncs of a disk
// would take minutes.
static int open_here(void **state)
{
    (void)state;
    strcpy(here.path, "/dev/shm/boothd-test-XXXXXX");
    if (!mkdtemp(here.path)) {
        strcpy(here.path, "/tmp/boothd-test-XXXXXX");
        assert_non_null(mkdtemp(here.path));
    }
    return 0;
}

static int close_here(void **state)
{
    (void)state;
    folder_close(&here);
    return 0;
}

static void die(const struct error *err)
{
    fprintf(stderr, "the writer: %s\n", err->text);
    _exit(1);
}

// One version whose files all hold the same random number: a mixture of two
// versions would show.
static int write_version(void)
{
    struct store_draft d;
    struct error err = {0};
    struct store_manifest m = {.created = "2026-01-31T12:00:00Z", .note = "killed at random"};
    char text[64], path[STORE_PATH + 64];
    int number = 0;
    enum { LAMPS_FROM = 3 };
    snprintf(text, sizeof text, "%llu\n", (unsigned long long)next_chance());
    if (!store_begin(&place, true, &d, &err))
        die(&err);
    snprintf(path, sizeof path, "%s/lamps", d.folder);
    mkdir(path, 0777);
    for (int i = 0; i < FILES; i++) {
        snprintf(path, sizeof path, "%s/%s%d", d.folder, i < LAMPS_FROM ? "f" : "lamps/", i);
        if (!whole_file_write(path, text, strlen(text), &err))
            die(&err);
    }
    if (!store_commit(&d, &m, &number, &err))
        die(&err);
    return number;
}

// Writes versions and puts old ones in force again until killed, each said on `out` once done.
static void write_for_ever(int out)
{
    for (;;) {
        int number = write_version();
        if (write(out, &number, sizeof number) != sizeof number)
            _exit(2);
        struct error err = {0};
        if (next_chance() % 4 == 0 && !store_use(&place, 1 + (int)(next_chance() % number), &err))
            die(&err);
    }
}

// The last version that the killed writer had said was done, 0 = none.
static int killed_after(int64_t delay_ns)
{
    int pipes[2], said = 0, number;
    assert_int_equal(pipe2(pipes, O_CLOEXEC), 0);
    next_chance(); // so that each writer has its own numbers
    pid_t writer = fork();
    if (!writer) {
        close(pipes[0]);
        write_for_ever(pipes[1]);
    }
    close(pipes[1]);
    struct timespec delay = {delay_ns / NS_PER_S, delay_ns % NS_PER_S};
    nanosleep(&delay, NULL);
    assert_int_equal(kill(writer, SIGKILL), 0);
    int status;
    assert_int_equal(waitpid(writer, &status, 0), writer);
    assert_true(WIFSIGNALED(status)); // it had not failed
    while (read(pipes[0], &number, sizeof number) == sizeof number)
        said = number;
    close(pipes[0]);
    return said;
}

static void check_version(int number)
{
    struct store_version v;
    struct error err = {0};
    if (!store_open(&place, number, &v, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    assert_int_equal(v.count, FILES + 1);
    for (int i = 1; i < FILES; i++) // f0, f1, f2, lamps/3, lamps/4, lamps/5, manifest.ini
        assert_string_equal(v.files[i].sum.hex, v.files[0].sum.hex);
    store_version_fini(&v);
}

static int litter(void)
{
    DIR *folder = opendir(place.folder);
    int count = 0;
    for (struct dirent *entry; folder && (entry = readdir(folder));)
        count += !strncmp(entry->d_name, ".draft", 6);
    if (folder)
        closedir(folder);
    return count;
}

struct tally {
    int said, most_litter, unsaid, least, most;
};

// What must hold after a kill.
static void check_store(int said, int before, struct tally *t)
{
    int *numbers, count, current;
    struct error err = {0};
    if (!store_current(&place, &current, &err))
        print_error("%s\n", err.text);
    assert_int_equal(err.code, ERROR_NONE);
    assert_true(store_numbers(&place, &numbers, &count, NULL));
    assert_int_equal(count, count ? numbers[count - 1] : 0); // 1, 2, 3 …: none is lost
    assert_true(count >= said && count <= (said ? said : before) + 1);
    assert_true(current > 0 || !count || (count == 1 && !said));
    t->unsaid += count > (said ? said : before);
    for (int i = before; i < count; i++)
        check_version(numbers[i]);
    if (current)
        check_version(current);
    free(numbers);
    t->most_litter = litter() > t->most_litter ? litter() : t->most_litter;
}

static int versions(void)
{
    int *numbers, count;
    assert_true(store_numbers(&place, &numbers, &count, NULL));
    free(numbers);
    return count;
}

static void begin_store(int turn)
{
    char name[32];
    snprintf(name, sizeof name, "store%d", turn);
    assert_true(store_place(folder_at(&here, name), "booth", "panel", &place, NULL));
}

static void nothing_is_lost_when_a_writer_is_killed_at_any_instant(void **state)
{
    (void)state;
    struct tally t = {0};
    int64_t all = 0;
    double span_ns = 1e6; // as long as some are killed within their first version and some later
    for (int i = 0; i < KILLS; i++) {
        if (i % PER_STORE == 0)
            begin_store(1 + i / PER_STORE);
        int before = versions();
        int said = killed_after((int64_t)(next_chance() % (uint64_t)span_ns));
        span_ns *= said ? 0.95 : 1.15;
        t.said += said > 0;
        check_store(said, before, &t);
        all += versions() - before;
        if (i % 10 == 9) { // the next writer
            write_version();
            assert_int_equal(litter(), 0);
        }
    }
    for (int i = 1; i <= versions(); i++)
        check_version(i);
    print_message("%d kills, %d within the first version, %d versions, %d of them not yet said, "
                  "%d drafts left at most\n",
                  KILLS, KILLS - t.said, (int)all, t.unsaid, t.most_litter);
    assert_true(t.most_litter <= 2); // a draft and a link of the one writer killed last
    assert_true(all > KILLS / 20);   // it was not always killed before its first rename
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_lost_when_a_writer_is_killed_at_any_instant),
    };
    return cmocka_run_group_tests(tests, open_here, close_here);
}
