/* Wiring of the ATmega328P, and the content of the EEPROM, which is specific to one board.
 * On shutdown: a reset makes every pin an input, so the relays release, the inlet closes and the vent opens. */
#ifndef HARDWARE_H
#define HARDWARE_H

/* The Arduino 4 Relays Shield on an UNO: D4, D7 and D8; D12 is free. A high pin energises its relay. */
#define INLET_BIT 4 /* of port D: D4 */
#define VENT_BIT 7  /* of port D: D7; the energised relay closes the vent */
#define OK_BIT 0    /* of port B: D8, output contact "instrument OK": the host is active and no fault is latched */
#define LED_BIT 5   /* of port B: D13, off in the state VENTED, in which the pressure is verified to be low */

#define SENSOR_CHANNEL 0u /* A0 */
#define BANDGAP_CHANNEL 14u

/* Blank cells read FFh. */
#define EEPROM_KIND 0       /* u8: kind of board; blank: a real board */
#define EEPROM_SERIAL 1     /* u32: serial number */
#define EEPROM_BANDGAP_MV 5 /* u16: measured reference; outside the data sheet's limits, the nominal value is used */
#define MIN_BANDGAP_MV 1000u
#define NOMINAL_BANDGAP_MV 1100u
#define MAX_BANDGAP_MV 1200u

#endif
