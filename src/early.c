/* SPDX-License-Identifier: MIT
 * Heed signals before the shared libraries start, which takes far longer than anything before main. */
void stirpoint_watch_signals(void);

__attribute__((section(".preinit_array"), used)) static void (*const early)(void) = stirpoint_watch_signals;
