/* Elapsed time in milliseconds, counted in whole samples. The counter stops at its maximum instead of wrapping.
 * On shutdown: this file drives no pin. */
#ifndef ELAPSED_H
#define ELAPSED_H

#include "numbers.h"

#define SAMPLE_S (SAMPLE_MS * 1e-3f)

/* Add the time of one sample. */
static void elapse(uint16_t *since_ms)
{
    if (*since_ms <= UINT16_MAX - SAMPLE_MS)
        *since_ms += SAMPLE_MS;
}

#endif
