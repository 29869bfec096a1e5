/* The numbers and tables that the boards in C and in Python share.
 * Made from sim/board and instrument/rig by `make docs`: do not edit. */
#ifndef NUMBERS_H
#define NUMBERS_H

#include <stdint.h>

/* instrument.rig.frames */
#define PROTOCOL_VERSION 1u
#define BAUD 500000u
#define SAMPLES_PER_S 500u
#define FRAME_BYTES 24u
#define OVERSAMPLING 16u
#define ADC_FULL_SCALE 16384u
#define COUNTS_LIMIT 16368u

/* instrument.rig.limits */
#define SENSITIVITY_PER_KPA 0.018f
#define OFFSET 0.04f
#define ZERO_SPAN_KPA 1.3f
#define ALIVE_SUM_LEAST 164u
#define ALIVE_SUM_MOST 16040u
#define SUPPLY_MV_LEAST 4750u
#define SUPPLY_MV_MOST 5250u
#define SETPOINT_PA_LEAST 2000u
#define SETPOINT_PA_MOST 12000u
#define HARD_LIMIT_KPA 25.0f
#define HOST_SILENCE_MS 250u
#define VENTED_KPA 0.3f
#define VENTED_MS 500u
#define FILL_KPA_PER_S 5.0f
#define HALVING_MS 550u
#define HALVED_KPA 8.0f
#define OCCLUDED_SHARE 0.6f

/* sim.board.states */
#define SAFE 0u
#define LOCKED 2u
#define FILL 3u

/* sim.board.reading */
#define POSITION_GAIN 0.2f
#define RATE_GAIN 0.022f
#define PAST_MS 100u

/* sim.board.supply */
#define SUPPLY_SAMPLES 16u

/* sim.board.filling */
#define TUBE_MS 60u
#define VALVE_MS 12u
#define VENT_KPA_PER_S 8.0f
#define EQUAL_MS 300u
#define BAND_KPA 0.05f
#define WITHIN_MS 300u
#define FAR_KPA 0.5f
#define PULSE_SHARE 0.7f
#define LONGEST_PULSE_MS 500u

/* sim.board.watches */
#define VENTED_NOMINAL_KPA 1.6f
#define STEADY_KPA 0.05f
#define FALL_KPA 0.2f
#define RISE_KPA 0.2f
#define RISE_WITHIN_MS 300u
#define LAG_OVER_MS 100u
#define HALVED_FROM_KPA 1.8f
#define LOW_KPA 0.1f
#define LOW_MS 2000u
#define TOP_UPS_WITHIN_MS 600000u
#define TOP_UPS_KEPT 8u

/* sim.board.situation */
#define CONTACT_LIMIT_AT_BOOT_KPA 18.0f
#define VENT_AFTER_AT_BOOT_MS 2000u

/* sim.board.limits */
#define OVERSHOOT_KPA 0.5f
#define FILLING_LIMIT_KPA 12.5f
#define STUCK_MS 200u
#define LIMIT_POINT_KPA 0.1f
#define BURST_BELOW_KPA 0.5f
#define VENT_SHUT_MS 3000u
#define INLET_LEAK_KPA 0.3f
#define TIMEOUT_MS 15000u
#define MOST_ACTIONS 20u
#define MOST_TOP_UPS 3u

/* sim.board.pressure */
#define VENT_AFTER_MS_LEAST 250u
#define VENT_AFTER_MS_MOST 10000u

/* sim.board.board */
#define FIRMWARE 256u
#define HELLO_EVERY_US 200000u
#define SAMPLE_MS 2u
#define SYNC_0 0xA5u
#define SYNC_1 0x5Au

/* What the bytes of the frames mean. */
enum {
    BOARD_REAL = 0, BOARD_EMULATED = 1, BOARD_SIMULATED = 2
};
enum {
    STATE_BOOT = 0, STATE_VENTED = 1, STATE_INFLATING = 2, STATE_SETTLING = 3, STATE_HOLDING = 4,
    STATE_VENTING = 5, STATE_TRIPPED = 6
};
enum {
    FAULT_NONE = 0, FAULT_SENSOR = 1, FAULT_STUCK = 2, FAULT_SUPPLY_VOLTAGE = 3, FAULT_OVERPRESSURE = 4,
    FAULT_BURST = 5, FAULT_LIMIT_POINT = 6, FAULT_NO_RISE = 7, FAULT_INLET_OPEN = 8, FAULT_VENT_SHUT = 9,
    FAULT_OCCLUSION = 10, FAULT_LEAK = 11, FAULT_TIMEOUT = 12, FAULT_HOST_SILENT = 13, FAULT_WATCHDOG = 14
};
enum {
    MODE_VENT = 0, MODE_HOLD = 1
};
enum {
    VALVE_INLET_OPEN = 1, VALVE_VENT_CLOSED = 2
};
enum {
    FLAG_IN_CONTACT = 1, FLAG_ZEROED = 2
};
enum {
    HAPPENS_VENT_ASKED, HAPPENS_HOLD_ASKED, HAPPENS_EMPTY, HAPPENS_NEAR, HAPPENS_FAR, HAPPENS_SETTLED,
    HAPPENS_RETARGETED, HAPPENS_GREETED, HAPPENS_TRIPPED, HAPPENS_CLEARED, HAPPENINGS, NOTHING_HAPPENS
};

/* instrument.rig.frames: payloads. */
#define KIND_SAMPLE 0x33u
struct sample {
    uint32_t board_time_us;
    uint16_t adc_sum;
    uint16_t supply_mv;
    uint8_t valves;
    uint8_t state;
    uint8_t fault;
    uint16_t faults;
    uint8_t command;
    uint16_t setpoint_pa;
} __attribute__((packed));
#define KIND_HELLO 0x55u
struct hello {
    uint8_t board;
    uint16_t firmware;
    uint32_t uptime_ms;
    uint32_t serial;
    uint16_t host_silence_ms;
    uint16_t vent_after_ms;
} __attribute__((packed));
#define KIND_EVENT 0x66u
struct event {
    uint32_t board_time_us;
    uint8_t state;
    uint8_t was;
    uint8_t fault;
} __attribute__((packed));
#define KIND_IDENTIFY 0x99u
#define KIND_COMMAND 0xAAu
struct command {
    uint8_t mode;
    uint8_t flags;
    uint16_t setpoint_pa;
    int16_t zero_pa;
    uint16_t contact_limit_pa;
    uint16_t vent_after_ms;
    uint8_t clear;
} __attribute__((packed));
#define KIND_VENT 0xCCu

/* sim.board.states: what follows on each happening (columns) in each state (rows). */
#define STATES 7
#define STAYS 0xFFu
#define TRANSITION_ROWS { \
    { STAYS, STAYS, STATE_VENTED, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_TRIPPED, STAYS }, \
    { STAYS, STATE_INFLATING, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_TRIPPED, STAYS }, \
    { STATE_VENTING, STAYS, STAYS, STATE_SETTLING, STAYS, STAYS, STAYS, STATE_VENTING, STATE_TRIPPED, STAYS }, \
    { STATE_VENTING, STAYS, STAYS, STAYS, STATE_INFLATING, STATE_HOLDING, STAYS, STATE_VENTING, STATE_TRIPPED, STAYS }, \
    { STATE_VENTING, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_SETTLING, STAYS, STATE_TRIPPED, STAYS }, \
    { STAYS, STAYS, STATE_VENTED, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_TRIPPED, STAYS }, \
    { STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_VENTING } }
#define FILLING_STATES 0x0Cu
#define PRESSURISED_STATES 0x1Cu

/* sim.board.limits: fault, mask of states, samples in a row, what is allowed. */
#define LIMIT_COUNT 16
#define LIMIT_ROWS(ROW) \
    ROW(FAULT_SENSOR, 0x7Fu, 5, alive) \
    ROW(FAULT_SUPPLY_VOLTAGE, 0x7Fu, 16, supplied) \
    ROW(FAULT_OVERPRESSURE, 0x7Fu, 1, below_hard_limit) \
    ROW(FAULT_OVERPRESSURE, 0x0Cu, 3, below_filling_limit) \
    ROW(FAULT_OVERPRESSURE, 0x10u, 3, below_contact_limit) \
    ROW(FAULT_BURST, 0x10u, 3, intact) \
    ROW(FAULT_LIMIT_POINT, 0x0Cu, 1, keeps_rising) \
    ROW(FAULT_STUCK, 0x7Fu, 1, moving) \
    ROW(FAULT_NO_RISE, 0x0Cu, 1, rises) \
    ROW(FAULT_INLET_OPEN, 0x02u, 50, inlet_shut) \
    ROW(FAULT_VENT_SHUT, 0x61u, 1, empties) \
    ROW(FAULT_OCCLUSION, 0x0Cu, 10, fills_slowly) \
    ROW(FAULT_OCCLUSION, 0x20u, 1, empties_slowly) \
    ROW(FAULT_LEAK, 0x10u, 1, keeps_gas) \
    ROW(FAULT_TIMEOUT, 0x0Cu, 1, in_time) \
    ROW(FAULT_HOST_SILENT, 0x1Cu, 1, host_speaks)

/* When a latched fault may be cleared. */
#define GONE_ROWS(ROW) \
    ROW(FAULT_SENSOR, alive) \
    ROW(FAULT_SUPPLY_VOLTAGE, supplied) \
    ROW(FAULT_OVERPRESSURE, overpressure_gone) \
    ROW(FAULT_STUCK, moving) \
    ROW(FAULT_INLET_OPEN, empty) \
    ROW(FAULT_VENT_SHUT, empty) \
    ROW(FAULT_HOST_SILENT, heard)

#endif
