/* SPDX-License-Identifier: MIT
 * A disk on which files whose path ends in SMALL_DISK_FILE have room for SMALL_DISK_BYTES bytes: loaded
 * before a program (LD_PRELOAD), its writes behind that fail as those to a full disk, half a write first. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

/* Bytes of n at `offset` (-1: where the file ends or is) of file fd for which there is room. */
static size_t room(int fd, off_t offset, size_t n)
{
    const char *name = getenv("SMALL_DISK_FILE"), *bytes = getenv("SMALL_DISK_BYTES");
    char link[64], path[PATH_MAX];
    struct stat state;
    if (!name || !bytes) return n;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, sizeof path - 1);
    size_t wanted = strlen(name);
    if (length < (ssize_t)wanted || strncmp(path + length - wanted, name, wanted)) return n;
    if (offset < 0 && fstat(fd, &state) == 0 && S_ISREG(state.st_mode)) offset = state.st_size;
    long long left = atoll(bytes) - (long long)offset;
    return left <= 0 ? 0 : left < (long long)n ? (size_t)left : n;
}

#define REAL(name) \
    static __typeof__(&name) real; \
    if (!real) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

#define LIMIT(offset) \
    size_t fits = room(fd, offset, n); \
    if (fits == 0 && n > 0) { errno = ENOSPC; return -1; }

ssize_t write(int fd, const void *data, size_t n)
{
    REAL(write);
    LIMIT(-1)
    return real(fd, data, fits);
}

ssize_t pwrite(int fd, const void *data, size_t n, off_t offset)
{
    REAL(pwrite);
    LIMIT(offset)
    return real(fd, data, fits, offset);
}

ssize_t pwrite64(int fd, const void *data, size_t n, off64_t offset)
{
    return pwrite(fd, data, n, offset);
}

static size_t bytes_of(const struct iovec *part, int parts)
{
    size_t n = 0;
    for (int i = 0; i < parts; i++) n += part[i].iov_len;
    return n;
}

ssize_t writev(int fd, const struct iovec *part, int parts)
{
    REAL(writev);
    size_t n = bytes_of(part, parts);
    LIMIT(-1)
    return fits == n ? real(fd, part, parts) : write(fd, part[0].iov_base, part[0].iov_len);
}

ssize_t pwritev(int fd, const struct iovec *part, int parts, off_t offset)
{
    REAL(pwritev);
    size_t n = bytes_of(part, parts);
    LIMIT(offset)
    return fits == n ? real(fd, part, parts, offset) : pwrite(fd, part[0].iov_base, part[0].iov_len, offset);
}

ssize_t pwritev64(int fd, const struct iovec *part, int parts, off64_t offset)
{
    return pwritev(fd, part, parts, offset);
}
