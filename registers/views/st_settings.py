"""Optional function block of the Structured Text library that writes settings beside PF_Pressure."""

from __future__ import annotations

from string import Template

from pneuforce.registers.map import BY_NAME
from pneuforce.registers.views.st_pressure import literal

_TEXT = Template("""\
(* Optional. Writes settings that PF_Pressure does not write: the permission of proof tests, the pressure
   around the balloon, and the second force alarm. Call the block after PF_Pressure. Connect the master to the
   outputs of this block: it passes the writes of PF_Pressure to the master, and writes only between them.
   It writes a setting when the value changes, and all settings again after an interruption. It repeats a
   rejected or unanswered write after 5 s. *)
FUNCTION_BLOCK PF_Settings
VAR_INPUT
    ForbidProofTest : BOOL;               (* TRUE: no proof test, for example while the robot moves *)
    WriteReference : BOOL;                (* TRUE: write ReferencePressure_kPa *)
    ReferencePressure_kPa : REAL := 0.0;  (* $reference_min to $reference_max: gauge pressure *)
    ReferenceMonitored : BOOL;            (* TRUE: the configuration contains reference_timeout_s *)
    ReferenceEvery : TIME := T#200ms;     (* if monitored: less than half of reference_timeout_s *)
    WriteAlarm2 : BOOL;                   (* TRUE: write the three settings of the second force alarm *)
    ForceLimit2_N : REAL := 10.0;         (* $limit_min to $limit_max *)
    AlarmHysteresis_N : REAL := 0.1;      (* $hysteresis_min to $hysteresis_max *)
    AlarmDelay_ms : UINT := 0;            (* $delay_min to $delay_max *)
    Fresh : BOOL;                         (* output of PF_Reading *)
    Vented : BOOL;                        (* PF_Reading.Status.Vented *)
    RejectReason : UINT;                  (* from PF_Reading.Values *)
    PressureBusy : BOOL;                  (* outputs of PF_Pressure *)
    PressureWrite : BOOL;
    PressureAddress : UINT;
    PressureValue : WORD;
    Done : BOOL;                          (* from the master, as for PF_Pressure *)
    Error : BOOL;
    ExceptionCode : UINT;
END_VAR
VAR_OUTPUT
    Write : BOOL;                         (* to the master, as of PF_Pressure *)
    Address : UINT;
    Value : WORD;
    Writing : BOOL;                       (* input Wait of PF_Pressure: the write is a setting *)
    RangeError : BOOL;                    (* a setting is out of range; none is written *)
    Rejected : BOOL;                      (* the last written setting was rejected *)
    RejectedAddress : UINT;
    Reason : UINT;                        (* a PF_REJECT_REASON constant, or 0 if the reason is unknown *)
END_VAR
VAR
    Setting : INT;
    ProofTest : INT;
    Reference_Pa : INT;
    ForceLimit2_mN : INT;
    AlarmHysteresis_mN : INT;
    AlarmDelay : INT;
    WrittenProofTest : INT;
    WrittenReference_Pa : INT;
    WrittenForceLimit2_mN : INT;
    WrittenAlarmHysteresis_mN : INT;
    WrittenAlarmDelay : INT;
    Failed : BOOL;
    ReasonExpected : BOOL;
    RetryTimer : TON;
    ReferenceTimer : TON;
END_VAR
VAR CONSTANT
    UNKNOWN : INT := 32767;               (* no setting has this value *)
END_VAR
    (* Comparisons with NaN are FALSE. *)
    RangeError := WriteReference
        AND NOT (ReferencePressure_kPa >= $reference_min AND ReferencePressure_kPa <= $reference_max)
        OR WriteAlarm2 AND NOT (ForceLimit2_N >= $limit_min AND ForceLimit2_N <= $limit_max
        AND AlarmHysteresis_N >= $hysteresis_min AND AlarmHysteresis_N <= $hysteresis_max
        AND AlarmDelay_ms <= $delay_max);
    ProofTest := 0;
    IF ForbidProofTest THEN
        ProofTest := 1;
    END_IF;
    IF WriteReference AND NOT RangeError THEN
        Reference_Pa := REAL_TO_INT(ReferencePressure_kPa * 1000.0);
    END_IF;
    IF WriteAlarm2 AND NOT RangeError THEN
        ForceLimit2_mN := REAL_TO_INT(ForceLimit2_N * 1000.0);
        AlarmHysteresis_mN := REAL_TO_INT(AlarmHysteresis_N * 1000.0);
        AlarmDelay := UINT_TO_INT(AlarmDelay_ms);
    END_IF;

    ReferenceTimer(IN := NOT (Writing AND Address = $reference), PT := ReferenceEvery);
    RetryTimer(IN := Failed AND NOT Writing, PT := T#5s);
    IF Writing AND Error THEN
        Writing := FALSE;
        Failed := TRUE;
        Rejected := ExceptionCode <> 0;
        RejectedAddress := Address;
        Reason := 0;
        ReasonExpected := Rejected;
    ELSIF Writing AND Done THEN
        Writing := FALSE;
        Failed := FALSE;
        Rejected := FALSE;
        IF Address = $proof_test THEN
            WrittenProofTest := Setting;
        ELSIF Address = $limit THEN
            WrittenForceLimit2_mN := Setting;
        ELSIF Address = $hysteresis THEN
            WrittenAlarmHysteresis_mN := Setting;
        ELSIF Address = $delay THEN
            WrittenAlarmDelay := Setting;
        ELSE
            WrittenReference_Pa := Setting;
        END_IF;
    ELSIF NOT Writing AND NOT Done AND NOT Error AND Fresh AND NOT RangeError AND NOT PressureBusy
        AND (RetryTimer.Q OR NOT Failed) THEN
        Writing := TRUE;
        IF ProofTest <> WrittenProofTest THEN
            Address := $proof_test;
            Setting := ProofTest;
        ELSIF WriteAlarm2 AND ForceLimit2_mN <> WrittenForceLimit2_mN THEN
            Address := $limit;
            Setting := ForceLimit2_mN;
        ELSIF WriteAlarm2 AND AlarmHysteresis_mN <> WrittenAlarmHysteresis_mN THEN
            Address := $hysteresis;
            Setting := AlarmHysteresis_mN;
        ELSIF WriteAlarm2 AND AlarmDelay <> WrittenAlarmDelay THEN
            Address := $delay;
            Setting := AlarmDelay;
        ELSIF WriteReference AND ReferenceTimer.Q AND (ReferenceMonitored
            OR Vented AND Reference_Pa <> WrittenReference_Pa) THEN
            Address := $reference;
            Setting := Reference_Pa;
        ELSE
            Writing := FALSE;
        END_IF;
    END_IF;
    IF NOT Fresh THEN
        (* A setting that waits for the master becomes old: write the permission of proof tests instead. *)
        IF Writing THEN
            Address := $proof_test;
            Setting := ProofTest;
        END_IF;
        WrittenProofTest := UNKNOWN;
        WrittenReference_Pa := UNKNOWN;
        WrittenForceLimit2_mN := UNKNOWN;
        WrittenAlarmHysteresis_mN := UNKNOWN;
        WrittenAlarmDelay := UNKNOWN;
    END_IF;
    Write := Writing OR PressureWrite;
    Value := INT_TO_WORD(Setting);
    IF NOT Writing THEN
        Address := PressureAddress;
        Value := PressureValue;
    END_IF;
    IF Write THEN
        ReasonExpected := FALSE;   (* the next write replaces the reject reason *)
    ELSIF ReasonExpected AND Fresh AND RejectReason <> 0 THEN
        ReasonExpected := FALSE;
        Reason := RejectReason;
    END_IF;
END_FUNCTION_BLOCK
""")
#: The function block writes integer registers, because they need no float conversion and no word order.
_WRITTEN = {
    "proof_test": "proof_test",
    "reference": "reference_pressure_pa",
    "limit": "force_limit_2_mn",
    "hysteresis": "alarm_hysteresis_mn",
    "delay": "alarm_delay",
}
#: The registers whose units the inputs have.
_RANGES = {
    "reference": "reference_pressure",
    "limit": "force_limit_2",
    "hysteresis": "alarm_hysteresis",
    "delay": "alarm_delay",
}


def settings_block() -> str:
    """Return the function block that writes settings."""
    values = {prefix: str(BY_NAME[name].address) for prefix, name in _WRITTEN.items()}
    for prefix, name in _RANGES.items():
        values[f"{prefix}_min"] = literal(name, BY_NAME[name].low)
        values[f"{prefix}_max"] = literal(name, BY_NAME[name].high)
    return _TEXT.substitute(values)
