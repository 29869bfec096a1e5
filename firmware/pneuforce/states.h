/* The pressure state machine as a table. What a state's row does not name changes nothing.
 * On shutdown: no state survives; the board boots into BOOT, whose valves are SAFE. */
#ifndef STATES_H
#define STATES_H

#include <stdbool.h>

#include "numbers.h"

static const uint8_t TRANSITIONS[STATES][HAPPENINGS] = TRANSITION_ROWS;

/* Whether a mask of states has this one. */
static bool among(uint8_t states, uint8_t state)
{
    return (states >> state & 1u) != 0;
}

#endif
