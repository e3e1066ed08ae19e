// SPDX-License-Identifier: Apache-2.0
#include "calibration/journal.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

static const size_t LINE_DIGITS = 12; // below what any instrument sends

static bool take_line(struct journal *j, char *text, int number, struct error *err)
{
    json_error_t why;
    json_t *line = json_loads(text, JSON_REJECT_DUPLICATES, &why);
    if (!json_is_object(line)) {
        json_decref(line);
        return fail(err, ERROR_DATA, "%s:%d: is no line of a journal: %s", j->path, number,
                    line ? "no object" : why.text);
    }
    if (number == 1)
        j->head = line;
    else
        json_array_append_new(j->lines, line);
    return true;
}

// *whole (may be NULL): bytes up to the end of the last whole line.
static bool read_lines(struct journal *j, long *whole, struct error *err)
{
    char *text = NULL;
    size_t room = 0;
    long all = 0;
    bool fine = true;
    rewind(j->stream);
    for (int number = 1; fine; number++) {
        ssize_t length = getline(&text, &room, j->stream);
        if (length <= 0 || text[length - 1] != '\n')
            break;
        fine = take_line(j, text, number, err);
        all += length;
    }
    free(text);
    if (whole)
        *whole = all;
    return fine;
}

bool journal_read(struct journal *j, const char *path, struct error *err)
{
    *j = (struct journal){.stream = fopen(path, "re"), .lines = json_array()};
    snprintf(j->path, sizeof j->path, "%s", path);
    bool fine = j->stream
                    ? read_lines(j, NULL, err)
                    : fail(err, ERROR_CONFIG, "%s: cannot be read: %s", path, strerror(errno));
    if (fine && !j->head)
        fine = fail(err, ERROR_DATA, "%s: is an empty journal", path);
    if (!fine) {
        journal_close(j);
        return false;
    }
    fclose(j->stream);
    j->stream = NULL;
    return true;
}

static bool put(struct journal *j, const json_t *line, struct error *err)
{
    if (json_dumpf(line, j->stream, JSON_COMPACT | JSON_REAL_PRECISION(LINE_DIGITS)) ||
        fputc('\n', j->stream) == EOF || fflush(j->stream) || fdatasync(fileno(j->stream)))
        return fail_errno(err, "%s: cannot be written", j->path);
    return true;
}

bool journal_open(struct journal *j, const char *path, json_t *head, struct error *err)
{
    *j = (struct journal){.stream = fopen(path, "a+e"), .lines = json_array()};
    long whole = 0;
    snprintf(j->path, sizeof j->path, "%s", path);
    bool fine = j->stream || fail_errno(err, "%s", path);
    if (fine && flock(fileno(j->stream), LOCK_EX | LOCK_NB))
        fine = fail(err, ERROR_RETRY, "%s: another program is writing it", path);
    fine = fine && read_lines(j, &whole, err);
    if (fine && (ftruncate(fileno(j->stream), whole) || fseek(j->stream, whole, SEEK_SET)))
        fine = fail_errno(err, "%s", path); // what lies behind the last whole line goes
    if (fine && !j->head) {
        j->head = json_incref(head);
        fine = put(j, head, err);
    }
    if (!fine)
        journal_close(j);
    return fine;
}

bool journal_add(struct journal *j, json_t *line, struct error *err)
{
    bool fine = put(j, line, err);
    json_array_append_new(j->lines, line);
    return fine;
}

void journal_close(struct journal *j)
{
    if (j->stream)
        fclose(j->stream);
    json_decref(j->head);
    json_decref(j->lines);
    *j = (struct journal){0};
}
