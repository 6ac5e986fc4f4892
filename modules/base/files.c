/* SPDX-License-Identifier: MIT
 * Text files without a buffer: what a call says it wrote has left the program. 0 or errno comes back. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
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

/* Columns of the window that standard output is shown in; 0 if it is none: a file, a pipe, the
 * pseudo-terminal without a size that mpirun gives a rank. Then it is the window of mpirun, the parent,
 * if that has one. */
int stirpoint_window(void)
{
    static int has_none = 0;
    struct winsize window = {0};
    char path[64];
    if (has_none || !isatty(STDOUT_FILENO)) return has_none = 1, 0;
    if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col > 0) return window.ws_col;
    snprintf(path, sizeof path, "/proc/%ld/fd/1", (long)getppid());
    int fd = getenv("OMPI_COMM_WORLD_RANK") ? open(path, O_WRONLY | O_NOCTTY | O_CLOEXEC | O_NONBLOCK) : -1;
    if (fd < 0 || !isatty(fd) || ioctl(fd, TIOCGWINSZ, &window) != 0) window.ws_col = 0;
    if (fd >= 0) close(fd);
    has_none = window.ws_col == 0;
    return window.ws_col;
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
