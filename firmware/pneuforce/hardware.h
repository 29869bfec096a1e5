/* What is wired to the ATmega328P, and what its EEPROM tells of this one board.
 * On shutdown: reset makes every pin an input; the relays fall off, the inlet shuts, the vent opens. */
#ifndef HARDWARE_H
#define HARDWARE_H

/* The Arduino 4 Relays Shield on an UNO: D4, D7 and D8; D12 is free. A lit pin pulls its relay. */
#define INLET_BIT 4 /* of port D: D4 */
#define VENT_BIT 7  /* of port D: D7; energised it shuts the vent */
#define OK_BIT 0    /* of port B: D8, a contact for others: a host is heard and no fault is latched */
#define LED_BIT 5   /* of port B: D13, dark while the rig is vented, and verified so */

#define SENSOR_CHANNEL 0u /* A0 */
#define BANDGAP_CHANNEL 14u

/* Blank cells read FFh. */
#define EEPROM_KIND 0       /* u8: what sits at the far end; blank: a real board */
#define EEPROM_SERIAL 1     /* u32 */
#define EEPROM_BANDGAP_MV 5 /* u16: the reference as measured; beyond the data sheet's span: the nominal one */
#define BANDGAP_LEAST_MV 1000u
#define BANDGAP_NOMINAL_MV 1100u
#define BANDGAP_MOST_MV 1200u

#endif
