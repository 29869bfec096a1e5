/* Firmware with the protocol version OTHER_VERSION, as another release would have it. */
#include "../../firmware/pneuforce/numbers.h"

#undef PROTOCOL_VERSION
#define PROTOCOL_VERSION OTHER_VERSION
#include "../../firmware/pneuforce/pneuforce.ino"
