/* pneuforce: register map for programs in C99 and C++11.
 * Map version 1, hash 258D439Ch (registers 768 and 770).
 * Generated from the register map: pneuforce map --format h. Instructions: docs/plc.md.
 *
 * Each function takes the words of one block, read from the first address of the block. The words have the
 * byte order of this machine, as libmodbus delivers them. The function stores the value and returns true if
 * the value is valid. If the value is not available, the function stores 0 and returns false. Check the
 * sample counter as well: if the counter does not change, the words are old.
 */
#ifndef PNEUFORCE_REGISTERS_H
#define PNEUFORCE_REGISTERS_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define PNEUFORCE_MAP_VERSION 1
#define PNEUFORCE_MAP_HASH UINT32_C(0x258D439C)
#define PNEUFORCE_COMMAND_KEY 20550
#define PNEUFORCE_COUNT_MEASURED 36 /* words from address 0; the values of one read belong to one instant */
#define PNEUFORCE_COUNT_TEST 5
#define PNEUFORCE_ADDRESS_FORCE 0
#define PNEUFORCE_ADDRESS_FORCE_UNCERTAINTY 2
#define PNEUFORCE_ADDRESS_PRESSURE 4
#define PNEUFORCE_ADDRESS_RADIUS 6
#define PNEUFORCE_ADDRESS_SETPOINT 8
#define PNEUFORCE_ADDRESS_BASELINE_PRESSURE 10
#define PNEUFORCE_ADDRESS_RISE 12
#define PNEUFORCE_ADDRESS_INDENTATION 14
#define PNEUFORCE_ADDRESS_CONTACT_RADIUS 16
#define PNEUFORCE_ADDRESS_PEAK_FORCE 18
#define PNEUFORCE_ADDRESS_STATUS 20
#define PNEUFORCE_ADDRESS_SAMPLE_COUNTER 22
#define PNEUFORCE_ADDRESS_SAMPLE_AGE 24
#define PNEUFORCE_ADDRESS_STATE 25
#define PNEUFORCE_ADDRESS_CONTACT_COUNTER 26
#define PNEUFORCE_ADDRESS_REJECT_REASON 27
#define PNEUFORCE_ADDRESS_FORCE_LOWER_RANGE_LIMIT 28
#define PNEUFORCE_ADDRESS_FORCE_UNCOMPENSATED 30
#define PNEUFORCE_ADDRESS_BASELINE_DRIFT 32
#define PNEUFORCE_ADDRESS_DELAY 34
#define PNEUFORCE_ADDRESS_BASELINE_AGE 35
#define PNEUFORCE_ADDRESS_PROOF_TEST_AGE 36
#define PNEUFORCE_ADDRESS_PEAK_COUNTER 37
#define PNEUFORCE_ADDRESS_FORCE_MAXIMUM 38
#define PNEUFORCE_ADDRESS_FORCE_MINIMUM 40
#define PNEUFORCE_ADDRESS_SAMPLE_TIME 42
#define PNEUFORCE_ADDRESS_SAMPLE_UTC 44
#define PNEUFORCE_ADDRESS_SAMPLE_UTC_FRACTION 46
#define PNEUFORCE_ADDRESS_AMBIENT_SOURCE 47
#define PNEUFORCE_ADDRESS_AMBIENT_IN_EFFECT 48
#define PNEUFORCE_ADDRESS_AMBIENT_AGE 50
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
#define PNEUFORCE_ADDRESS_MAINTENANCE_CAUSES 74
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
#define PNEUFORCE_ADDRESS_PROOF_TEST 546
#define PNEUFORCE_ADDRESS_REFERENCE_PRESSURE_PA 547
#define PNEUFORCE_ADDRESS_FORCE_LIMIT_2 548
#define PNEUFORCE_ADDRESS_ALARM_HYSTERESIS 550
#define PNEUFORCE_ADDRESS_ALARM_DELAY 552
#define PNEUFORCE_ADDRESS_FORCE_LIMIT_2_MN 553
#define PNEUFORCE_ADDRESS_ALARM_HYSTERESIS_MN 554
#define PNEUFORCE_ADDRESS_AMBIENT_PRESSURE 556
#define PNEUFORCE_ADDRESS_MAP_VERSION 768
#define PNEUFORCE_ADDRESS_METHOD 769
#define PNEUFORCE_ADDRESS_MAP_HASH 770
#define PNEUFORCE_ADDRESS_CONFIGURATION_HASH 772
#define PNEUFORCE_ADDRESS_SERIAL_NUMBER 774
#define PNEUFORCE_ADDRESS_CALIBRATION_DATE 776
#define PNEUFORCE_ADDRESS_FIRST_OUT_FAULT 778
#define PNEUFORCE_ADDRESS_ACTIVE_FAULT_COUNT 779
#define PNEUFORCE_ADDRESS_BALLOON_ID 780
#define PNEUFORCE_ADDRESS_INFLATION_COUNT 782
#define PNEUFORCE_ADDRESS_EVENT_LOG_RECORDS 784
#define PNEUFORCE_ADDRESS_EVENT_LOG_DIGEST_1 786
#define PNEUFORCE_ADDRESS_EVENT_LOG_DIGEST_2 788
#define PNEUFORCE_ADDRESS_LATCHED_FAULTS_1 790
#define PNEUFORCE_ADDRESS_LATCHED_FAULTS_2 792
#define PNEUFORCE_ADDRESS_FIRMWARE_VERSION 794
#define PNEUFORCE_ADDRESS_FIRMWARE_ORIGIN 795
#define PNEUFORCE_ADDRESS_FIRMWARE_IMAGE 796
#define PNEUFORCE_ADDRESS_CONFIGURATION_SIGNATURE 798
#define PNEUFORCE_ADDRESS_CALIBRATION_SIGNATURE 799
#define PNEUFORCE_ADDRESS_TEST_FLOAT 3840
#define PNEUFORCE_ADDRESS_TEST_LONG 3842
#define PNEUFORCE_ADDRESS_TEST_INT 3844
#define PNEUFORCE_MIN_SETPOINT_REQUESTED 2.0f /* kPa */
#define PNEUFORCE_MAX_SETPOINT_REQUESTED 12.0f /* kPa */
#define PNEUFORCE_MIN_FORCE_LIMIT 0.1f /* N */
#define PNEUFORCE_MAX_FORCE_LIMIT 20.0f /* N */
#define PNEUFORCE_MIN_LEASE 200 /* ms */
#define PNEUFORCE_MAX_LEASE 60000 /* ms */
#define PNEUFORCE_MIN_REFERENCE_PRESSURE -1.0f /* kPa */
#define PNEUFORCE_MAX_REFERENCE_PRESSURE 3.0f /* kPa */
#define PNEUFORCE_MIN_SETPOINT_REQUESTED_PA 2000 /* Pa */
#define PNEUFORCE_MAX_SETPOINT_REQUESTED_PA 12000 /* Pa */
#define PNEUFORCE_MIN_FORCE_LIMIT_MN 100 /* mN */
#define PNEUFORCE_MAX_FORCE_LIMIT_MN 20000 /* mN */
#define PNEUFORCE_MIN_REFERENCE_PRESSURE_PA -1000 /* Pa */
#define PNEUFORCE_MAX_REFERENCE_PRESSURE_PA 3000 /* Pa */
#define PNEUFORCE_MIN_FORCE_LIMIT_2 0.1f /* N */
#define PNEUFORCE_MAX_FORCE_LIMIT_2 20.0f /* N */
#define PNEUFORCE_MIN_ALARM_HYSTERESIS 0.0f /* N */
#define PNEUFORCE_MAX_ALARM_HYSTERESIS 10.0f /* N */
#define PNEUFORCE_MIN_ALARM_DELAY 0 /* ms */
#define PNEUFORCE_MAX_ALARM_DELAY 10000 /* ms */
#define PNEUFORCE_MIN_FORCE_LIMIT_2_MN 100 /* mN */
#define PNEUFORCE_MAX_FORCE_LIMIT_2_MN 20000 /* mN */
#define PNEUFORCE_MIN_ALARM_HYSTERESIS_MN 0 /* mN */
#define PNEUFORCE_MAX_ALARM_HYSTERESIS_MN 10000 /* mN */
#define PNEUFORCE_MIN_AMBIENT_PRESSURE 60.0f /* kPa */
#define PNEUFORCE_MAX_AMBIENT_PRESSURE 110.0f /* kPa */
#define PNEUFORCE_STATUS_IN_CONTACT UINT32_C(0x00000001) /* An object presses on the balloon. */
#define PNEUFORCE_STATUS_INFLATING UINT32_C(0x00000002) /* The balloon is being inflated, or the pressure is settling. */
#define PNEUFORCE_STATUS_HOLDING UINT32_C(0x00000004) /* The setpoint was reached, and both valves are closed. */
#define PNEUFORCE_STATUS_VENTED UINT32_C(0x00000008) /* The vent is verified: for 0.5 s, no valve has had current and the pressure was -0.3 to 0.3 kPa. Without a zero: the board reports vented. Never set with stale, link_lost or vent_fault. After a blocked tube (maintenance cause tube_unproven), it does not prove an empty balloon. */
#define PNEUFORCE_STATUS_INTERPOLATED UINT32_C(0x00000010) /* The pressure rise is below 0.5 kPa (method membrane: 0.1 kPa): the force is only approximate. */
#define PNEUFORCE_STATUS_OUT_OF_RANGE UINT32_C(0x00000020) /* DP_i is outside 4.95-11.45 kPa, the balloon may be pressed flat, the model has no solution, or the calibrated force is not plausible: no force is available. */
#define PNEUFORCE_STATUS_FORCE_HIGH_ALARM UINT32_C(0x00000040) /* The force is above the force limit (register 514), or the balloon may be pressed flat. */
#define PNEUFORCE_STATUS_SETPOINT_NOT_REACHED UINT32_C(0x00000080) /* The setpoint was not reached in time. */
#define PNEUFORCE_STATUS_STALE UINT32_C(0x00000100) /* The last sample is older than 100 ms: measured values are not available. */
#define PNEUFORCE_STATUS_LINK_LOST UINT32_C(0x00000200) /* No frame has arrived from the rig for more than 250 ms. */
#define PNEUFORCE_STATUS_SENSOR_FAULT UINT32_C(0x00000400) /* The pressure sensor is open or shorted, or its signal is frozen. */
#define PNEUFORCE_STATUS_OVERPRESSURE UINT32_C(0x00000800) /* The pressure exceeded a limit. */
#define PNEUFORCE_STATUS_LEAK UINT32_C(0x00001000) /* The pressure falls steadily without contact. */
#define PNEUFORCE_STATUS_BURST UINT32_C(0x00002000) /* The balloon has burst, or is past its limit point. */
#define PNEUFORCE_STATUS_LEASE_EXPIRED UINT32_C(0x00004000) /* A lease expired. */
#define PNEUFORCE_STATUS_SIMULATED UINT32_C(0x00008000) /* The values come from a simulation or a replay, not from a real rig. */
#define PNEUFORCE_STATUS_NOT_ZEROED UINT32_C(0x00010000) /* The pressure sensor has no zero adjustment since the start or since the board was replaced: an inflation is rejected. */
#define PNEUFORCE_STATUS_WRITE_PROTECT UINT32_C(0x00020000) /* The configuration rejects each write except a vent, on every bus and on the web page. */
#define PNEUFORCE_STATUS_BOARD_WATCHDOG UINT32_C(0x00040000) /* The watchdog or a brown-out restarted the board. */
#define PNEUFORCE_STATUS_CAN_DOWN UINT32_C(0x00080000) /* The CAN interface does not work. Also in the first 1.2 s after a start, until the node sends. */
#define PNEUFORCE_STATUS_INLET_FAULT UINT32_C(0x00100000) /* The inlet valve is stuck, or there is no gas supply. */
#define PNEUFORCE_STATUS_VENT_FAULT UINT32_C(0x00200000) /* The vent valve is stuck, or the tube is blocked: the balloon may be inflated. */
#define PNEUFORCE_STATUS_BOARD_RESET UINT32_C(0x00400000) /* The board restarted. */
#define PNEUFORCE_STATUS_BASELINE_OLD UINT32_C(0x00800000) /* The baseline pressure is older than 60 s, drifts, or is unknown. */
#define PNEUFORCE_STATUS_MAINTENANCE_REQUIRED UINT32_C(0x01000000) /* Maintenance required (NAMUR NE 107): check the instrument soon. */
#define PNEUFORCE_STATUS_OUT_OF_SPECIFICATION UINT32_C(0x02000000) /* Out of specification (NAMUR NE 107): the same condition as out_of_range. */
#define PNEUFORCE_STATUS_FUNCTION_CHECK UINT32_C(0x04000000) /* Function check (NAMUR NE 107): vented, inflating, settling, or a proof test is in progress. */
#define PNEUFORCE_STATUS_FAILURE UINT32_C(0x08000000) /* Failure (NAMUR NE 107): a fault is latched, or the last sample is stale. */
#define PNEUFORCE_STATUS_CALIBRATED UINT32_C(0x10000000) /* The force is corrected by a force calibration. */
#define PNEUFORCE_STATUS_PROOF_TEST_OVERDUE UINT32_C(0x20000000) /* No proof test has passed for ten periods, or proof tests are disabled. */
#define PNEUFORCE_STATUS_FORCE_HIGH_ALARM_2 UINT32_C(0x40000000) /* The force is above the second force limit, or the balloon may be pressed flat; with hysteresis and delay. */
#define PNEUFORCE_STATUS_ANY_FAILURE UINT32_C(0x80000000) /* Copy of bit 27, for masters that test the sign of the status. */
#define PNEUFORCE_MAINTENANCE_LEAK UINT16_C(0x0001) /* The pressure of the locked balloon fell slowly and steadily. */
#define PNEUFORCE_MAINTENANCE_CAN_DOWN UINT16_C(0x0002) /* The CAN interface does not work. */
#define PNEUFORCE_MAINTENANCE_CLOCK_INACCURATE UINT16_C(0x0004) /* The clock of the board is more than 1 % fast or slow. */
#define PNEUFORCE_MAINTENANCE_EVENT_LOG_FAILED UINT16_C(0x0008) /* The event log cannot be written. */
#define PNEUFORCE_MAINTENANCE_RECORDING_FAILED UINT16_C(0x0010) /* A recording has stopped because of an error. */
#define PNEUFORCE_MAINTENANCE_CERTIFICATE_EXPIRING UINT16_C(0x0020) /* A certificate has expired or expires in less than 30 days, or the list of revoked certificates has ended or ends soon. */
#define PNEUFORCE_MAINTENANCE_AMBIENT_MISSING UINT16_C(0x0040) /* The configuration requires a measured ambient pressure, and none was written recently. */
#define PNEUFORCE_MAINTENANCE_FIRMWARE_UNKNOWN UINT16_C(0x0080) /* The firmware of the board is not a released image. */
#define PNEUFORCE_MAINTENANCE_TUBE_UNPROVEN UINT16_C(0x0100) /* The tube was blocked, and no proof test has passed since: the balloon may be inflated although the sensor reads 0 kPa. */

enum pneuforce_state {
    PNEUFORCE_STATE_BOOT = 0,
    PNEUFORCE_STATE_VENTED = 1,
    PNEUFORCE_STATE_INFLATING = 2,
    PNEUFORCE_STATE_SETTLING = 3,
    PNEUFORCE_STATE_HOLDING = 4,
    PNEUFORCE_STATE_VENTING = 5,
    PNEUFORCE_STATE_TRIPPED = 6
};

enum pneuforce_reject_reason {
    PNEUFORCE_REJECT_REASON_NONE = 0,
    PNEUFORCE_REJECT_REASON_STATE = 1,
    PNEUFORCE_REJECT_REASON_FAULT_LATCHED = 2,
    PNEUFORCE_REJECT_REASON_LEASE = 3,
    PNEUFORCE_REJECT_REASON_WRITE_PROTECT = 4,
    PNEUFORCE_REJECT_REASON_CAUSE_PERSISTS = 5,
    PNEUFORCE_REJECT_REASON_LINK_LOST = 6,
    PNEUFORCE_REJECT_REASON_NOT_ZEROED = 7,
    PNEUFORCE_REJECT_REASON_IN_CONTACT = 8,
    PNEUFORCE_REJECT_REASON_IMPLAUSIBLE = 9,
    PNEUFORCE_REJECT_REASON_UNKNOWN_FIRMWARE = 10
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
    PNEUFORCE_LEASE_HOLDER_WEB = 4,
    PNEUFORCE_LEASE_HOLDER_MODBUS_TLS = 5
};

enum pneuforce_command_code {
    PNEUFORCE_COMMAND_CODE_NONE = 0,
    PNEUFORCE_COMMAND_CODE_ZERO_PRESSURE = 1,
    PNEUFORCE_COMMAND_CODE_CLEAR_FAULTS = 2,
    PNEUFORCE_COMMAND_CODE_SELF_TEST = 3,
    PNEUFORCE_COMMAND_CODE_RESTORE_ZERO = 4,
    PNEUFORCE_COMMAND_CODE_NEW_BALLOON = 5,
    PNEUFORCE_COMMAND_CODE_RESET_FORCE_EXTREMES = 6
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
    PNEUFORCE_METHOD_MEMBRANE = 3,
    PNEUFORCE_METHOD_ENERGETIC_CALIBRATED = 256,
    PNEUFORCE_METHOD_LULEVICH_CALIBRATED = 257,
    PNEUFORCE_METHOD_SHANAHAN_CALIBRATED = 258,
    PNEUFORCE_METHOD_MEMBRANE_CALIBRATED = 259
};

enum pneuforce_fault {
    PNEUFORCE_FAULT_NONE = 0,
    PNEUFORCE_FAULT_SENSOR = 1,
    PNEUFORCE_FAULT_SENSOR_FROZEN = 2,
    PNEUFORCE_FAULT_SUPPLY_VOLTAGE = 3,
    PNEUFORCE_FAULT_OVERPRESSURE = 4,
    PNEUFORCE_FAULT_BURST = 5,
    PNEUFORCE_FAULT_LIMIT_POINT = 6,
    PNEUFORCE_FAULT_NO_RISE = 7,
    PNEUFORCE_FAULT_INLET_OPEN = 8,
    PNEUFORCE_FAULT_VENT_SHUT = 9,
    PNEUFORCE_FAULT_OCCLUSION = 10,
    PNEUFORCE_FAULT_LEAK = 11,
    PNEUFORCE_FAULT_SETPOINT_TIMEOUT = 12,
    PNEUFORCE_FAULT_HOST_SILENT = 13,
    PNEUFORCE_FAULT_WATCHDOG = 14,
    PNEUFORCE_FAULT_LEASE_EXPIRED = 32,
    PNEUFORCE_FAULT_BOARD_RESET = 33,
    PNEUFORCE_FAULT_LINK_LOST = 34,
    PNEUFORCE_FAULT_PRESSURE_LIMIT = 35,
    PNEUFORCE_FAULT_SENSOR_LIMIT = 36,
    PNEUFORCE_FAULT_BOARD_UNRESPONSIVE = 37,
    PNEUFORCE_FAULT_DISAGREEMENT = 38,
    PNEUFORCE_FAULT_NOT_VENTED = 39,
    PNEUFORCE_FAULT_FORCE_LIMIT = 40,
    PNEUFORCE_FAULT_CAN_MASTER_LOST = 41
};

enum pneuforce_proof_test {
    PNEUFORCE_PROOF_TEST_ALLOWED = 0,
    PNEUFORCE_PROOF_TEST_FORBIDDEN = 1
};

enum pneuforce_ambient_source {
    PNEUFORCE_AMBIENT_SOURCE_CONFIGURED = 0,
    PNEUFORCE_AMBIENT_SOURCE_MEASURED = 1
};

enum pneuforce_firmware_origin {
    PNEUFORCE_FIRMWARE_ORIGIN_NOT_REPORTED = 0,
    PNEUFORCE_FIRMWARE_ORIGIN_CURRENT = 1,
    PNEUFORCE_FIRMWARE_ORIGIN_OTHER_VERSION = 2,
    PNEUFORCE_FIRMWARE_ORIGIN_UNKNOWN = 3
};

enum pneuforce_signature {
    PNEUFORCE_SIGNATURE_UNSIGNED = 0,
    PNEUFORCE_SIGNATURE_SIGNED = 1,
    PNEUFORCE_SIGNATURE_ALTERED = 2,
    PNEUFORCE_SIGNATURE_UNKNOWN_KEY = 3,
    PNEUFORCE_SIGNATURE_NO_FILE = 4
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

/* 0: Contact force; positive when an object presses on the balloon. [N] */
static inline bool pneuforce_force_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 0, low_word_first, value);
}

/* 2: Standard uncertainty of the force. Without contact: the detection limit. [N] */
static inline bool pneuforce_force_uncertainty_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 2, low_word_first, value);
}

/* 4: Filtered gauge pressure. [kPa] */
static inline bool pneuforce_pressure_kpa(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 4, low_word_first, value);
}

/* 6: Radius R_i of the inflated balloon before contact. [mm] */
static inline bool pneuforce_radius_mm(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 6, low_word_first, value);
}

/* 8: Setpoint in effect; not available while the rig is vented or tripped, or without samples. [kPa] */
static inline bool pneuforce_setpoint_kpa(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 8, low_word_first, value);
}

/* 10: Baseline pressure DP_i. During a contact: the value at the start of the contact. [kPa] */
static inline bool pneuforce_baseline_pressure_kpa(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 10, low_word_first, value);
}

/* 12: Pressure rise DP_f - DP_i. [kPa] */
static inline bool pneuforce_rise_kpa(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 12, low_word_first, value);
}

/* 14: Indentation depth d. [mm] */
static inline bool pneuforce_indentation_mm(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 14, low_word_first, value);
}

/* 16: Radius a of the contact area. [mm] */
static inline bool pneuforce_contact_radius_mm(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 16, low_word_first, value);
}

/* 18: Force of the last completed peak. [N] */
static inline bool pneuforce_peak_force_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 18, low_word_first, value);
}

/* 20: Status bits. The discrete inputs 0-31 are the same bits. */
static inline bool pneuforce_status(const uint16_t *from_0, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_0 + 20, low_word_first);
    return true;
}

/* 22: Number of evaluated samples. Wraps to 0. */
static inline bool pneuforce_sample_counter(const uint16_t *from_0, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_0 + 22, low_word_first);
    return true;
}

/* 24: Age of the last sample. 65535 means 65.535 s or more. [ms] */
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

/* 26: Number of contacts that have started. Wraps to 0. */
static inline bool pneuforce_contact_counter(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 26, sizeof *value);
    return true;
}

/* 27: Reason why the last valid write of this peer was rejected; 0 if the write was accepted. An invalid write (exceptions 01-03) does not change the reason. */
static inline bool pneuforce_reject_reason(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 27, sizeof *value);
    return true;
}

/* 28: Lower limit of the model's range at this DP_i: the force at a rise of 0.5 kPa (method membrane: 0.1 kPa). [N] */
static inline bool pneuforce_force_lower_range_limit_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 28, low_word_first, value);
}

/* 30: Force without compensation of the delay. [N] */
static inline bool pneuforce_force_uncompensated_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 30, low_word_first, value);
}

/* 32: Drift of the baseline pressure. [kPa/s] */
static inline bool pneuforce_baseline_drift_kpa_per_s(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 32, low_word_first, value);
}

/* 34: Remaining delay of the force after the compensation. [ms] */
static inline bool pneuforce_delay_ms(const uint16_t *from_0, uint16_t *value)
{
    return pneuforce_uint16(from_0[34], value);
}

/* 35: Age of the baseline pressure; not available before the first baseline. [s] */
static inline bool pneuforce_baseline_age_s(const uint16_t *from_0, uint16_t *value)
{
    return pneuforce_uint16(from_0[35], value);
}

/* 36: Time since a proof test passed, or since a new setpoint. [s] */
static inline bool pneuforce_proof_test_age_s(const uint16_t *from_0, uint16_t *value)
{
    return pneuforce_uint16(from_0[36], value);
}

/* 37: Number of completed peaks of the force. Wraps to 0. */
static inline bool pneuforce_peak_counter(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 37, sizeof *value);
    return true;
}

/* 38: Largest valid force of all samples since command 6 or since the start of the host process. [N] */
static inline bool pneuforce_force_maximum_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 38, low_word_first, value);
}

/* 40: Smallest valid force of all samples since command 6 or since the start of the host process. It is 0 N after a sample without contact. [N] */
static inline bool pneuforce_force_minimum_n(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 40, low_word_first, value);
}

/* 42: Time in ms at which the board took the last sample, on the monotonic clock of the host. Wraps to 0 after 49.7 days. */
static inline bool pneuforce_sample_time(const uint16_t *from_0, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_0 + 42, low_word_first);
    return true;
}

/* 44: The same time as UTC, in seconds since 1970-01-01; 0 if unknown. The clock may be wrong or jump. */
static inline bool pneuforce_sample_utc(const uint16_t *from_0, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_0 + 44, low_word_first);
    return true;
}

/* 46: Milliseconds of the time in register 44, 0 to 999. */
static inline bool pneuforce_sample_utc_fraction(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 46, sizeof *value);
    return true;
}

/* 47: Source of the ambient pressure in effect: the configuration, or register 556. */
static inline bool pneuforce_ambient_source(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 47, sizeof *value);
    return true;
}

/* 48: Absolute ambient pressure P_0 in effect. A contact does not change it. [kPa] */
static inline bool pneuforce_ambient_in_effect_kpa(const uint16_t *from_0, bool low_word_first, float *value)
{
    return pneuforce_float(from_0 + 48, low_word_first, value);
}

/* 50: Time since the last accepted write of register 556. [s] */
static inline bool pneuforce_ambient_age_s(const uint16_t *from_0, uint16_t *value)
{
    return pneuforce_uint16(from_0[50], value);
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

/* 67: Radius R_i of the inflated balloon before contact. [um] */
static inline bool pneuforce_radius_um(const uint16_t *from_0, uint16_t *value)
{
    return pneuforce_uint16(from_0[67], value);
}

/* 68: Setpoint in effect. [Pa] */
static inline bool pneuforce_setpoint_pa(const uint16_t *from_0, int16_t *value)
{
    return pneuforce_int16(from_0[68], value);
}

/* 69: Pressure rise DP_f - DP_i. [Pa] */
static inline bool pneuforce_rise_pa(const uint16_t *from_0, int16_t *value)
{
    return pneuforce_int16(from_0[69], value);
}

/* 70: Force of the last completed peak. [mN] */
static inline bool pneuforce_peak_force_mn(const uint16_t *from_0, int16_t *value)
{
    return pneuforce_int16(from_0[70], value);
}

/* 71: Condensed status bits. */
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

/* 74: Causes of status bit 24 (maintenance_required). */
static inline bool pneuforce_maintenance_causes(const uint16_t *from_0, uint16_t *value)
{
    memcpy(value, from_0 + 74, sizeof *value);
    return true;
}

/* 512: Requested setpoint. [kPa] */
static inline bool pneuforce_setpoint_requested_kpa(const uint16_t *from_512, bool low_word_first, float *value)
{
    return pneuforce_float(from_512 + 0, low_word_first, value);
}

/* 514: Force alarm limit (status bit 6). A balloon that may be pressed flat exceeds each limit. [N] */
static inline bool pneuforce_force_limit_n(const uint16_t *from_512, bool low_word_first, float *value)
{
    return pneuforce_float(from_512 + 2, low_word_first, value);
}

/* 516: 0: vent, always accepted. 1: inflate to the setpoint, then close both valves. */
static inline bool pneuforce_mode(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 4, sizeof *value);
    return true;
}

/* 517: Lease time; 0: no lease. The holder must write again within this time. [ms] */
static inline bool pneuforce_lease_ms(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 5, sizeof *value);
    return true;
}

/* 518: Gauge pressure around the balloon (insufflation). Writable only while vented; with reference_timeout_s in the configuration, at any time. [kPa] */
static inline bool pneuforce_reference_pressure_kpa(const uint16_t *from_512, bool low_word_first, float *value)
{
    return pneuforce_float(from_512 + 6, low_word_first, value);
}

/* 520: Key of the command: always 5046h. */
static inline bool pneuforce_command_key(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 8, sizeof *value);
    return true;
}

/* 521: Code of the command. */
static inline bool pneuforce_command_code(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 9, sizeof *value);
    return true;
}

/* 522: Argument of the command. */
static inline bool pneuforce_command_argument(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 10, sizeof *value);
    return true;
}

/* 523: Sequence number. A new value starts the command; the same value repeats the answer. */
static inline bool pneuforce_command_sequence(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 11, sizeof *value);
    return true;
}

/* 524: Answer: sequence number of the command. */
static inline bool pneuforce_answer_sequence(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 12, sizeof *value);
    return true;
}

/* 525: Answer: state of the command. */
static inline bool pneuforce_answer_state(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 13, sizeof *value);
    return true;
}

/* 526: Answer: 0 if successful, otherwise a reject reason. */
static inline bool pneuforce_answer_result(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 14, sizeof *value);
    return true;
}

/* 528: Remaining lease time. [ms] */
static inline bool pneuforce_lease_left_ms(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 16, sizeof *value);
    return true;
}

/* 529: Bus of the lease holder. */
static inline bool pneuforce_lease_holder(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 17, sizeof *value);
    return true;
}

/* 544: Requested setpoint, for masters that can write only single registers. [Pa] */
static inline bool pneuforce_setpoint_requested_pa(const uint16_t *from_512, uint16_t *value)
{
    return pneuforce_uint16(from_512[32], value);
}

/* 545: Force alarm limit, for masters that can write only single registers. [mN] */
static inline bool pneuforce_force_limit_mn(const uint16_t *from_512, uint16_t *value)
{
    return pneuforce_uint16(from_512[33], value);
}

/* 546: Proof tests. 0: allowed. 1: forbidden, for example during a movement of the robot. */
static inline bool pneuforce_proof_test(const uint16_t *from_512, uint16_t *value)
{
    memcpy(value, from_512 + 34, sizeof *value);
    return true;
}

/* 547: Gauge pressure around the balloon, for masters that can write only single registers. [Pa] */
static inline bool pneuforce_reference_pressure_pa(const uint16_t *from_512, int16_t *value)
{
    return pneuforce_int16(from_512[35], value);
}

/* 548: Second force alarm limit (bit 30). A balloon that may be pressed flat exceeds each limit. [N] */
static inline bool pneuforce_force_limit_2_n(const uint16_t *from_512, bool low_word_first, float *value)
{
    return pneuforce_float(from_512 + 36, low_word_first, value);
}

/* 550: Hysteresis of the second force alarm: the alarm ends at the limit minus this force. [N] */
static inline bool pneuforce_alarm_hysteresis_n(const uint16_t *from_512, bool low_word_first, float *value)
{
    return pneuforce_float(from_512 + 38, low_word_first, value);
}

/* 552: Delay of the second force alarm: time for which the force must be above the limit. [ms] */
static inline bool pneuforce_alarm_delay_ms(const uint16_t *from_512, uint16_t *value)
{
    return pneuforce_uint16(from_512[40], value);
}

/* 553: Second force alarm limit, for masters that can write only single registers. [mN] */
static inline bool pneuforce_force_limit_2_mn(const uint16_t *from_512, uint16_t *value)
{
    return pneuforce_uint16(from_512[41], value);
}

/* 554: Hysteresis of the second force alarm, for masters that can write only single registers. [mN] */
static inline bool pneuforce_alarm_hysteresis_mn(const uint16_t *from_512, uint16_t *value)
{
    return pneuforce_uint16(from_512[42], value);
}

/* 556: Measured absolute ambient pressure P_0. Used from the next contact on, until ambient_timeout_s after its last write. [kPa] */
static inline bool pneuforce_ambient_pressure_kpa(const uint16_t *from_512, bool low_word_first, float *value)
{
    return pneuforce_float(from_512 + 44, low_word_first, value);
}

/* 768: Version of this register map. */
static inline bool pneuforce_map_version(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 0, sizeof *value);
    return true;
}

/* 769: Code of the force model, plus 256 if a force calibration is applied. */
static inline bool pneuforce_method(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 1, sizeof *value);
    return true;
}

/* 770: Hash of all declarations: registers, CAN frames and CANopen objects. */
static inline bool pneuforce_map_hash(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 2, low_word_first);
    return true;
}

/* 772: Hash of the configuration and the calibration. */
static inline bool pneuforce_configuration_hash(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 4, low_word_first);
    return true;
}

/* 774: Serial number of the instrument. */
static inline bool pneuforce_serial_number(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 6, low_word_first);
    return true;
}

/* 776: Calibration date as yyyymmdd; 0 if not calibrated. */
static inline bool pneuforce_calibration_date(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 8, low_word_first);
    return true;
}

/* 778: Code of the first-out fault; 0 if no fault is latched. */
static inline bool pneuforce_first_out_fault(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 10, sizeof *value);
    return true;
}

/* 779: Number of latched faults. */
static inline bool pneuforce_active_fault_count(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 11, sizeof *value);
    return true;
}

/* 780: Number of the balloon, from the configuration or from the last command 5. */
static inline bool pneuforce_balloon_id(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 12, low_word_first);
    return true;
}

/* 782: Number of inflations since the balloon was fitted, or since the host process started. */
static inline bool pneuforce_inflation_count(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 14, low_word_first);
    return true;
}

/* 784: Number of records of the event log on the disk; 0 without an event log. */
static inline bool pneuforce_event_log_records(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 16, low_word_first);
    return true;
}

/* 786: Digest of the last record of the event log: the first 8 hexadecimal digits. */
static inline bool pneuforce_event_log_digest_1(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 18, low_word_first);
    return true;
}

/* 788: Digest of the last record of the event log: the next 8 hexadecimal digits. */
static inline bool pneuforce_event_log_digest_2(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 20, low_word_first);
    return true;
}

/* 790: Latched faults of the board: bit n is set if fault code n is latched. */
static inline bool pneuforce_latched_faults_1(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 22, low_word_first);
    return true;
}

/* 792: Latched faults of the host process: bit n is set if fault code 32 + n is latched. */
static inline bool pneuforce_latched_faults_2(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 24, low_word_first);
    return true;
}

/* 794: Firmware version of the board: 0102h is 1.2; 0 if no board has answered yet. */
static inline bool pneuforce_firmware_version(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 26, sizeof *value);
    return true;
}

/* 795: Comparison of the firmware with the released images. 3: not a released image. */
static inline bool pneuforce_firmware_origin(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 27, sizeof *value);
    return true;
}

/* 796: CRC-32 of the image of the firmware, which the board computes at boot; 0 if not reported. */
static inline bool pneuforce_firmware_image(const uint16_t *from_768, bool low_word_first, uint32_t *value)
{
    *value = pneuforce_bits(from_768 + 28, low_word_first);
    return true;
}

/* 798: Signature of the configuration file at the start. 1: a trusted key has signed it. */
static inline bool pneuforce_configuration_signature(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 30, sizeof *value);
    return true;
}

/* 799: Signature of the calibration file at the start. 4: no calibration file is used. */
static inline bool pneuforce_calibration_signature(const uint16_t *from_768, uint16_t *value)
{
    memcpy(value, from_768 + 31, sizeof *value);
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

/* Finds the word order from the 5 test words at address 3840.
 * Returns false if the server is not a pneuforce instrument. */
static inline bool pneuforce_word_order(const uint16_t *test, bool *low_word_first)
{
    *low_word_first = test[0] == UINT16_C(0xE666);
    return pneuforce_bits(test + 0, *low_word_first) == UINT32_C(0xC2F6E666)
        && pneuforce_bits(test + 2, *low_word_first) == UINT32_C(0x12345678)
        && test[4] == UINT16_C(0xCFC7);
}

#endif
