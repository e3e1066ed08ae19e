// SPDX-License-Identifier: Apache-2.0
#include "simulator/spotread_link.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "files/write.h"
#include "simulator/wire_fault.h"

enum { LOOK_MS = 10000, EXECUTABLE = 0755 };

// ---- boothsim's side -----------------------------------------------------------------

// Between single quotes, as a shell reads it.
static void write_quoted(FILE *out, const char *text)
{
    fputc('\'', out);
    for (; *text; text++)
        if (*text == '\'')
            fputs("'\\''", out);
        else
            fputc(*text, out);
    fputc('\'', out);
}

bool spotread_leave(const char *run_dir, struct error *err)
{
    char self[PATH_MAX], run[PATH_MAX], path[1024], socket[PATH_MAX + 16];
    struct whole_file file;
    ssize_t length = readlink("/proc/self/exe", self, sizeof(self) - 1);
    snprintf(path, sizeof(path), "%s/spotread", run_dir);
    if (length < 0 || !realpath(run_dir, run))
        return fail_errno(err, "writing %s", path);
    self[length] = '\0';
    snprintf(socket, sizeof(socket), "%s/boothsim.sock", run);
    if (!whole_file_begin(&file, path, err))
        return false;
    fputs("#!/bin/sh\nexec ", file.stream);
    write_quoted(file.stream, self);
    fputs(" --spotread ", file.stream);
    write_quoted(file.stream, socket);
    fputs(" \"$@\"\n", file.stream);
    if (!whole_file_commit(&file, err))
        return false;
    return chmod(path, EXECUTABLE) == 0 || fail_errno(err, "writing %s", path);
}

void spotread_take_away(const char *run_dir)
{
    char path[1024];
    snprintf(path, sizeof(path), "%s/spotread", run_dir);
    unlink(path);
}

static enum spotread_trouble trouble_of(enum wire_fault fault)
{
    return fault == WIRE_UNPLUGGED    ? SPOTREAD_GONE
           : fault == WIRE_SILENT     ? SPOTREAD_STUCK
           : fault == WIRE_STALL      ? SPOTREAD_FATAL
           : fault == WIRE_WEAK_LIGHT ? SPOTREAD_WEAK
           : fault == WIRE_OVERLOAD   ? SPOTREAD_BRIGHT
                                      : SPOTREAD_WELL;
}

void spotread_offer(json_t *answer, const struct spotread_settings *settings, struct wire *wire)
{
    int pulled = 0;
    enum wire_fault fault = wire_fault_of(wire, WIRE_SPOTREAD, &pulled);
    const struct spotread_settings *s = settings;
    json_object_set_new(answer, "spotread",
                        json_pack("{si, ss, sI, sf, sf, si, si, si, si}", "kind", s->kind, "serial",
                                  s->serial, "seed", (json_int_t)s->seed, "hurry", s->hurry,
                                  "drift", s->lapses.drift, "misread_every",
                                  s->lapses.misread_every, "trouble", trouble_of(fault), "lapse",
                                  lapse_of_fault(fault), "plug", pulled));
}

// ---- spotread's side -------------------------------------------------------------------

static bool read_radiance(json_t *answer, struct spectrum *out)
{
    json_t *values = json_object_get(json_object_get(answer, "radiance"), "values");
    for (size_t i = 0; i < SPECTRUM_COUNT; i++)
        out->v[i] = json_number_value(json_array_get(values, i));
    return json_array_size(values) == SPECTRUM_COUNT;
}

static bool read_instrument(json_t *answer, struct spotread_settings *s,
                            struct spotread_sight *sight)
{
    int kind, trouble, lapse;
    const char *serial;
    json_int_t seed;
    if (json_unpack(json_object_get(answer, "spotread"), "{si, ss, sI, sF, sF, si, si, si, si}",
                    "kind", &kind, "serial", &serial, "seed", &seed, "hurry", &s->hurry, "drift",
                    &s->lapses.drift, "misread_every", &s->lapses.misread_every, "trouble",
                    &trouble, "lapse", &lapse, "plug", &sight->plug))
        return false;
    snprintf(s->serial, sizeof(s->serial), "%s", serial);
    s->seed = (uint64_t)seed;
    s->kind = (enum spotread_kind)kind;
    sight->trouble = (enum spotread_trouble)trouble;
    sight->lapse = (enum lapse_kind)lapse;
    return true;
}

bool spotread_look(struct control_client *client, struct spotread_settings *settings,
                   struct spotread_sight *sight, struct error *err)
{
    struct spotread_settings unused;
    json_t *answer = control_call(client, json_pack("{ss}", "do", CONTROL_RADIANCE), LOOK_MS, err);
    if (!answer)
        return false;
    bool good = read_radiance(answer, &sight->radiance) &&
                read_instrument(answer, settings ? settings : &unused, sight);
    json_decref(answer);
    return good || fail(err, ERROR_DATA, "boothsim's answer holds no radiance");
}
