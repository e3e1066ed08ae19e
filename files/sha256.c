// SPDX-License-Identifier: Apache-2.0
#include "files/sha256.h"

#include <errno.h>
#include <fcntl.h>
#include <openssl/evp.h>
#include <stdint.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static bool begin(EVP_MD_CTX **context, struct error *err)
{
    *context = EVP_MD_CTX_new();
    if (*context && EVP_DigestInit_ex(*context, EVP_sha256(), NULL))
        return true;
    EVP_MD_CTX_free(*context);
    return fail(err, ERROR_SYSTEM, "SHA-256 is not to be had from libcrypto");
}

static bool finish(EVP_MD_CTX *context, bool fed, struct sha256 *digest, struct error *err)
{
    uint8_t bytes[EVP_MAX_MD_SIZE];
    unsigned size = 0;
    bool good = fed && EVP_DigestFinal_ex(context, bytes, &size) && size == 32;
    EVP_MD_CTX_free(context);
    if (!good)
        return fail(err, ERROR_SYSTEM, "SHA-256: libcrypto failed");
    for (unsigned i = 0; i < size; i++) {
        digest->hex[2 * i] = "0123456789abcdef"[bytes[i] >> 4];
        digest->hex[2 * i + 1] = "0123456789abcdef"[bytes[i] & 15];
    }
    digest->hex[64] = 0;
    return true;
}

bool sha256_of_bytes(const void *bytes, size_t size, struct sha256 *digest, struct error *err)
{
    EVP_MD_CTX *context;
    if (!begin(&context, err))
        return false;
    return finish(context, EVP_DigestUpdate(context, bytes, size), digest, err);
}

static bool feed(EVP_MD_CTX *context, int fd)
{
    uint8_t part[65536];
    for (;;) {
        ssize_t got = read(fd, part, sizeof part);
        if (got == 0)
            return true;
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0 || !EVP_DigestUpdate(context, part, (size_t)got))
            return false;
    }
}

static bool digest_of_open(int fd, const char *path, struct sha256 *digest, struct error *err)
{
    EVP_MD_CTX *context;
    struct stat what;
    if (fstat(fd, &what) || !S_ISREG(what.st_mode))
        return fail(err, ERROR_CONFIG, "%s: is no regular file", path);
    if (!begin(&context, err))
        return false;
    errno = 0;
    bool fed = feed(context, fd);
    if (!fed && errno) {
        EVP_MD_CTX_free(context);
        return fail_errno(err, "%s: cannot be read", path);
    }
    return finish(context, fed, digest, err) || while_doing(err, "%s", path);
}

bool sha256_of_file(const char *path, struct sha256 *digest, struct error *err)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK);
    if (fd < 0)
        return fail(err, ERROR_CONFIG, "%s: cannot be read: %s", path, strerror(errno));
    bool good = digest_of_open(fd, path, digest, err);
    close(fd);
    return good;
}
