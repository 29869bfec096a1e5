/* pneuforce: the register map for programs in C99 and C++11.
 * Map version 1, hash D039D128h (registers 768 and 770).
 * Made from the register map: pneuforce map --format h. How to use it: docs/plc.md.
 *
 * A function takes the words of a block, as read from that block's first address on, each a number of this
 * machine (as libmodbus delivers them). It stores the value and returns whether it is one: false for "not
 * available", the value being 0 then. Whether the words are fresh only the sample counter can tell.
 */
#ifndef PNEUFORCE_REGISTERS_H
#define PNEUFORCE_REGISTERS_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define PNEUFORCE_MAP_VERSION 1
#define PNEUFORCE_MAP_HASH UINT32_C(0xD039D128)
#define PNEUFORCE_COMMAND_KEY 20550
#define PNEUFORCE_COUNT_MEASURED 36 /* words from 0: one read is one instant */
#define PNEUFORCE_COUNT_TEST 5
#define PNEUFORCE_ADDRESS_FORCE 0
#define PNEUFORCE_ADDRESS_FORCE_UNCERTAINTY 2
#define PNEUFORCE_ADDRESS_PRESSURE 4
#define PNEUFORCE_ADDRESS_RADIUS 6
#define PNEUFORCE_ADDRESS_SETPOINT 8
#define PNEUFORCE_ADDRESS_INITIAL_PRESSURE 10
#define PNEUFORCE_ADDRESS_RISE 12
#define PNEUFORCE_ADDRESS_INDENTATION 14
#define PNEUFORCE_ADDRESS_CONTACT_RADIUS 16
#define PNEUFORCE_ADDRESS_PEAK_FORCE 18
#define PNEUFORCE_ADDRESS_STATUS 20
#define PNEUFORCE_ADDRESS_SAMPLE_COUNTER 22
#define PNEUFORCE_ADDRESS_SAMPLE_AGE 24
#define PNEUFORCE_ADDRESS_STATE 25
#define PNEUFORCE_ADDRESS_CONTACT_COUNTER 26
#define PNEUFORCE_ADDRESS_REFUSAL 27
#define PNEUFORCE_ADDRESS_FORCE_LOW 28
#define PNEUFORCE_ADDRESS_FORCE_UNCOMPENSATED 30
#define PNEUFORCE_ADDRESS_BASELINE_DRIFT 32
#define PNEUFORCE_ADDRESS_DELAY 34
#define PNEUFORCE_ADDRESS_BASELINE_AGE 35
#define PNEUFORCE_ADDRESS_FORCE_MN 64
#define PNEUFORCE_ADDRESS_FORCE_UNCERTAINTY_MN 65
#define PNEUFORCE_ADDRESS_PRESSURE_PA 66
#define PNEUFORCE_ADDRESS_RADIUS_UM 67
#define PNEUFORCE_ADDRESS_SETPOINT_PA 68
#define PNEUFORCE_ADDRESS_RISE_PA 69
#define PNEUFORCE_ADDRESS_PEAK_FORCE_MN 70
#define PNEUFORCE_ADDRESS_CONDENSED_STATUS 71
#define PNEUFORCE_ADDRESS_STATUS_LOW 72
#define PNEUFORCE_ADDRESS_STATUS_HIGH 73
#define PNEUFORCE_ADDRESS_SETPOINT_REQUESTED 512
#define PNEUFORCE_ADDRESS_FORCE_LIMIT 514
#define PNEUFORCE_ADDRESS_MODE 516
#define PNEUFORCE_ADDRESS_LEASE 517
#define PNEUFORCE_ADDRESS_REFERENCE_PRESSURE 518
#define PNEUFORCE_ADDRESS_COMMAND_KEY 520
#define PNEUFORCE_ADDRESS_COMMAND_CODE 521
#define PNEUFORCE_ADDRESS_COMMAND_ARGUMENT 522
#define PNEUFORCE_ADDRESS_COMMAND_SEQUENCE 523
#define PNEUFORCE_ADDRESS_ANSWER_SEQUENCE 524
#define PNEUFORCE_ADDRESS_ANSWER_STATE 525
#define PNEUFORCE_ADDRESS_ANSWER_RESULT 526
#define PNEUFORCE_ADDRESS_LEASE_LEFT 528
#define PNEUFORCE_ADDRESS_LEASE_HOLDER 529
#define PNEUFORCE_ADDRESS_SETPOINT_REQUESTED_PA 544
#define PNEUFORCE_ADDRESS_FORCE_LIMIT_MN 545
#define PNEUFORCE_ADDRESS_MAP_VERSION 768
#define PNEUFORCE_ADDRESS_METHOD 769
#define PNEUFORCE_ADDRESS_MAP_HASH 770
#define PNEUFORCE_ADDRESS_CONFIGURATION_HASH 772
#define PNEUFORCE_ADDRESS_SERIAL_NUMBER 774
#define PNEUFORCE_ADDRESS_CALIBRATION_DATE 776
#define PNEUFORCE_ADDRESS_FIRST_FAULT 778
#define PNEUFORCE_ADDRESS_ACTIVE_FAULTS 779
#define PNEUFORCE_ADDRESS_BALLOON_ID 780
#define PNEUFORCE_ADDRESS_INFLATIONS 782
#define PNEUFORCE_ADDRESS_TEST_FLOAT 3840
#define PNEUFORCE_ADDRESS_TEST_LONG 3842
#define PNEUFORCE_ADDRESS_TEST_INT 3844
#define PNEUFORCE_LEAST_SETPOINT_REQUESTED 2.0f /* kPa */
#define PNEUFORCE_GREATEST_SETPOINT_REQUESTED 12.0f /* kPa */
#define PNEUFORCE_LEAST_FORCE_LIMIT 0.1f /* N */
#define PNEUFORCE_GREATEST_FORCE_LIMIT 20.0f /* N */
#define PNEUFORCE_LEAST_LEASE 200 /* ms */
#define PNEUFORCE_GREATEST_LEASE 60000 /* ms */
#define PNEUFORCE_LEAST_REFERENCE_PRESSURE -1.0f /* kPa */
#define PNEUFORCE_GREATEST_REFERENCE_PRESSURE 3.0f /* kPa */
#define PNEUFORCE_LEAST_SETPOINT_REQUESTED_PA 2000 /* Pa */
#define PNEUFORCE_GREATEST_SETPOINT_REQUESTED_PA 12000 /* Pa */
#define PNEUFORCE_LEAST_FORCE_LIMIT_MN 100 /* mN */
#define PNEUFORCE_GREATEST_FORCE_LIMIT_MN 20000 /* mN */
#define PNEUFORCE_STATUS_IN_CONTACT UINT32_C(0x00000001) /* The balloon is pressed. */
#define PNEUFORCE_STATUS_INFLATING UINT32_C(0x00000002) /* Inflating or settling. */
#define PNEUFORCE_STATUS_HOLDING UINT32_C(0x00000004) /* Holding: both valves locked at the setpoint. */
#define PNEUFORCE_STATUS_VENTED UINT32_C(0x00000008) /* Vented, and verified so: below 0.3 kPa for 0.5 s. */
#define PNEUFORCE_STATUS_INTERPOLATED UINT32_C(0x00000010) /* Rise below 0.5 kPa: the force is interpolated to zero. */
#define PNEUFORCE_STATUS_OUT_OF_RANGE UINT32_C(0x00000020) /* DP_i outside 4.95-11.45 kPa, or the model has no answer: force not available. */
#define PNEUFORCE_STATUS_FORCE_LIMIT UINT32_C(0x00000040) /* Force above the force limit (register 514). */
#define PNEUFORCE_STATUS_SETPOINT_NOT_REACHED UINT32_C(0x00000080) /* The setpoint was not reached in time. */
#define PNEUFORCE_STATUS_STALE UINT32_C(0x00000100) /* Sample older than 100 ms: values not available. */
#define PNEUFORCE_STATUS_LINK_LOST UINT32_C(0x00000200) /* No frame from the rig for more than 250 ms. */
#define PNEUFORCE_STATUS_SENSOR_FAULT UINT32_C(0x00000400) /* Pressure sensor open, short or stuck. */
#define PNEUFORCE_STATUS_OVERPRESSURE UINT32_C(0x00000800) /* A pressure limit was exceeded. */
#define PNEUFORCE_STATUS_LEAK UINT32_C(0x00001000) /* The locked pressure falls steadily without contact. */
#define PNEUFORCE_STATUS_BURST UINT32_C(0x00002000) /* Balloon burst, or past its limit point. */
#define PNEUFORCE_STATUS_LEASE_EXPIRED UINT32_C(0x00004000) /* A lease ran out. */
#define PNEUFORCE_STATUS_SIMULATED UINT32_C(0x00008000) /* The source is not a real rig. */
#define PNEUFORCE_STATUS_NOT_ZEROED UINT32_C(0x00010000) /* The pressure sensor has no zero yet: no inflation. */
#define PNEUFORCE_STATUS_WRITE_LOCK UINT32_C(0x00020000) /* Writes are locked by the configuration. */
#define PNEUFORCE_STATUS_BOARD_WATCHDOG UINT32_C(0x00040000) /* The board restarted by its watchdog or a brown-out. */
#define PNEUFORCE_STATUS_CAN_DOWN UINT32_C(0x00080000) /* The CAN interface is down. */
#define PNEUFORCE_STATUS_INLET_FAULT UINT32_C(0x00100000) /* Inlet valve or supply: no rise, or stuck open. */
#define PNEUFORCE_STATUS_VENT_FAULT UINT32_C(0x00200000) /* Vent valve stuck, or the tube is occluded: the balloon may be inflated. */
#define PNEUFORCE_STATUS_BOARD_RESET UINT32_C(0x00400000) /* The board restarted. */
#define PNEUFORCE_STATUS_BASELINE_OLD UINT32_C(0x00800000) /* The baseline is old or drifting. */
#define PNEUFORCE_STATUS_MAINTENANCE UINT32_C(0x01000000) /* Maintenance required (NAMUR NE 107): look at it soon. */
#define PNEUFORCE_STATUS_OUT_OF_SPECIFICATION UINT32_C(0x02000000) /* Out of specification (NAMUR NE 107). */
#define PNEUFORCE_STATUS_FUNCTION_CHECK UINT32_C(0x04000000) /* Function check (NAMUR NE 107): nothing is held, nothing has failed. */
#define PNEUFORCE_STATUS_FAILURE UINT32_C(0x08000000) /* Failure (NAMUR NE 107): a fault is latched, or samples are stale. */
#define PNEUFORCE_STATUS_CALIBRATED UINT32_C(0x10000000) /* The force carries a force calibration. */
#define PNEUFORCE_STATUS_ANY_FAILURE UINT32_C(0x80000000) /* Any failure is active. */

enum pneuforce_state {
    PNEUFORCE_STATE_BOOT = 0,
    PNEUFORCE_STATE_VENTED = 1,
    PNEUFORCE_STATE_INFLATING = 2,
    PNEUFORCE_STATE_SETTLING = 3,
    PNEUFORCE_STATE_HOLDING = 4,
    PNEUFORCE_STATE_VENTING = 5,
    PNEUFORCE_STATE_TRIPPED = 6
};

enum pneuforce_refusal {
    PNEUFORCE_REFUSAL_NONE = 0,
    PNEUFORCE_REFUSAL_STATE = 1,
    PNEUFORCE_REFUSAL_FAULT_LATCHED = 2,
    PNEUFORCE_REFUSAL_LEASE = 3,
    PNEUFORCE_REFUSAL_WRITE_LOCK = 4,
    PNEUFORCE_REFUSAL_CAUSE_PERSISTS = 5,
    PNEUFORCE_REFUSAL_LINK_LOST = 6,
    PNEUFORCE_REFUSAL_NOT_ZEROED = 7,
    PNEUFORCE_REFUSAL_IN_CONTACT = 8
};

enum pneuforce_mode {
    PNEUFORCE_MODE_VENT = 0,
    PNEUFORCE_MODE_HOLD = 1
};

enum pneuforce_lease_holder {
    PNEUFORCE_LEASE_HOLDER_NONE = 0,
    PNEUFORCE_LEASE_HOLDER_MODBUS_TCP = 1,
    PNEUFORCE_LEASE_HOLDER_MODBUS_RTU = 2,
    PNEUFORCE_LEASE_HOLDER_CAN = 3,
    PNEUFORCE_LEASE_HOLDER_PAGE = 4
};

enum pneuforce_command_code {
    PNEUFORCE_COMMAND_CODE_NONE = 0,
    PNEUFORCE_COMMAND_CODE_ZERO_PRESSURE = 1,
    PNEUFORCE_COMMAND_CODE_CLEAR_FAULTS = 2,
    PNEUFORCE_COMMAND_CODE_SELF_TEST = 3,
    PNEUFORCE_COMMAND_CODE_UNDO_ZERO = 4,
    PNEUFORCE_COMMAND_CODE_NEW_BALLOON = 5
};

enum pneuforce_answer_state {
    PNEUFORCE_ANSWER_STATE_IDLE = 0,
    PNEUFORCE_ANSWER_STATE_BUSY = 1,
    PNEUFORCE_ANSWER_STATE_DONE = 2,
    PNEUFORCE_ANSWER_STATE_FAILED = 3
};

enum pneuforce_method {
    PNEUFORCE_METHOD_ENERGETIC = 0,
    PNEUFORCE_METHOD_LULEVICH = 1,
    PNEUFORCE_METHOD_SHANAHAN = 2,
    PNEUFORCE_METHOD_ENERGETIC_CALIBRATED = 256,
    PNEUFORCE_METHOD_LULEVICH_CALIBRATED = 257,
    PNEUFORCE_METHOD_SHANAHAN_CALIBRATED = 258
};

enum pneuforce_fault {
    PNEUFORCE_FAULT_NONE = 0,
    PNEUFORCE_FAULT_SENSOR = 1,
    PNEUFORCE_FAULT_STUCK = 2,
    PNEUFORCE_FAULT_SUPPLY_VOLTAGE = 3,
    PNEUFORCE_FAULT_OVERPRESSURE = 4,
    PNEUFORCE_FAULT_BURST = 5,
    PNEUFORCE_FAULT_LIMIT_POINT = 6,
    PNEUFORCE_FAULT_NO_RISE = 7,
    PNEUFORCE_FAULT_INLET_OPEN = 8,
    PNEUFORCE_FAULT_VENT_SHUT = 9,
    PNEUFORCE_FAULT_OCCLUSION = 10,
    PNEUFORCE_FAULT_LEAK = 11,
    PNEUFORCE_FAULT_TIMEOUT = 12,
    PNEUFORCE_FAULT_HOST_SILENT = 13,
    PNEUFORCE_FAULT_WATCHDOG = 14,
    PNEUFORCE_FAULT_LEASE_EXPIRED = 32,
    PNEUFORCE_FAULT_BOARD_RESET = 33,
    PNEUFORCE_FAULT_LINK_LOST = 34,
    PNEUFORCE_FAULT_PRESSURE_LIMIT = 35,
    PNEUFORCE_FAULT_SENSOR_LIMIT = 36,
    PNEUFORCE_FAULT_SENSOR_STUCK = 37,
    PNEUFORCE_FAULT_DISAGREEMENT = 38,
    PNEUFORCE_FAULT_NOT_VENTED = 39,
    PNEUFORCE_FAULT_FORCE_LIMIT = 40,
    PNEUFORCE_FAULT_CAN_MASTER_LOST = 41
};

static inline uint32_t pneuforce_bits(const uint16_t *words, bool low_word_first)
{
    uint32_t first = words[0], second = words[1];
    return low_word_first ? second << 16 | first : first << 16 | second;
}

static inline bool pneuforce_float(const uint16_t *words, bool low_word_first, float *value)
{
    uint32_t bits = pneuforce_bits(words, low_word_first);
    bool valid = (bits & UINT32_C(0x7F800000)) != UINT32_C(0x7F800000); /* neither NaN nor infinity */
    if (!valid)
        bits = 0;
    memcpy(value, &bits, sizeof bits);
    return valid;
}

static inline bool pneuforce_int16(uint16_t word, int16_t *value)
{
    bool valid = word != UINT16_C(0x7FFF);
    if (!valid)
        word = 0;
    memcpy(value, &word, sizeof word);
    return valid;
}

static inline bool pneuforce_uint16(uint16_t word, uint16_t *value)
{
    bool valid = word != UINT16_C(0xFFFF);
    *value = valid ? word : UINT16_C(0);
    return valid;
}

/* 0: Contact force, positive when the balloon is pressed. [N] */
static inline bool pneuforce_force_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 0, low_word_first, value);
}

/* 2: Standard uncertainty of the force; without contact, the detection limit. [N] */
static inline bool pneuforce_force_uncertainty_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 2, low_word_first, value);
}

/* 4: Filtered gauge pressure. [kPa] */
static inline bool pneuforce_pressure_kpa(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 4, low_word_first, value);
}

/* 6: Inflated radius R_i before contact. [mm] */
static inline bool pneuforce_radius_mm(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 6, low_word_first, value);
}

/* 8: Setpoint in effect; not available while vented or tripped. [kPa] */
static inline bool pneuforce_setpoint_kpa(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 8, low_word_first, value);
}

/* 10: DP_i of the contact in progress, else the running baseline. [kPa] */
static inline bool pneuforce_initial_pressure_kpa(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 10, low_word_first, value);
}

/* 12: Rise DP_f - DP_i. [kPa] */
static inline bool pneuforce_rise_kpa(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 12, low_word_first, value);
}

/* 14: Indentation d. [mm] */
static inline bool pneuforce_indentation_mm(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 14, low_word_first, value);
}

/* 16: Radius a of the contact area. [mm] */
static inline bool pneuforce_contact_radius_mm(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 16, low_word_first, value);
}

/* 18: Peak force of the last finished contact. [N] */
static inline bool pneuforce_peak_force_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 18, low_word_first, value);
}

/* 20: Status bits; also the discrete inputs 0-31. */
static inline bool pneuforce_status(const uint16_t *from_0, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_0 + 20, low_word_first);
    return true;
}

/* 22: One per rig frame used; wraps. */
static inline bool pneuforce_sample_counter(const uint16_t *from_0, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_0 + 22, low_word_first);
    return true;
}

/* 24: Age of the sample, saturating. [ms] */
static inline bool pneuforce_sample_age_ms(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 24, sizeof *value);
    return true;
}

/* 25: State of the rig. */
static inline bool pneuforce_state(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 25, sizeof *value);
    return true;
}

/* 26: Contacts begun; wraps. */
static inline bool pneuforce_contact_counter(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 26, sizeof *value);
    return true;
}

/* 27: Why this peer's last write was refused, kept until its next accepted write. */
static inline bool pneuforce_refusal(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 27, sizeof *value);
    return true;
}

/* 28: Lower limit of the model's range at this DP_i: the force at a rise of 0.5 kPa. [N] */
static inline bool pneuforce_force_low_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 28, low_word_first, value);
}

/* 30: Force without delay compensation. [N] */
static inline bool pneuforce_force_uncompensated_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 30, low_word_first, value);
}

/* 32: Drift of the baseline. [kPa/s] */
static inline bool pneuforce_baseline_drift_kpa_per_s(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 32, low_word_first, value);
}

/* 34: Remaining delay of the force. [ms] */
static inline bool pneuforce_delay_ms(const uint16_t *from_0, uint16_t *value)
{
    return pneuforce_uint16(from_0[34], value);
}

/* 35: Age of the baseline. [s] */
static inline bool pneuforce_baseline_age_s(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 35, sizeof *value);
    return true;
}

/* 64: Contact force. [mN] */
static inline bool pneuforce_force_mn(const uint16_t *from_0, int16_t *value)
{
    return pneuforce_int16(from_0[64], value);
}

/* 65: Standard uncertainty of the force. [mN] */
static inline bool pneuforce_force_uncertainty_mn(const uint16_t *from_0, uint16_t *value)
{
    return pneuforce_uint16(from_0[65], value);
}

/* 66: Filtered gauge pressure. [Pa] */
static inline bool pneuforce_pressure_pa(const uint16_t *from_0, int16_t *value)
{
    return pneuforce_int16(from_0[66], value);
}

/* 67: Inflated radius R_i before contact. [um] */
static inline bool pneuforce_radius_um(const uint16_t *from_0, uint16_t *value)
{
    return pneuforce_uint16(from_0[67], value);
}

/* 68: Setpoint in effect. [Pa] */
static inline bool pneuforce_setpoint_pa(const uint16_t *from_0, int16_t *value)
{
    return pneuforce_int16(from_0[68], value);
}

/* 69: Rise DP_f - DP_i. [Pa] */
static inline bool pneuforce_rise_pa(const uint16_t *from_0, int16_t *value)
{
    return pneuforce_int16(from_0[69], value);
}

/* 70: Peak force of the last finished contact. [mN] */
static inline bool pneuforce_peak_force_mn(const uint16_t *from_0, int16_t *value)
{
    return pneuforce_int16(from_0[70], value);
}

/* 71: Condensed status. */
static inline bool pneuforce_condensed_status(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 71, sizeof *value);
    return true;
}

/* 72: Status bits 0-15. */
static inline bool pneuforce_status_low(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 72, sizeof *value);
    return true;
}

/* 73: Status bits 16-31. */
static inline bool pneuforce_status_high(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 73, sizeof *value);
    return true;
}

/* 512: Inflation pressure requested. [kPa] */
static inline bool pneuforce_setpoint_requested_kpa(const uint16_t *from_512, bool low_word_first, float *value)
{
    return pneuforce_float(from_512 + 0, low_word_first, value);
}

/* 514: Force alarm limit (status bit 6). [N] */
static inline bool pneuforce_force_limit_n(const uint16_t *from_512, bool low_word_first, float *value)
{
    return pneuforce_float(from_512 + 2, low_word_first, value);
}

/* 516: 0 vents, always accepted; 1 inflates to the setpoint, then locks. */
static inline bool pneuforce_mode(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 4, sizeof *value);
    return true;
}

/* 517: Lease: 0 none; else the writer must write again within this time. [ms] */
static inline bool pneuforce_lease_ms(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 5, sizeof *value);
    return true;
}

/* 518: Pressure around the balloon above ambient (insufflation); in the vented state only. [kPa] */
static inline bool pneuforce_reference_pressure_kpa(const uint16_t *from_512, bool low_word_first, float *value)
{
    return pneuforce_float(from_512 + 6, low_word_first, value);
}

/* 520: Command: key 5046h. */
static inline bool pneuforce_command_key(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 8, sizeof *value);
    return true;
}

/* 521: Command: what to do. */
static inline bool pneuforce_command_code(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 9, sizeof *value);
    return true;
}

/* 522: Command: argument. */
static inline bool pneuforce_command_argument(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 10, sizeof *value);
    return true;
}

/* 523: Command: runs when this is written with a new value; the same value repeats the answer. */
static inline bool pneuforce_command_sequence(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 11, sizeof *value);
    return true;
}

/* 524: Answer: sequence echoed. */
static inline bool pneuforce_answer_sequence(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 12, sizeof *value);
    return true;
}

/* 525: Answer: state. */
static inline bool pneuforce_answer_state(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 13, sizeof *value);
    return true;
}

/* 526: Answer: 0 ok, else a refusal code. */
static inline bool pneuforce_answer_result(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 14, sizeof *value);
    return true;
}

/* 528: Lease time left. [ms] */
static inline bool pneuforce_lease_left_ms(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 16, sizeof *value);
    return true;
}

/* 529: Lease holder. */
static inline bool pneuforce_lease_holder(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 17, sizeof *value);
    return true;
}

/* 544: Inflation pressure requested, for masters that write single registers. [Pa] */
static inline bool pneuforce_setpoint_requested_pa(const uint16_t *from_512, uint16_t *value)
{
    return pneuforce_uint16(from_512[32], value);
}

/* 545: Force alarm limit, for masters that write single registers. [mN] */
static inline bool pneuforce_force_limit_mn(const uint16_t *from_512, uint16_t *value)
{
    return pneuforce_uint16(from_512[33], value);
}

/* 768: Version of this map. */
static inline bool pneuforce_map_version(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 0, sizeof *value);
    return true;
}

/* 769: Force model; +256 with a force calibration. */
static inline bool pneuforce_method(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 1, sizeof *value);
    return true;
}

/* 770: Hash of this map. */
static inline bool pneuforce_map_hash(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 2, low_word_first);
    return true;
}

/* 772: Hash of configuration and calibration. */
static inline bool pneuforce_configuration_hash(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 4, low_word_first);
    return true;
}

/* 774: Serial number. */
static inline bool pneuforce_serial_number(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 6, low_word_first);
    return true;
}

/* 776: Calibration date yyyymmdd, 0 where uncalibrated. */
static inline bool pneuforce_calibration_date(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 8, low_word_first);
    return true;
}

/* 778: Code of the fault that came first, 0 where there is none. */
static inline bool pneuforce_first_fault(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 10, sizeof *value);
    return true;
}

/* 779: Number of active faults. */
static inline bool pneuforce_active_faults(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 11, sizeof *value);
    return true;
}

/* 780: Balloon id: the configuration's, or the argument of command 5 since the host started. */
static inline bool pneuforce_balloon_id(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 12, low_word_first);
    return true;
}

/* 782: Inflations since the balloon was fitted, or since the host started. */
static inline bool pneuforce_inflations(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 14, low_word_first);
    return true;
}

/* 3840: Test pattern -123.45. */
static inline bool pneuforce_test_float(const uint16_t *from_3840, bool low_word_first, float *value)
{
    return pneuforce_float(from_3840 + 0, low_word_first, value);
}

/* 3842: Test pattern 12345678h. */
static inline bool pneuforce_test_long(const uint16_t *from_3840, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_3840 + 2, low_word_first);
    return true;
}

/* 3844: Test pattern -12345. */
static inline bool pneuforce_test_int(const uint16_t *from_3840, int16_t *value)
{
    memcpy(value, from_3840 + 4, sizeof *value);
    return true;
}

/* Settles the word order from 5 words from 3840 on; false: no pneuforce's. */
static inline bool pneuforce_word_order(const uint16_t *test, bool *low_word_first)
{
    *low_word_first = test[0] == UINT16_C(0xE666);
    return pneuforce_bits(test + 0, *low_word_first) == UINT32_C(0xC2F6E666)
        && pneuforce_bits(test + 2, *low_word_first) == UINT32_C(0x12345678)
        && test[4] == UINT16_C(0xCFC7);
}

#endif
