/* Time since something, in milliseconds: counted in whole samples, it stops at its end instead of wrapping.
 * On shutdown: nothing here drives a pin. */
#ifndef ELAPSED_H
#define ELAPSED_H

#include "numbers.h"

#define SAMPLE_S (SAMPLE_MS * 1e-3f)

/* One sample later. */
static void elapse(uint16_t *since_ms)
{
    if (*since_ms <= UINT16_MAX - SAMPLE_MS)
        *since_ms += SAMPLE_MS;
}

#endif
