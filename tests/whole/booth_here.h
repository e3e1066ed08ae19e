// SPDX-License-Identifier: Apache-2.0
// boothd under boothsim, watched from outside. Include after running.h.
#ifndef TESTS_WHOLE_BOOTH_HERE_H
#define TESTS_WHOLE_BOOTH_HERE_H

#include <dirent.h>
#include <stdio.h>

#include "tests/fakes/folder.h"

enum { BOOTH_CALL_MS = 60000 }; // bounds a hang only

struct booth_here {
    struct folder folder;
    pid_t booth, daemon;
};

static inline pid_t child_of(pid_t parent, const char *name)
{
    pid_t found = 0;
    DIR *folder = opendir("/proc");
    for (struct dirent *entry; folder && !found && (entry = readdir(folder));) {
        char path[300], line[512], called[64];
        int pid, above;
        snprintf(path, sizeof path, "/proc/%s/stat", entry->d_name);
        read_words(path, line, sizeof line);
        if (sscanf(line, "%d (%63[^)]) %*c %d", &pid, called, &above) == 3 && above == parent &&
            !strcmp(called, name))
            found = pid;
    }
    if (folder)
        closedir(folder);
    return found;
}

// What both programs wrote from this place on; the caller frees it.
static inline char *booth_log(const struct booth_here *b, long from)
{
    char path[300];
    snprintf(path, sizeof path, "%s/log", b->folder.path);
    FILE *file = fopen(path, "r");
    char *text = calloc(1, 1 << 20);
    if (file && text && fseek(file, from, SEEK_SET) == 0)
        text[fread(text, 1, (1 << 20) - 1, file)] = 0;
    if (file)
        fclose(file);
    return text;
}

// Starts both; scenario and settings are the shipped ones, then more lines of the scenario and
// boothd's arguments as a shell reads them, where $run is the run folder.
static inline bool booth_open(struct booth_here *b, const char *more_scenario,
                              const char *arguments)
{
    static char shipped[8192], whole[16384];
    char materials[512], run[256], scenario[256], line[2048];
    folder_open(&b->folder);
    read_words("simulator/scenarios/booth.ini", shipped, sizeof shipped);
    snprintf(whole, sizeof whole, "%s\n%s", shipped, more_scenario);
    snprintf(scenario, sizeof scenario, "%s", folder_put(&b->folder, "booth.ini", whole));
    assert_non_null(realpath("config/materials", materials));
    read_words("config/booths/emulated.conf", shipped, sizeof shipped);
    snprintf(whole, sizeof whole, "%s\n[materials]\nfolder = %s\n[control]\nsocket = boothd.sock\n",
             shipped, materials);
    folder_put(&b->folder, "run/boothd.conf", whole);
    snprintf(run, sizeof run, "%s", folder_at(&b->folder, "run"));
    snprintf(line, sizeof line, "run=%s; exec %s --config $run/boothd.conf %s", run,
             program_path("boothd"), arguments);
    const char *argv[] = {program_path("boothsim"),
                          "--scenario",
                          scenario,
                          "--run",
                          run,
                          "--",
                          "/bin/sh",
                          "-c",
                          line,
                          NULL};
    b->booth = start_program(argv, folder_at(&b->folder, "log"));
    struct control_client *client = connect_to(folder_at(&b->folder, "run/boothd.sock"), b->booth);
    if (!client) {
        char *text = booth_log(b, 0);
        print_error("%s\n", text);
        free(text);
    }
    control_close(client);
    b->daemon = child_of(b->booth, "boothd");
    return client && b->daemon > 0;
}

static inline long booth_log_size(const struct booth_here *b)
{
    struct stat facts;
    char path[300];
    snprintf(path, sizeof path, "%s/log", b->folder.path);
    return stat(path, &facts) ? 0 : (long)facts.st_size;
}

// Ends boothd by its control socket and gives boothsim's exit status, which is boothd's.
static inline int booth_close(struct booth_here *b)
{
    int status = -1;
    if (b->booth > 0) {
        kill(b->booth, SIGTERM);
        status = await_program(b->booth);
    }
    if (status) {
        char *text = booth_log(b, 0);
        print_error("%s\n", text);
        free(text);
    }
    folder_close(&b->folder);
    b->booth = b->daemon = 0;
    return status;
}

static inline json_t *booth_status(struct control_client *daemon)
{
    return control_call(daemon, json_pack("{ss}", "do", "status"), BOOTH_CALL_MS, NULL);
}

static inline bool booth_fault(struct control_client *booth, const char *instrument,
                               const char *kind)
{
    json_t *reply = control_call(
        booth, json_pack("{ss,ss,ss}", "do", "fault", "instrument", instrument, "kind", kind),
        BOOTH_CALL_MS, NULL);
    json_decref(reply);
    return reply != NULL;
}

static inline const json_t *dig(const json_t *object, const char *path)
{
    char key[64];
    for (const char *end; object && *path; path = *end ? end + 1 : end) {
        end = strchr(path, '.');
        end = end ? end : path + strlen(path);
        snprintf(key, sizeof key, "%.*s", (int)(end - path), path);
        object = json_object_get(object, key);
    }
    return object;
}

static inline const char *dig_text(const json_t *object, const char *path)
{
    const char *value = json_string_value(dig(object, path));
    return value ? value : "";
}

static inline double dig_real(const json_t *object, const char *path)
{
    return json_number_value(dig(object, path));
}

// What a process holds.
struct held {
    int descriptors, threads;
    double resident_mib;
};

static inline int entries_of(pid_t pid, const char *what)
{
    char path[64];
    int count = 0;
    snprintf(path, sizeof path, "/proc/%d/%s", (int)pid, what);
    DIR *folder = opendir(path);
    for (struct dirent *entry; folder && (entry = readdir(folder));)
        count += *entry->d_name != '.';
    if (folder)
        closedir(folder);
    return count;
}

static inline struct held held_by(pid_t pid)
{
    char path[64], line[128];
    long pages = 0;
    snprintf(path, sizeof path, "/proc/%d/statm", (int)pid);
    sscanf(read_words(path, line, sizeof line), "%*d %ld", &pages);
    return (struct held){entries_of(pid, "fd"), entries_of(pid, "task"),
                         (double)pages * (double)sysconf(_SC_PAGESIZE) / (1 << 20)};
}

// The same once threads and descriptors have not changed for half a second.
static inline struct held held_at_rest(pid_t pid)
{
    enum { SAME_LOOKS = 20 };
    struct held last = held_by(pid);
    for (int same = 0; same < SAME_LOOKS;) {
        clock_sleep_until_ns(clock_now_ns() + 25 * NS_PER_MS);
        struct held now = held_by(pid);
        bool alike = now.threads == last.threads && now.descriptors == last.descriptors;
        same = alike ? same + 1 : 0;
        last = now;
    }
    return last;
}

#endif
