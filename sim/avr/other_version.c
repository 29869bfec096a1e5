/* Firmware with the protocol version OTHER_VERSION, to simulate the firmware of another release. */
#include "../../firmware/pneuforce/numbers.h"

#undef PROTOCOL_VERSION
#define PROTOCOL_VERSION OTHER_VERSION
#include "../../firmware/pneuforce/pneuforce.ino"
