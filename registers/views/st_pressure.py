"""Function block of the Structured Text library that sets the pressure and runs commands."""

from __future__ import annotations

from string import Template

from pneuforce.registers.codes import ANSWERS, MODES, STATES
from pneuforce.registers.document_text import format_number
from pneuforce.registers.map import BY_NAME, COMMAND_KEY

_TEXT = Template("""\
(* Sets the pressure and runs commands. It writes one register at a time, so the Modbus master needs only
   function 06. Use one instance for each instrument, and call the instance in every cycle.
   - It requests inflation once for each rising edge of Hold. It renews the lease while the values are
     fresh.
   - It vents in the first cycle, when Hold is FALSE, after a rejected write, and when the instrument has
     ended the hold.
   - It repeats an unanswered write if the repetition is harmless. It never repeats the request to
     inflate.
   - A request to inflate ends when the values are no longer fresh before the inflation. A write that
     waits for the master then changes to a vent. The master must therefore send the Address and the
     Value of the cycle in which it begins to send. *)
FUNCTION_BLOCK PF_Pressure
VAR_INPUT
    Hold : BOOL;                    (* TRUE: inflate and hold; FALSE: vent *)
    Setpoint_kPa : REAL := 8.0;     (* $setpoint_min to $setpoint_max; a new value is written at once *)
    ForceLimit_N : REAL := 5.0;     (* $limit_min to $limit_max: limit for the alarm, status bit 6 *)
    Lease_ms : UINT := 2000;        (* $lease_min to $lease_max: without renewal the instrument vents *)
    RenewEvery : TIME := T#500ms;   (* less than half of the lease *)
    Run : BOOL;                     (* rising edge while not holding: runs Command; keep TRUE until it ends *)
    Command : UINT := 2;            (* a PF_COMMAND_CODE constant; 2 clears the faults *)
    Argument : WORD;                (* argument of the command *)
    Fresh : BOOL;                   (* output of PF_Reading *)
    State : UINT;                   (* from PF_Reading.Values *)
    RejectReason : UINT;            (* from PF_Reading.Values *)
    AnswerSequence : WORD;          (* registers $answer_sequence to $answer_result, to be polled as well *)
    AnswerState : WORD;
    AnswerResult : WORD;
    Done : BOOL;                    (* from the master: the write was accepted *)
    Error : BOOL;                   (* from the master: the write was rejected or not answered *)
    ExceptionCode : UINT;           (* from the master: exception code, or 0 if there was no answer *)
    Wait : BOOL;                    (* output Writing of PF_Settings; FALSE without this block *)
END_VAR
VAR_OUTPUT
    Write : BOOL;                   (* to the master: write Value to Address; TRUE until Done or Error *)
    Address : UINT;
    Value : WORD;
    Holding : BOOL;                 (* both valves are closed after the setpoint was reached *)
    RangeError : BOOL;              (* setpoint, force limit or lease is out of range; none is written *)
    Ended : BOOL := TRUE;           (* the hold ended or did not start: set Hold to FALSE first *)
    Rejected : BOOL;                (* the instrument rejected a write *)
    Reason : UINT;                  (* a PF_REJECT_REASON constant, or 0 if the instrument gave no reason *)
    CommandDone : BOOL;             (* the command was executed; TRUE until Run falls, at least one cycle *)
    CommandFailed : BOOL;           (* rejected, cancelled or not answered; TRUE as long as CommandDone *)
    Busy : BOOL;                    (* input PressureBusy of PF_Settings *)
END_VAR
VAR
    Stage : INT;
    PreviousStage : INT;
    Finished : BOOL;
    Replaced : BOOL;
    Inflated : BOOL;
    RunHandled : BOOL;
    IsCommand : BOOL;
    Setpoint_Pa : WORD;
    ForceLimit_mN : WORD;
    Lease : WORD;
    WrittenSetpoint_Pa : WORD;
    WrittenForceLimit_mN : WORD;
    Sequence : WORD;
    StageTimer : TON;
    RenewTimer : TON;
END_VAR
VAR CONSTANT
    (* An accepted write leads from each stage to the next one. *)
    VENT : INT := 0;
    RELEASE_LEASE : INT := 1;
    IDLE : INT := 2;
    REARM : INT := 3;
    TAKE_LEASE : INT := 4;
    SET_PRESSURE : INT := 5;
    SET_FORCE_LIMIT : INT := 6;
    INFLATE : INT := 7;
    KEEP_HOLDING : INT := 8;
    SEND_KEY : INT := 9;
    SEND_CODE : INT := 10;
    SEND_ARGUMENT : INT := 11;
    SEND_SEQUENCE : INT := 12;
    WAIT_FOR_ANSWER : INT := 13;
    WAIT_FOR_REASON : INT := 14;
END_VAR
    IF NOT Run THEN
        RunHandled := FALSE;
        CommandDone := FALSE;
        CommandFailed := FALSE;
    END_IF;
    (* Comparisons with NaN are FALSE. *)
    RangeError := NOT (Setpoint_kPa >= $setpoint_min AND Setpoint_kPa <= $setpoint_max
        AND ForceLimit_N >= $limit_min AND ForceLimit_N <= $limit_max
        AND Lease_ms >= $lease_min AND Lease_ms <= $lease_max);
    IF NOT RangeError THEN
        Setpoint_Pa := INT_TO_WORD(REAL_TO_INT(Setpoint_kPa * 1000.0));
        ForceLimit_mN := INT_TO_WORD(REAL_TO_INT(ForceLimit_N * 1000.0));
        Lease := UINT_TO_WORD(Lease_ms);
    END_IF;

    Finished := Write AND (Done OR Error);
    IF Finished THEN
        Write := FALSE;
        IF Replaced THEN
            Replaced := FALSE;   (* the master may have sent the replaced write: send the vent again *)
        ELSIF NOT Error THEN
            IF Address = $setpoint THEN
                WrittenSetpoint_Pa := Value;
            ELSIF Address = $limit THEN
                WrittenForceLimit_mN := Value;
            END_IF;
            IF Stage <> KEEP_HOLDING AND Stage <> IDLE THEN
                Stage := Stage + 1;
            END_IF;
        ELSIF ExceptionCode <> 0 AND Stage = RELEASE_LEASE THEN
            Stage := IDLE;   (* another peer has the lease *)
        ELSIF ExceptionCode <> 0 AND Stage > IDLE THEN
            Rejected := TRUE;
            Stage := WAIT_FOR_REASON;
        ELSIF Stage >= REARM AND Stage <= INFLATE THEN
            Ended := TRUE;
            Stage := VENT;
        END_IF;
    END_IF;
    StageTimer(IN := (Stage = PreviousStage), PT := T#3s);
    PreviousStage := Stage;
    RenewTimer(IN := NOT Finished, PT := RenewEvery);

    IF NOT Fresh AND Stage >= REARM AND Stage <= INFLATE
        OR NOT Hold AND Stage >= REARM AND Stage <= KEEP_HOLDING
        OR NOT Hold AND Stage = WAIT_FOR_REASON AND NOT IsCommand THEN
        Ended := TRUE;
        Stage := VENT;
        Replaced := Write;
        Address := $mode;
        Value := WORD#$vent;
    ELSIF NOT Run AND Stage >= SEND_KEY AND Stage <= SEND_SEQUENCE THEN
        CommandFailed := TRUE;
        Stage := IDLE;
        Address := $command_key;   (* a write of the key runs no command *)
        Value := WORD#16#$key;
    END_IF;
    IF NOT Hold THEN
        Ended := FALSE;
    ELSIF Stage <= IDLE AND (RangeError OR NOT Fresh) THEN
        Ended := TRUE;   (* holding is impossible now: require a new rising edge of Hold *)
    END_IF;
    IF NOT Write THEN
        IF Stage = IDLE THEN
            IF Run AND NOT RunHandled THEN
                RunHandled := TRUE;
                IsCommand := TRUE;
                Rejected := FALSE;
                Reason := 0;
                CommandDone := FALSE;
                CommandFailed := FALSE;
                Sequence := WORD#0;
                IF AnswerSequence <> WORD#16#FFFF THEN
                    Sequence := UINT_TO_WORD(WORD_TO_UINT(AnswerSequence) + 1);
                END_IF;
                Stage := SEND_KEY;
            ELSIF Hold AND NOT Ended THEN
                IsCommand := FALSE;
                Inflated := FALSE;
                Rejected := FALSE;
                Reason := 0;
                Stage := REARM;
            END_IF;
        ELSIF Stage = KEEP_HOLDING THEN
            IF Fresh AND State >= $inflating AND State <= $holding THEN
                Inflated := TRUE;
            ELSIF Fresh AND Inflated OR StageTimer.Q AND NOT Inflated THEN
                Ended := TRUE;
                Stage := VENT;
            END_IF;
        ELSIF Stage = WAIT_FOR_ANSWER THEN
            IF AnswerSequence = Sequence AND AnswerState = WORD#$done THEN
                CommandDone := TRUE;
                Stage := IDLE;
            ELSIF AnswerSequence = Sequence AND AnswerState = WORD#$failed OR StageTimer.Q THEN
                CommandFailed := TRUE;
                IF AnswerSequence = Sequence THEN
                    Reason := WORD_TO_UINT(AnswerResult);
                END_IF;
                Stage := IDLE;
            END_IF;
        ELSIF Stage = WAIT_FOR_REASON THEN
            IF Fresh AND RejectReason <> 0 OR StageTimer.Q THEN
                Reason := RejectReason;
                IF IsCommand THEN
                    CommandFailed := TRUE;
                    Stage := IDLE;
                ELSE
                    Ended := TRUE;
                    Stage := VENT;
                END_IF;
            END_IF;
        END_IF;
    END_IF;

    IF NOT Write AND NOT Done AND NOT Error AND NOT Wait THEN
        Write := TRUE;
        IF Stage = VENT OR Stage = REARM THEN
            Address := $mode;
            Value := WORD#$vent;
        ELSIF Stage = RELEASE_LEASE THEN
            Address := $lease;
            Value := WORD#0;
        ELSIF Stage = TAKE_LEASE THEN
            Address := $lease;
            Value := Lease;
        ELSIF Stage = SET_PRESSURE THEN
            Address := $setpoint;
            Value := Setpoint_Pa;
        ELSIF Stage = SET_FORCE_LIMIT THEN
            Address := $limit;
            Value := ForceLimit_mN;
        ELSIF Stage = INFLATE THEN
            Address := $mode;
            Value := WORD#$hold;
        ELSIF Stage = KEEP_HOLDING THEN
            IF Fresh AND Setpoint_Pa <> WrittenSetpoint_Pa THEN
                Address := $setpoint;
                Value := Setpoint_Pa;
            ELSIF Fresh AND ForceLimit_mN <> WrittenForceLimit_mN THEN
                Address := $limit;
                Value := ForceLimit_mN;
            ELSIF Fresh AND RenewTimer.Q THEN
                Address := $lease;
                Value := Lease;
            ELSE
                Write := FALSE;
            END_IF;
        ELSIF Stage = SEND_KEY THEN
            Address := $command_key;
            Value := WORD#16#$key;
        ELSIF Stage = SEND_CODE THEN
            Address := $command_code;
            Value := UINT_TO_WORD(Command);
        ELSIF Stage = SEND_ARGUMENT THEN
            Address := $command_argument;
            Value := Argument;
        ELSIF Stage = SEND_SEQUENCE THEN
            Address := $command_sequence;
            Value := Sequence;
        ELSE
            Write := FALSE;
        END_IF;
    END_IF;
    Holding := Stage = KEEP_HOLDING AND Fresh AND State = $holding;
    Busy := Write OR NOT (Stage = IDLE OR Stage = KEEP_HOLDING);
END_FUNCTION_BLOCK
""")
#: The function block writes integer registers, because they need no float conversion and no word order.
_SETPOINT, _LIMIT = "setpoint_requested_pa", "force_limit_mn"


def pressure_block() -> str:
    """Return the function block that sets the pressure."""
    limits = {"setpoint": "setpoint_requested", "limit": "force_limit", "lease": "lease"}
    values: dict[str, object] = {name: register.address for name, register in BY_NAME.items()}
    values |= {f"{prefix}_min": literal(name, BY_NAME[name].low) for prefix, name in limits.items()}
    values |= {f"{prefix}_max": literal(name, BY_NAME[name].high) for prefix, name in limits.items()}
    values |= {"setpoint": BY_NAME[_SETPOINT].address, "limit": BY_NAME[_LIMIT].address}
    values |= {**MODES.codes, **STATES.codes, **ANSWERS.codes, "key": f"{COMMAND_KEY:04X}"}
    return _TEXT.substitute(values)


def literal(name: str, value: float | None) -> str:
    """Return a limit of a register as a constant: UINT for a time in ms, otherwise REAL."""
    assert value is not None
    return format_number(value) if BY_NAME[name].unit == "ms" else repr(float(value))
