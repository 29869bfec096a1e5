"""The writing side of the Structured Text library: the pressure set, in the order that it takes."""

from __future__ import annotations

from string import Template

from registers.codes import ANSWERS, MODES, STATES
from registers.map import BY_NAME, COMMAND_KEY
from registers.views.facts import number

_TEXT = Template("""\
(* Sets the pressure and runs commands, one register at a time: function 06 is all it needs of the master.
   It asks for inflation once for each rising edge of Hold, renews the lease while the values are fresh, and
   vents when Hold is FALSE, after a refusal, and when the hold has ended without being asked to. A write that
   nobody answered is repeated where that is harmless; what inflates is never repeated.
   One such block for each instrument, called in every cycle; its first act is a vent. *)
FUNCTION_BLOCK PF_Pressure
VAR_INPUT
    Hold : BOOL;                    (* TRUE: inflate and hold; FALSE: vent *)
    Setpoint_kPa : REAL := 8.0;     (* $setpoint_least to $setpoint_most; a new one is written at once *)
    ForceLimit_N : REAL := 5.0;     (* $limit_least to $limit_most: the alarm of status bit 6 *)
    Lease_ms : UINT := 2000;        (* $lease_least to $lease_most: silent for longer: vented *)
    RenewEvery : TIME := T#500ms;   (* less than half of the lease *)
    Run : BOOL;                     (* rising edge while not holding: runs Command; TRUE to the end *)
    Command : UINT := 2;            (* a PF_COMMAND_CODE: 2 clears the faults *)
    Argument : WORD;
    Fresh : BOOL;                   (* of PF_Reading *)
    State : UINT;                   (* of PF_Reading.Values *)
    Refusal : UINT;                 (* of PF_Reading.Values *)
    AnswerSequence : WORD;          (* registers $answer_sequence to $answer_result, polled as well *)
    AnswerState : WORD;
    AnswerResult : WORD;
    Done : BOOL;                    (* of the master: the write was accepted *)
    Error : BOOL;                   (* of the master: it was refused, or nobody answered *)
    ExceptionCode : UINT;           (* of the master: why it was refused, 0 where nobody answered *)
END_VAR
VAR_OUTPUT
    Write : BOOL;                   (* to the master: write Value to Address; TRUE until Done or Error *)
    Address : UINT;
    Value : WORD;
    Holding : BOOL;                 (* both valves locked at the setpoint *)
    SpanError : BOOL;               (* setpoint, force limit or lease out of span: none of them is written *)
    Ended : BOOL := TRUE;           (* refused, ended, or not possible when asked: Hold must go FALSE first *)
    Refused : BOOL;
    Reason : UINT;                  (* a PF_REFUSAL, 0 where the instrument gave none *)
    CommandDone : BOOL;
    CommandFailed : BOOL;
END_VAR
VAR
    Stage : INT;
    StageBefore : INT;
    Answered : BOOL;
    Begun : BOOL;
    RunSeen : BOOL;
    ForCommand : BOOL;
    Setpoint_Pa : WORD;
    Limit_mN : WORD;
    Lease : WORD;
    WrittenSetpoint_Pa : WORD;
    WrittenLimit_mN : WORD;
    Sequence : WORD;
    Stayed : TON;
    Renewal : TON;
END_VAR
VAR CONSTANT
    (* An accepted write leads from each stage to the next one. *)
    VENTING : INT := 0;
    RELEASING : INT := 1;
    RESTING : INT := 2;
    DISARMING : INT := 3;
    LEASING : INT := 4;
    SETTING : INT := 5;
    LIMITING : INT := 6;
    ASKING : INT := 7;
    KEEPING : INT := 8;
    KEYING : INT := 9;
    NAMING : INT := 10;
    ARGUING : INT := 11;
    STARTING : INT := 12;
    AWAITING : INT := 13;
    HEARING : INT := 14;
END_VAR
    (* Comparisons with a broken number are FALSE. *)
    SpanError := NOT (Setpoint_kPa >= $setpoint_least AND Setpoint_kPa <= $setpoint_most
        AND ForceLimit_N >= $limit_least AND ForceLimit_N <= $limit_most
        AND Lease_ms >= $lease_least AND Lease_ms <= $lease_most);
    IF NOT SpanError THEN
        Setpoint_Pa := INT_TO_WORD(REAL_TO_INT(Setpoint_kPa * 1000.0));
        Limit_mN := INT_TO_WORD(REAL_TO_INT(ForceLimit_N * 1000.0));
        Lease := UINT_TO_WORD(Lease_ms);
    END_IF;

    Answered := Write AND (Done OR Error);
    IF Answered THEN
        Write := FALSE;
        IF NOT Error THEN
            IF Address = $setpoint THEN
                WrittenSetpoint_Pa := Value;
            ELSIF Address = $limit THEN
                WrittenLimit_mN := Value;
            END_IF;
            IF Stage <> KEEPING THEN
                Stage := Stage + 1;
            END_IF;
        ELSIF ExceptionCode <> 0 AND Stage = RELEASING THEN
            Stage := RESTING;   (* the lease is another's *)
        ELSIF ExceptionCode <> 0 AND Stage > RESTING THEN
            Refused := TRUE;
            Stage := HEARING;
        ELSIF Stage >= DISARMING AND Stage <= ASKING THEN
            Ended := TRUE;
            Stage := VENTING;
        END_IF;
    END_IF;
    Stayed(IN := (Stage = StageBefore), PT := T#3s);
    StageBefore := Stage;
    Renewal(IN := NOT Answered, PT := RenewEvery);

    IF NOT Hold THEN
        Ended := FALSE;
    ELSIF Stage <= RESTING AND (SpanError OR NOT Fresh) THEN
        Ended := TRUE;   (* a wish does not wait for better times *)
    END_IF;
    IF NOT Run THEN
        RunSeen := FALSE;
    END_IF;
    IF NOT Write THEN
        IF NOT Hold AND (Stage >= DISARMING AND Stage <= KEEPING OR Stage = HEARING AND NOT ForCommand) THEN
            Stage := VENTING;
        ELSIF NOT Run AND Stage >= KEYING AND Stage <= AWAITING THEN
            Stage := RESTING;
        END_IF;
        IF Stage = RESTING THEN
            IF Run AND NOT RunSeen THEN
                RunSeen := TRUE;
                ForCommand := TRUE;
                Refused := FALSE;
                Reason := 0;
                CommandDone := FALSE;
                CommandFailed := FALSE;
                Sequence := WORD#0;
                IF AnswerSequence <> WORD#16#FFFF THEN
                    Sequence := UINT_TO_WORD(WORD_TO_UINT(AnswerSequence) + 1);
                END_IF;
                Stage := KEYING;
            ELSIF Hold AND NOT Ended THEN
                ForCommand := FALSE;
                Begun := FALSE;
                Refused := FALSE;
                Reason := 0;
                Stage := DISARMING;
            END_IF;
        ELSIF Stage = KEEPING THEN
            IF Fresh AND State >= $inflating AND State <= $holding THEN
                Begun := TRUE;
            ELSIF Fresh AND Begun OR Stayed.Q AND NOT Begun THEN
                Ended := TRUE;
                Stage := VENTING;
            END_IF;
        ELSIF Stage = AWAITING THEN
            IF AnswerSequence = Sequence AND AnswerState = WORD#$done THEN
                CommandDone := TRUE;
                Stage := RESTING;
            ELSIF AnswerSequence = Sequence AND AnswerState = WORD#$failed OR Stayed.Q THEN
                CommandFailed := TRUE;
                Reason := WORD_TO_UINT(AnswerResult);
                Stage := RESTING;
            END_IF;
        ELSIF Stage = HEARING THEN
            IF Fresh AND Refusal <> 0 OR Stayed.Q THEN
                Reason := Refusal;
                IF ForCommand THEN
                    CommandFailed := TRUE;
                    Stage := RESTING;
                ELSE
                    Ended := TRUE;
                    Stage := VENTING;
                END_IF;
            END_IF;
        END_IF;
    END_IF;

    IF NOT Write AND NOT Done AND NOT Error THEN
        Write := TRUE;
        IF Stage = VENTING OR Stage = DISARMING THEN
            Address := $mode;
            Value := WORD#$vent;
        ELSIF Stage = RELEASING THEN
            Address := $lease;
            Value := WORD#0;
        ELSIF Stage = LEASING THEN
            Address := $lease;
            Value := Lease;
        ELSIF Stage = SETTING THEN
            Address := $setpoint;
            Value := Setpoint_Pa;
        ELSIF Stage = LIMITING THEN
            Address := $limit;
            Value := Limit_mN;
        ELSIF Stage = ASKING THEN
            Address := $mode;
            Value := WORD#$hold;
        ELSIF Stage = KEEPING THEN
            IF Fresh AND Setpoint_Pa <> WrittenSetpoint_Pa THEN
                Address := $setpoint;
                Value := Setpoint_Pa;
            ELSIF Fresh AND Limit_mN <> WrittenLimit_mN THEN
                Address := $limit;
                Value := Limit_mN;
            ELSIF Fresh AND Renewal.Q THEN
                Address := $lease;
                Value := Lease;
            ELSE
                Write := FALSE;
            END_IF;
        ELSIF Stage = KEYING THEN
            Address := $command_key;
            Value := WORD#16#$key;
        ELSIF Stage = NAMING THEN
            Address := $command_code;
            Value := UINT_TO_WORD(Command);
        ELSIF Stage = ARGUING THEN
            Address := $command_argument;
            Value := Argument;
        ELSIF Stage = STARTING THEN
            Address := $command_sequence;
            Value := Sequence;
        ELSE
            Write := FALSE;
        END_IF;
    END_IF;
    Holding := Stage = KEEPING AND Fresh AND State = $holding;
END_FUNCTION_BLOCK
""")
#: Written as whole numbers: no float has to be encoded, and no word order matters.
_SETPOINT, _LIMIT = "setpoint_requested_pa", "force_limit_mn"


def pressure_block() -> str:
    """The function block that sets the pressure."""
    spans = {"setpoint": "setpoint_requested", "limit": "force_limit", "lease": "lease"}
    words: dict[str, object] = {name: register.address for name, register in BY_NAME.items()}
    words |= {f"{short}_least": _literal(name, "low") for short, name in spans.items()}
    words |= {f"{short}_most": _literal(name, "high") for short, name in spans.items()}
    words |= {"setpoint": BY_NAME[_SETPOINT].address, "limit": BY_NAME[_LIMIT].address}
    words |= {**MODES.codes, **STATES.codes, **ANSWERS.codes, "key": f"{COMMAND_KEY:04X}"}
    return _TEXT.substitute(words)


def _literal(name: str, end: str) -> str:
    value = getattr(BY_NAME[name], end)
    return number(value) if BY_NAME[name].unit == "ms" else repr(float(value))
