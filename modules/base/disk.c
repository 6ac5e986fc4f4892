/* SPDX-License-Identifier: MIT
 * Files as the operating system has them: locks, what is on the disk, hard links, lists, checksums; text without a
 * buffer. */
#define _GNU_SOURCE
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { piece = 1 << 20 };

/* One to one in `sum` and in `word`: another word, or another sum before it, is another sum behind. */
static uint64_t mix(uint64_t sum, uint64_t word)
{
    sum ^= word;
    sum = sum << 29 | sum >> 35;
    return sum * 0x9E3779B97F4A7C15u;
}

int64_t stirpoint_sum_words(int64_t seed, const int64_t *words, int64_t n)
{
    uint64_t sum = (uint64_t)seed;
    for (int64_t i = 0; i < n; i++) sum = mix(sum, (uint64_t)words[i]);
    return (int64_t)sum;
}

/* Checksum of `count` bytes of a file from byte `first` on; 0 if they could be read. */
int stirpoint_sum_file(const char *path, int64_t first, int64_t count, int64_t *sum)
{
    int64_t *words = malloc(piece);
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    int status = words && fd >= 0 ? 0 : -1;
    *sum = first;
    while (status == 0 && count > 0) {
        size_t want = count < piece ? (size_t)count : piece, have = 0;
        while (have < want) {
            ssize_t got = pread(fd, (char *)words + have, want - have, (off_t)first + (off_t)have);
            if (got < 0 && errno == EINTR) continue;
            if (got <= 0) break;
            have += (size_t)got;
        }
        if (have < want) status = -1;
        memset((char *)words + have, 0, piece - have);
        if (status == 0) *sum = stirpoint_sum_words(*sum, words, (int64_t)(want + 7) / 8);
        first += (int64_t)want;
        count -= (int64_t)want;
    }
    if (fd >= 0) close(fd);
    free(words);
    return status;
}

/* Bring a file or a directory to the disk; 0 if done, or if the file system knows no such thing. */
int stirpoint_sync(const char *path)
{
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return -1;
    int status = fsync(fd) == 0 || errno == EINVAL || errno == ENOTSUP ? 0 : -1;
    if (close(fd) != 0) status = -1;
    return status;
}

/* Let `kept` be the file `path`, which stays where it is if the file system has links; 0 if done, or
 * if there is nothing to keep. */
int stirpoint_link_file(const char *path, const char *kept)
{
    struct stat is_there;
    if (stat(path, &is_there) != 0) return errno == ENOENT ? 0 : -1;
    if (unlink(kept) != 0 && errno != ENOENT) return -1;
    if (link(path, kept) == 0) return 0;
    return rename(path, kept);
}

/* Take the lock of a file for the life of this process: 0; 1: another process has it after so many
 * seconds; 2: the file system has no locks; -errno: the file cannot be made. */
int stirpoint_lock(const char *path, double seconds)
{
    const struct timespec nap = {0, 20000000};
    int fd = open(path, O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (fd < 0) return -errno;
    for (;; seconds -= 0.02) {
        if (flock(fd, LOCK_EX | LOCK_NB) == 0) return 0;
        if (errno != EWOULDBLOCK && errno != EINTR) {
            close(fd);
            return 2;
        }
        if (seconds <= 0) {
            close(fd);
            return 1;
        }
        nanosleep(&nap, 0);
    }
}

/* Names in a directory, each with a newline behind it; returns their length, also if it does not fit;
 * -1 if there is no such directory. */
int64_t stirpoint_list(const char *path, char *names, int64_t size)
{
    int64_t used = 0;
    DIR *directory = opendir(path);
    if (!directory) return -1;
    for (struct dirent *entry; (entry = readdir(directory));) {
        int64_t n = (int64_t)strlen(entry->d_name);
        if (used + n + 1 <= size) {
            memcpy(names + used, entry->d_name, (size_t)n);
            names[used + n] = '\n';
        }
        used += n + 1;
    }
    closedir(directory);
    return used;
}

/* A number that no other call returns. */
int64_t stirpoint_random(void)
{
    int64_t r = 0;
    if (getrandom(&r, sizeof r, 0) != (ssize_t)sizeof r) {
        struct timespec now;
        clock_gettime(CLOCK_REALTIME, &now);
        r = (int64_t)mix(mix((uint64_t)now.tv_sec, (uint64_t)now.tv_nsec), (uint64_t)getpid());
    }
    return r;
}

/* Path of something that exists from the root on, without links; empty if it cannot be known. */
void stirpoint_full_path(const char *path, char *full, int n)
{
    char *found = realpath(path, 0);
    full[0] = 0;
    if (found && strlen(found) < (size_t)n) memcpy(full, found, strlen(found) + 1);
    free(found);
}

int stirpoint_process(void) { return (int)getpid(); }

/* Name of the computer, with a null behind it. */
void stirpoint_host(char *name, int size)
{
    if (gethostname(name, (size_t)size) != 0) name[0] = 0;
    name[size - 1] = 0;
}

/* Text files without a buffer: what a call says it wrote has left the program. 0 or errno comes back. */

/* File descriptor of a file emptied (fresh) or gone on with, or -errno. A link is not followed; a fresh file replaces it. */
int stirpoint_text_open(const char *path, int fresh)
{
    const int flags = O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | (fresh ? O_TRUNC : O_APPEND);
    int fd = open(path, flags, 0644);
    if (fd < 0 && errno == ELOOP && fresh && unlink(path) == 0) fd = open(path, flags, 0644);
    return fd >= 0 ? fd : -errno;
}

/* 1 if the path is no longer that of the open file, which was moved, deleted or replaced; else 0. */
int stirpoint_text_is_removed(int fd, const char *path)
{
    struct stat mine, there;
    if (fstat(fd, &mine) != 0) return 0;
    if (lstat(path, &there) != 0) return errno == ENOENT;
    return there.st_dev != mine.st_dev || there.st_ino != mine.st_ino;
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

/* Copy an open file to a new one: its descriptor or -errno. */
int stirpoint_text_copy(int fd, const char *path)
{
    char text[4096];
    off_t at = 0;
    int copy = stirpoint_text_open(path, 0);
    for (ssize_t n; copy >= 0 && (n = pread(fd, text, sizeof text, at)) != 0;) {
        int code = n > 0 ? stirpoint_text_put(copy, text, n) : errno;
        at += n > 0 ? n : 0;
        if (code == 0 || code == EINTR) continue;
        close(copy);
        return -code;
    }
    return copy;
}

/* Text to standard output: 0, errno, or -1 if nobody reads it any more. */
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
    const char *words = code == ELOOP ? "it is a symbolic link" : strerror_r(code, own, sizeof own);
    memset(text, ' ', (size_t)n);
    memcpy(text, words, strnlen(words, (size_t)n));
}
