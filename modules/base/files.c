/* SPDX-License-Identifier: MIT
 * Text files without a buffer: what a call says it wrote has left the program. 0 or errno comes back. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* File descriptor of a file emptied (fresh) or gone on with, or -errno. */
int stirpoint_text_open(const char *path, int fresh)
{
    int fd = open(path, O_WRONLY | O_CREAT | O_CLOEXEC | (fresh ? O_TRUNC : O_APPEND), 0644);
    return fd >= 0 ? fd : -errno;
}

int stirpoint_text_put(int fd, const char *text, long long n)
{
    while (n > 0) {
        ssize_t done = write(fd, text, (size_t)n);
        if (done < 0 && errno == EINTR) continue;
        if (done < 0 && errno == EAGAIN) { /* a pipe that is full and does not block */
            struct pollfd one = {.fd = fd, .events = POLLOUT};
            poll(&one, 1, -1);
            continue;
        }
        if (done <= 0) return done < 0 ? errno : EIO;
        text += done;
        n -= done;
    }
    return 0;
}

/* The same to standard output; -1 if nobody reads it any more. */
int stirpoint_say(const char *text, long long n)
{
    int code = stirpoint_text_put(STDOUT_FILENO, text, n);
    return code == EPIPE ? -1 : code;
}

/* Bring it to the disk, where there is one. */
int stirpoint_text_sync(int fd)
{
    return fsync(fd) == 0 || errno == EINVAL || errno == EROFS ? 0 : errno;
}

int stirpoint_text_close(int fd) { return close(fd) == 0 ? 0 : errno; }

/* Words for an errno, blank padded. */
void stirpoint_reason(int code, char *text, int n)
{
    char own[256];
    const char *words = strerror_r(code, own, sizeof own);
    memset(text, ' ', (size_t)n);
    memcpy(text, words, strnlen(words, (size_t)n));
}
