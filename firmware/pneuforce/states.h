/* Transition table of the pressure state machine. Triggers that a state does not list change nothing.
 * On shutdown: no state survives; the board boots into BOOT, whose valves are SAFE. */
#ifndef STATES_H
#define STATES_H

#include <stdbool.h>

#include "numbers.h"

static const uint8_t TRANSITIONS[STATE_COUNT][TRIGGER_COUNT] = TRANSITION_ROWS;

/* Return true if the mask of states contains the state. */
static bool contains_state(uint8_t states, uint8_t state)
{
    return (states >> state & 1u) != 0;
}

#endif
