// SPDX-License-Identifier: Apache-2.0
// SHA-256 digests, as 64 lower-case hexadecimal digits: what a sealed report
// and a stored calibration name their files by.
// Source: FIPS 180-4 (2015), computed by libcrypto.
#ifndef FILES_SHA256_H
#define FILES_SHA256_H

#include <stddef.h>

#include "base/error.h"

struct sha256 {
    char hex[65];
};

// False (SYSTEM) only when the library refuses.
bool sha256_of_bytes(const void *bytes, size_t size, struct sha256 *digest, struct error *err);

// Of a regular file's content, any size. Errors: CONFIG when there is no such
// file or it may not be read, SYSTEM when reading fails; both name the path.
bool sha256_of_file(const char *path, struct sha256 *digest, struct error *err);

#endif
