/* SPDX-License-Identifier: MIT
 * What only C can say: signal flags, cache prefetch, peak memory. */
#include <signal.h>
#include <string.h>
#include <sys/resource.h>

static volatile sig_atomic_t stop_flag = 0;

static void note_stop(int number) { stop_flag = number; }

void stirpoint_watch_signals(void)
{
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = note_stop;
    action.sa_flags = SA_RESTART;
    sigaction(SIGUSR1, &action, 0);
    sigaction(SIGTERM, &action, 0);
}

int stirpoint_stop_signal(void) { return stop_flag; }

void stirpoint_prefetch(const char *p, int bytes)
{
    for (int i = 0; i < bytes; i += 64) __builtin_prefetch(p + i, 1, 3);
}

double stirpoint_peak_memory(void)
{
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * (double)usage.ru_maxrss;
}
