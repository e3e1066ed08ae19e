// SPDX-License-Identifier: Apache-2.0
#include "calibration/seal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "files/write.h"

enum { MARK = sizeof SEAL_MARK - 1, DIGITS = sizeof SEAL_ZEROS - 1 };

static bool all_digits(const char *p)
{
    int i = 0;
    while (i < DIGITS && memchr("0123456789abcdef", p[i], 16))
        i++;
    return i == DIGITS;
}

// Where the digits of the one seal stand, or NULL.
static char *digits_of(char *bytes, size_t size, struct error *err)
{
    char *found = NULL;
    char *end = bytes + size;
    for (char *p = bytes; (p = memmem(p, (size_t)(end - p), SEAL_MARK, MARK)); p += MARK) {
        if (found) {
            fail(err, ERROR_DATA, "more than one seal");
            return NULL;
        }
        found = p + MARK;
    }
    if (!found || end - found < DIGITS || !all_digits(found)) {
        fail(err, ERROR_DATA, "no seal");
        return NULL;
    }
    return found;
}

bool seal_fill(char *bytes, size_t size, struct error *err)
{
    struct sha256 digest;
    char *digits = digits_of(bytes, size, err);
    if (!digits)
        return false;
    if (memcmp(digits, SEAL_ZEROS, DIGITS))
        return fail(err, ERROR_DATA, "sealed already");
    if (!sha256_of_bytes(bytes, size, &digest, err))
        return false;
    memcpy(digits, digest.hex, DIGITS);
    return true;
}

bool seal_check(const char *bytes, size_t size, struct sha256 *digest, struct error *err)
{
    struct sha256 stated = {0}, found;
    char *copy = malloc(size + 1);
    if (!copy)
        return fail(err, ERROR_SYSTEM, "out of memory");
    memcpy(copy, bytes, size);
    copy[size] = 0;
    char *digits = digits_of(copy, size, err);
    bool fine = digits;
    if (fine) {
        memcpy(stated.hex, digits, DIGITS);
        memcpy(digits, SEAL_ZEROS, DIGITS);
        fine = sha256_of_bytes(copy, size, &found, err);
    }
    free(copy);
    if (fine && strcmp(stated.hex, found.hex))
        return fail(err, ERROR_DATA, "changed since it was sealed: sealed %.12s..., now %.12s...",
                    stated.hex, found.hex);
    if (fine && digest)
        *digest = stated;
    return fine;
}

bool seal_write(const char *path, char *bytes, size_t size, struct error *err)
{
    return (seal_fill(bytes, size, err) && whole_file_write(path, bytes, size, err)) ||
           while_doing(err, "%s", path);
}

bool sealed_inputs_add(struct sealed_inputs *inputs, const char *path, struct error *err)
{
    for (int i = 0; i < inputs->count; i++)
        if (!strcmp(inputs->of[i].path, path))
            return true;
    if (inputs->count == SEAL_INPUTS)
        return fail(err, ERROR_RANGE, "%s: more than %d inputs", path, SEAL_INPUTS);
    struct sealed_input *input = &inputs->of[inputs->count];
    if (!sha256_of_file(path, &input->digest, err))
        return false;
    snprintf(input->path, sizeof input->path, "%s", path);
    inputs->count++;
    return true;
}

json_t *sealed_inputs_json(const struct sealed_inputs *inputs)
{
    json_t *out = json_array();
    for (int i = 0; i < inputs->count; i++)
        json_array_append_new(out, json_pack("{ss,ss}", "path", inputs->of[i].path, "sha256",
                                             inputs->of[i].digest.hex));
    return out;
}
