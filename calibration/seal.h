// SPDX-License-Identifier: Apache-2.0
// Sealed files: each holds one mark "boothd-seal-sha256:" followed by the
// SHA-256 of the whole file, taken with 64 zeros in the digest's own place.
// What was changed afterwards shows; who changed it does not: a seal is no
// signature. To check one by hand: put the zeros back, then sha256sum.
#ifndef CALIBRATION_SEAL_H
#define CALIBRATION_SEAL_H

#include <jansson.h>
#include <stddef.h>

#include "files/sha256.h"

#define SEAL_MARK "boothd-seal-sha256:"
#define SEAL_ZEROS "0000000000000000000000000000000000000000000000000000000000000000"
#define SEAL_BLANK SEAL_MARK SEAL_ZEROS // what a writer puts where the seal goes

// Fills the one blank in bytes. Error (DATA) unless there is exactly one mark,
// and it is blank.
bool seal_fill(char *bytes, size_t size, struct error *err);

// Whether a sealed file is as it was when sealed; *digest (may be NULL) is
// its seal. Errors: DATA without exactly one seal, or when the bytes do not
// give it.
bool seal_check(const char *bytes, size_t size, struct sha256 *digest, struct error *err);

// Seals bytes and writes them to path, whole or not at all.
bool seal_write(const char *path, char *bytes, size_t size, struct error *err);

// What a report was made from.
struct sealed_input {
    char path[512];
    struct sha256 digest;
};

enum { SEAL_INPUTS = 64 };

struct sealed_inputs {
    int count;
    struct sealed_input of[SEAL_INPUTS];
};

// Takes the digest of a file. One that is listed already is not listed again.
// Errors: those of sha256_of_file; RANGE beyond SEAL_INPUTS.
bool sealed_inputs_add(struct sealed_inputs *inputs, const char *path, struct error *err);

// [{"path", "sha256"}]; new reference.
json_t *sealed_inputs_json(const struct sealed_inputs *inputs);

#endif
