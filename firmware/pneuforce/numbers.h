/* Numbers and tables that the firmware and the Python board share.
 * Generated from sim/board and protocol by `make docs`: do not edit. */
#ifndef NUMBERS_H
#define NUMBERS_H

#include <stdint.h>

/* pneuforce.protocol.frames */
#define PROTOCOL_VERSION 1u
#define BAUD 500000u
#define SAMPLES_PER_S 500u
#define FRAME_BYTES 24u
#define OVERSAMPLING 16u
#define ADC_FULL_SCALE 16384u
#define MAX_ADC_SUM 16368u

/* pneuforce.protocol.limits */
#define SENSITIVITY_PER_KPA 0.018f
#define OFFSET 0.04f
#define ZERO_SPAN_KPA 1.3f
#define MIN_VALID_ADC_SUM 164u
#define MAX_VALID_ADC_SUM 16040u
#define MIN_SUPPLY_MV 4750u
#define MAX_SUPPLY_MV 5250u
#define MIN_SETPOINT_PA 2000u
#define MAX_SETPOINT_PA 12000u
#define HARD_LIMIT_KPA 25.0f
#define HOST_SILENCE_MS 250u
#define VENTED_KPA 0.3f
#define VENTED_MS 500u
#define FILL_KPA_PER_S 5.0f
#define HALVING_TIME_MS 550u
#define HALVING_FROM_KPA 8.0f
#define VENT_KPA_PER_S 8.0f
#define OCCLUDED_TIME_RATIO 0.6f

/* pneuforce.sim.board.states */
#define SAFE 0u
#define LOCKED 2u
#define FILL 3u

/* pneuforce.sim.board.reading */
#define POSITION_GAIN 0.2f
#define RATE_GAIN 0.022f
#define HISTORY_MS 100u

/* pneuforce.sim.board.supply */
#define SUPPLY_SAMPLES 16u

/* pneuforce.sim.board.filling */
#define TUBE_LAG_MS 60u
#define VALVE_DELAY_MS 12u
#define EQUALISE_MS 300u
#define BAND_KPA 0.05f
#define IN_BAND_MS 300u
#define FAR_KPA 0.5f
#define PULSE_FRACTION 0.7f
#define MAX_PULSE_MS 500u

/* pneuforce.sim.board.monitors */
#define VENTED_NOMINAL_KPA 1.6f
#define STEADY_KPA 0.05f
#define MIN_FALL_KPA 0.2f
#define MIN_RISE_KPA 0.2f
#define RISE_WINDOW_MS 300u
#define LAG_OVER_MS 100u
#define FIRST_HALVING_FROM_KPA 1.8f
#define LATER_HALVING_FROM_KPA 0.6f
#define HALVINGS 3u
#define EQUAL_RATIO 0.8f
#define TOP_UP_BELOW_KPA 0.1f
#define TOP_UP_AFTER_MS 2000u
#define TOP_UP_WINDOW_MS 600000u
#define TOP_UP_HISTORY 8u

/* pneuforce.sim.board.proof_test */
#define TEST_PULSE_MS 16u
#define TEST_HALF_MS 360u
#define MIN_TEST_RISE_KPA 0.03f

/* pneuforce.sim.board.board_status */
#define CONTACT_LIMIT_AT_BOOT_KPA 18.0f
#define HOST_TIMEOUT_AT_BOOT_MS 2000u

/* pneuforce.sim.board.limits */
#define OVERSHOOT_KPA 0.5f
#define FILLING_LIMIT_KPA 12.5f
#define FROZEN_MS 200u
#define LIMIT_POINT_KPA 0.1f
#define BURST_BELOW_KPA 0.5f
#define VENT_SHUT_MS 3000u
#define INLET_LEAK_KPA 0.3f
#define SETPOINT_TIMEOUT_MS 15000u
#define MAX_VALVE_ACTIONS 20u
#define MAX_TOP_UPS 3u

/* pneuforce.sim.board.pressure_control */
#define MIN_HOST_TIMEOUT_MS 250u
#define MAX_HOST_TIMEOUT_MS 10000u

/* pneuforce.sim.board.board */
#define FIRMWARE_REVISION 258u
#define HELLO_INTERVAL_US 200000u
#define SAMPLE_MS 2u
#define SYNC_0 0xA5u
#define SYNC_1 0x5Au

/* Values of the bytes in the frames, and triggers of state transitions. */
enum {
    BOARD_REAL = 0, BOARD_EMULATED = 1, BOARD_SIMULATED = 2
};
enum {
    STATE_BOOT = 0, STATE_VENTED = 1, STATE_INFLATING = 2, STATE_SETTLING = 3, STATE_HOLDING = 4,
    STATE_VENTING = 5, STATE_TRIPPED = 6, STATE_TESTING = 7
};
enum {
    FAULT_NONE = 0, FAULT_SENSOR = 1, FAULT_SENSOR_FROZEN = 2, FAULT_SUPPLY_VOLTAGE = 3,
    FAULT_OVERPRESSURE = 4, FAULT_BURST = 5, FAULT_LIMIT_POINT = 6, FAULT_NO_RISE = 7, FAULT_INLET_OPEN = 8,
    FAULT_VENT_SHUT = 9, FAULT_OCCLUSION = 10, FAULT_LEAK = 11, FAULT_SETPOINT_TIMEOUT = 12,
    FAULT_HOST_SILENT = 13, FAULT_WATCHDOG = 14
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
    TRIGGER_VENT_REQUESTED, TRIGGER_HOLD_REQUESTED, TRIGGER_VENT_VERIFIED, TRIGGER_NEAR_SETPOINT,
    TRIGGER_FAR_BELOW_SETPOINT, TRIGGER_SETTLED, TRIGGER_RETARGETED, TRIGGER_IDENTIFIED,
    TRIGGER_TEST_REQUESTED, TRIGGER_TEST_FINISHED, TRIGGER_TRIPPED, TRIGGER_CLEARED, TRIGGER_COUNT, NO_TRIGGER
};

/* pneuforce.protocol.frames: payloads. */
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
    uint16_t host_timeout_ms;
} __attribute__((packed));
#define KIND_IMAGE 0x3Cu
struct image {
    uint32_t crc;
} __attribute__((packed));
#define KIND_EVENT 0x66u
struct event {
    uint32_t board_time_us;
    uint8_t state;
    uint8_t previous_state;
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
    uint16_t host_timeout_ms;
    uint8_t clear;
    uint8_t proof_test;
} __attribute__((packed));
#define KIND_VENT 0xCCu

/* pneuforce.sim.board.states: next state for each state (rows) and trigger (columns). */
#define STATE_COUNT 8
#define STAYS 0xFFu
#define TRANSITION_ROWS { \
    { STAYS, STAYS, STATE_VENTED, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_TRIPPED, STAYS }, \
    { STAYS, STATE_INFLATING, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_TRIPPED, STAYS }, \
    { STATE_VENTING, STAYS, STAYS, STATE_SETTLING, STAYS, STAYS, STAYS, STATE_VENTING, STAYS, STAYS, STATE_TRIPPED, STAYS }, \
    { STATE_VENTING, STAYS, STAYS, STAYS, STATE_INFLATING, STATE_HOLDING, STAYS, STATE_VENTING, STAYS, STAYS, STATE_TRIPPED, STAYS }, \
    { STATE_VENTING, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_SETTLING, STAYS, STATE_TESTING, STAYS, STATE_TRIPPED, STAYS }, \
    { STAYS, STAYS, STATE_VENTED, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_TRIPPED, STAYS }, \
    { STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_VENTING }, \
    { STATE_VENTING, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STAYS, STATE_HOLDING, STATE_TRIPPED, STAYS } }
#define FILLING_STATES 0x0Cu
#define PRESSURISED_STATES 0x9Cu

/* pneuforce.sim.board.limits: fault, mask of states, samples in a row, condition. */
#define LIMIT_COUNT 16
#define LIMIT_ROWS(ROW) \
    ROW(FAULT_SENSOR, 0xFFu, 5, sensor_ok) \
    ROW(FAULT_SUPPLY_VOLTAGE, 0xFFu, 16, supply_ok) \
    ROW(FAULT_OVERPRESSURE, 0xFFu, 1, below_hard_limit) \
    ROW(FAULT_OVERPRESSURE, 0x0Cu, 3, below_filling_limit) \
    ROW(FAULT_OVERPRESSURE, 0x90u, 3, below_contact_limit) \
    ROW(FAULT_BURST, 0x90u, 3, balloon_intact) \
    ROW(FAULT_LIMIT_POINT, 0x0Cu, 1, not_past_limit_point) \
    ROW(FAULT_SENSOR_FROZEN, 0xFFu, 1, sensor_moves) \
    ROW(FAULT_NO_RISE, 0x0Cu, 1, pressure_rises) \
    ROW(FAULT_INLET_OPEN, 0x02u, 50, stays_vented) \
    ROW(FAULT_VENT_SHUT, 0x61u, 1, pressure_falls) \
    ROW(FAULT_OCCLUSION, 0x0Cu, 10, fill_rate_plausible) \
    ROW(FAULT_OCCLUSION, 0x20u, 1, vent_rate_plausible) \
    ROW(FAULT_LEAK, 0x10u, 1, few_top_ups) \
    ROW(FAULT_SETPOINT_TIMEOUT, 0x0Cu, 1, setpoint_in_time) \
    ROW(FAULT_HOST_SILENT, 0x9Cu, 1, host_in_time)

/* Condition under which a latched fault may be cleared. */
#define CLEAR_CONDITION_ROWS(ROW) \
    ROW(FAULT_SENSOR, sensor_ok) \
    ROW(FAULT_SUPPLY_VOLTAGE, supply_ok) \
    ROW(FAULT_OVERPRESSURE, overpressure_gone) \
    ROW(FAULT_SENSOR_FROZEN, sensor_moves) \
    ROW(FAULT_INLET_OPEN, vent_verified) \
    ROW(FAULT_VENT_SHUT, vent_verified) \
    ROW(FAULT_HOST_SILENT, host_reconnected)

#endif
