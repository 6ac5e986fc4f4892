/* SPDX-License-Identifier: MIT
 * What only C can say: signal flags, libraries opened late, memory that grows where it is, cache prefetch, peak memory,
 * transposition in registers. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/auxv.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

/* Signals that ask for a stop. */
static const int stops[] = {SIGUSR1, SIGTERM, SIGINT, SIGHUP};
enum { n_stops = sizeof stops / sizeof *stops };

static volatile sig_atomic_t stop_flag = 0;
static volatile double heard[NSIG]; /* when each came first [s] */

/* No file has been written: the run is being set up. Where nobody asks for the signal within a second (an input without end, a
 * lengthy check), the run ends here. */
static volatile sig_atomic_t has_begun = 0;

static void leave_early(int number)
{
    char text[] = "stirpoint: signal    stopped the run before it began: nothing was written\n";
    (void)number;
    text[18] = (char)('0' + stop_flag / 10);
    text[19] = (char)('0' + stop_flag % 10);
    if (has_begun || write(2, text, sizeof text - 1) < 0) return;
    _exit(75);
}

/* The first signal asks for a stop in good order. The same once more, half a second later or more, is a
 * person who does not want to wait; earlier it is a batch system that sends it to every process twice. */
static void note_stop(int number)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    double now = (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
    if (stop_flag == 0) stop_flag = number;
    if (!has_begun) alarm(1);
    if (heard[number] == 0) heard[number] = now;
    if (now - heard[number] < 0.5) return;
    signal(number, SIG_DFL);
    raise(number);
}

/* A signal that is ignored so far (nohup, a job in the background) stays ignored. A limit on the size of
 * files and a reader that has gone away shall be errors of the write, not signals. Standard files that are
 * closed become /dev/null: the next file that is opened would take their place. */
void stirpoint_watch_signals(void)
{
    struct sigaction action, old;
    memset(&action, 0, sizeof action);
    action.sa_handler = note_stop;
    action.sa_flags = SA_RESTART;
    for (int k = 0; k < n_stops; k++)
        if (sigaction(stops[k], 0, &old) == 0 && old.sa_handler != SIG_IGN) sigaction(stops[k], &action, 0);
    signal(SIGALRM, leave_early);
    signal(SIGXFSZ, SIG_IGN);
    signal(SIGPIPE, SIG_IGN);
    for (int fd = 0; fd <= 2; fd++)
        if (fcntl(fd, F_GETFD) < 0 && open("/dev/null", O_RDWR) != fd) return;
}

/* Let signals end the program at once again, also one that came already. */
void stirpoint_leave_signals(void)
{
    struct sigaction old;
    for (int k = 0; k < n_stops; k++)
        if (sigaction(stops[k], 0, &old) == 0 && old.sa_handler == note_stop) signal(stops[k], SIG_DFL);
    signal(SIGPIPE, SIG_DFL);
    signal(SIGALRM, SIG_DFL);
    if (stop_flag != 0) raise(stop_flag);
}

int stirpoint_stop_signal(void) { return stop_flag; }

/* Steps that no longer end: every rank waits in a write, or for a message that does not come. */
static unsigned silence = 600; /* [s] */
static char hang[256];

static void say_hang(int number)
{
    (void)number;
    if (write(2, hang, strlen(hang)) < 0) return;
    alarm(silence);
}

/* `step` steps have ended; below 0: there are no more. The alarm is set anew once a second. */
void stirpoint_note_step(long long step)
{
    static time_t last = 0;
    struct timespec now;
    has_begun = 1;
    clock_gettime(CLOCK_MONOTONIC_COARSE, &now);
    if (step < 0) alarm(0);
    if (step < 0 || now.tv_sec == last) return;
    if (last == 0) {
        const char *given = getenv("STIRPOINT_SILENCE");
        if (given && atoi(given) > 0) silence = (unsigned)atoi(given);
        struct sigaction action;
        memset(&action, 0, sizeof action);
        action.sa_handler = say_hang;
        action.sa_flags = SA_RESTART;
        sigaction(SIGALRM, &action, 0);
    }
    last = now.tv_sec;
    alarm(silence);
    snprintf(hang, sizeof hang, "\nstirpoint: no step has ended for %u s (last: %lld): a disk or file server does not answer, or a "
             "process of this run is stopped or lost\n", silence, step);
}

static void *library = 0;

/* What went wrong, or 0. */
const char *stirpoint_open_library(const char *name)
{
    library = dlopen(name, RTLD_NOW | RTLD_GLOBAL);
    return library ? 0 : dlerror();
}

void *stirpoint_symbol(const char *name) { return dlsym(library, name); }

/* Folder of the program's file with a / at its end; empty if it is not known. `link` is what the kernel says of it,
 * usually /proc/self/exe; without a /proc the name counts under which the program was started. n is at least PATH_MAX. */
void stirpoint_program_folder(const char *link, char *path, int n)
{
    ssize_t length = readlink(link, path, (size_t)n - 1);
    path[length > 0 ? length : 0] = 0;
    const char *started = (const char *)getauxval(AT_EXECFN);
    if (length <= 0 && (!started || n < PATH_MAX || !realpath(started, path))) path[0] = 0;
    char *slash = strrchr(path, '/');
    if (slash) slash[1] = 0;
}

/* Memory that will be needed soon, fetched a few lines at a time between other work: all at once
 * would stall on the few loads that a core can have under way. It goes to the second-level cache: the
 * first is full of the weights and records of the present block. */
static const char *ahead = 0, *ahead_end = 0, *gap = 0, *gap_end = 0;

void stirpoint_register_prefetch(const char *p, int bytes, int gap_from, int gap_to)
{
    ahead = p;
    ahead_end = p + bytes;
    gap = p + gap_from;
    gap_end = p + gap_to;
}

void stirpoint_prefetch_lines(int lines)
{
    const char *end = ahead + 64 * lines < ahead_end ? ahead + 64 * lines : ahead_end;
    for (; ahead < end; ahead += 64) __builtin_prefetch(ahead, 0, 2);
    if (ahead >= gap && ahead < gap_end) ahead = gap_end;
}

/* Memory of aligned_alloc(64, ...) with another size; 0 and the old memory as it was if there is none. realloc moves pages
 * instead of what they hold where it can, but need not keep the boundary. */
void *stirpoint_resize(void *old, size_t bytes)
{
    char *p = realloc(old, bytes);
    if (!p || (uintptr_t)p % 64 == 0) return p;
    char *q = aligned_alloc(64, bytes);
    if (q) memcpy(q, p, bytes);
    free(p);
    return q;
}

double stirpoint_peak_memory(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * (double)usage.ru_maxrss;
}

/* Eight reals, one vector register with AVX-512; anywhere in memory. */
typedef double eight __attribute__((vector_size(64), aligned(8)));
typedef long long index8 __attribute__((vector_size(64)));

/* Rows to columns of an 8 x 8 matrix in registers. */
static inline void transpose8(eight m[8])
{
    const index8 low = {0, 8, 2, 10, 4, 12, 6, 14}, high = {1, 9, 3, 11, 5, 13, 7, 15};
    const index8 even = {0, 1, 8, 9, 4, 5, 12, 13}, odd = {2, 3, 10, 11, 6, 7, 14, 15};
    const index8 front = {0, 1, 2, 3, 8, 9, 10, 11}, back = {4, 5, 6, 7, 12, 13, 14, 15};
    eight t[8], u[8];
    for (int i = 0; i < 8; i += 2) {
        t[i] = __builtin_shuffle(m[i], m[i + 1], low);
        t[i + 1] = __builtin_shuffle(m[i], m[i + 1], high);
    }
    for (int i = 0; i < 8; i += 4)
        for (int j = 0; j < 2; j++) {
            u[i + j] = __builtin_shuffle(t[i + j], t[i + j + 2], even);
            u[i + j + 2] = __builtin_shuffle(t[i + j], t[i + j + 2], odd);
        }
    for (int i = 0; i < 4; i++) {
        m[i] = __builtin_shuffle(u[i], u[i + 4], front);
        m[i + 4] = __builtin_shuffle(u[i], u[i + 4], back);
    }
}

/* Records rec[n][4][8] of n particles (a multiple of 8): row 0 from value[8][n], lanes 4 to 6 of
 * rows 1 to 3 from slope[3][3][n], all else 0. */
void stirpoint_pack_records(int n, const double *value, const double *slope, double *rec)
{
    const index8 low = {0, 8, 2, 10, 4, 12, 6, 14}, high = {1, 9, 3, 11, 5, 13, 7, 15};
    const eight zero = {0};
    for (int p = 0; p < n; p += 8) {
        double *r = rec + 32 * p;
        eight m[8];
        for (int f = 0; f < 8; f++) m[f] = *(const eight *)(value + n * f + p);
        transpose8(m);
        for (int i = 0; i < 8; i++) *(eight *)(r + 32 * i) = m[i];
        for (int row = 1; row < 4; row++) {
            const double *s = slope + 3 * n * (row - 1) + p;
            eight a = *(const eight *)s, b = *(const eight *)(s + n), c = *(const eight *)(s + 2 * n);
            for (int odd = 0; odd < 2; odd++) {
                eight ab = __builtin_shuffle(a, b, odd ? high : low);
                eight c0 = __builtin_shuffle(c, zero, odd ? high : low);
                for (int i = 0; i < 8; i += 2) {
                    index8 pick = {9, 9, 9, 9, i, i + 1, i + 8, 9};
                    *(eight *)(r + 32 * (i + odd) + 8 * row) = __builtin_shuffle(ab, c0, pick);
                }
            }
        }
    }
}
