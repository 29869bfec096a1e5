/* The firmware as another release has it: it speaks OTHER_VERSION of the rig link. */
#include "../../firmware/pneuforce/numbers.h"

#undef PROTOCOL_VERSION
#define PROTOCOL_VERSION OTHER_VERSION
#include "../../firmware/pneuforce/pneuforce.ino"
