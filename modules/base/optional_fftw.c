/* SPDX-License-Identifier: MIT
 * The version of FFTW, a variable of its library. */
#include <fftw3.h>

const char *stirpoint_fftw_version(void) { return fftw_version; }
