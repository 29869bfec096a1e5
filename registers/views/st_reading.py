"""The reading side of the Structured Text library: value and valid of each measured quantity."""

from __future__ import annotations

from collections.abc import Iterator

from registers.codes import STATUS
from registers.field import Bit, Wire
from registers.map import BY_NAME, REGISTERS, Register
from registers.modbus.bank import Bank
from registers.views.facts import MEASURED, TEST, ascii_text

#: What a control loop acts on: without a value the greatest force is assumed, never none.
_FORCES = ("force", "force_uncompensated")
_MEASURED = tuple(register for register in REGISTERS if register.address in MEASURED)
_TYPES = {Wire.F32: "REAL", Wire.U32: "DWORD", Wire.U16: "UINT"}

_TYPES_TEXT = """\
(* The words as a Modbus master delivers them. *)
TYPE PF_MEASURED_WORDS : ARRAY[0..{measured_last}] OF WORD; END_TYPE
TYPE PF_TEST_WORDS : ARRAY[0..{test_last}] OF WORD; END_TYPE

(* Measured values. Without a _Valid of its own a value is valid while PF_Reading.Fresh. *)
TYPE PF_VALUES :
STRUCT
{values}END_STRUCT;
END_TYPE

(* The status bits. *)
TYPE PF_STATUS :
STRUCT
{bits}END_STRUCT;
END_TYPE
"""

_DECODE = """\
(* Two words as 32 bits and as float32, computed from sign, exponent and fraction: right on every PLC.
   Valid is FALSE for NaN and infinity, and Value is 0.0 then. *)
FUNCTION_BLOCK PF_Decode
VAR_INPUT
    First : WORD;   (* at the lower address *)
    Second : WORD;
    LowWordFirst : BOOL;
END_VAR
VAR_OUTPUT
    Bits : DWORD;
    Value : REAL;
    Valid : BOOL;
END_VAR
VAR
    High : WORD;
    Low : WORD;
    Exponent : INT;
    Fraction : DINT;
END_VAR
    IF LowWordFirst THEN
        High := Second;
        Low := First;
    ELSE
        High := First;
        Low := Second;
    END_IF;
    Bits := SHL(WORD_TO_DWORD(High), 16) OR WORD_TO_DWORD(Low);
    Exponent := WORD_TO_INT(SHR(High, 7) AND WORD#16#00FF);
    Fraction := WORD_TO_DINT(High AND WORD#16#007F) * 65536 + WORD_TO_DINT(Low);
    Valid := Exponent < 255;
    Value := 0.0;
    IF Valid THEN
        IF Exponent = 0 THEN
            Exponent := 1;
        ELSE
            Fraction := Fraction + 8388608;
        END_IF;
        Value := DINT_TO_REAL(Fraction);
        Exponent := Exponent - 150;
        (* Powers of two: every step is exact. *)
        WHILE Exponent <= -16 DO
            Value := Value / 65536.0;
            Exponent := Exponent + 16;
        END_WHILE;
        WHILE Exponent < 0 DO
            Value := Value / 2.0;
            Exponent := Exponent + 1;
        END_WHILE;
        WHILE Exponent > 0 DO
            Value := Value * 2.0;
            Exponent := Exponent - 1;
        END_WHILE;
        IF (High AND WORD#16#8000) <> WORD#0 THEN
            Value := -Value;
        END_IF;
    END_IF;
END_FUNCTION_BLOCK
"""

_WORD_ORDER = """\
(* The word order, from the test registers {test_first} to {test_end}. Read once after each connect. While
   Known is FALSE the peer is no pneuforce instrument, or the master turns bytes round. *)
FUNCTION_BLOCK PF_WordOrder
VAR_INPUT
    Words : PF_TEST_WORDS;
END_VAR
VAR_OUTPUT
    Known : BOOL;
    LowWordFirst : BOOL;
END_VAR
VAR
    HighWordFirst : BOOL;
END_VAR
    HighWordFirst := {high_first};
    LowWordFirst := {low_first};
    Known := HighWordFirst OR LowWordFirst;
END_FUNCTION_BLOCK
"""

_READING = """\
(* The block {first} to {last}, read with one request: value and valid of each quantity.
   Fresh is FALSE until the sample counter has been seen to change, and when it has not changed for
   FreshWithin: the image that a master keeps after its last read looks like a value. *)
FUNCTION_BLOCK PF_Reading
VAR_INPUT
    Words : PF_MEASURED_WORDS;
    CommunicationOk : BOOL;              (* the last read succeeded, and the word order is known *)
    LowWordFirst : BOOL;                 (* of PF_WordOrder *)
    FreshWithin : TIME := T#500ms;       (* at least three polling intervals *)
    ForceUpperLimit_N : REAL := 5.0;     (* what Force_N reads while it is not valid: back off, do not push *)
END_VAR
VAR_OUTPUT
    Fresh : BOOL;
    Values : PF_VALUES;
    Status : PF_STATUS;
END_VAR
VAR
    Decode : PF_Decode;
    Unchanged : TON;
    LastCounter : DWORD;
    CounterSeen : BOOL;
    CounterMoved : BOOL;
    Same : BOOL;
END_VAR
    Decode(First := Words[{counter}], Second := Words[{counter_end}], LowWordFirst := LowWordFirst);
    Same := CounterSeen AND CommunicationOk AND Decode.Bits = LastCounter;
    IF NOT CommunicationOk THEN
        CounterMoved := FALSE;
    ELSIF CounterSeen AND NOT Same THEN
        CounterMoved := TRUE;
    END_IF;
    CounterSeen := CommunicationOk;
    LastCounter := Decode.Bits;
    Unchanged(IN := Same, PT := FreshWithin);
    IF Unchanged.Q THEN
        CounterMoved := FALSE;
    END_IF;
    Fresh := CommunicationOk AND CounterMoved;

{body}END_FUNCTION_BLOCK
"""


def reading_blocks() -> str:
    """Types and function blocks that turn words into values."""
    counter = BY_NAME["sample_counter"].address
    return "\n".join(
        (
            _TYPES_TEXT.format(
                measured_last=len(MEASURED) - 1,
                test_last=len(TEST) - 1,
                values="".join(_members()),
                bits="".join(map(_bit, STATUS.bits)),
            ),
            _DECODE,
            _WORD_ORDER.format(
                test_first=TEST.start,
                test_end=TEST.stop - 1,
                high_first=_pattern(Bank()),
                low_first=_pattern(Bank(word_swap=True)),
            ),
            _READING.format(
                first=MEASURED.start,
                last=MEASURED.stop - 1,
                counter=counter,
                counter_end=counter + 1,
                body="".join(f"    {line}\n" for line in _body()),
            ),
        )
    )


def pascal(name: str) -> str:
    """A register's or bit's name as Structured Text writes it: force_limit becomes ForceLimit."""
    return "".join(word.capitalize() for word in name.split("_"))


def member(register: Register) -> str:
    """Name of a measured value, its unit behind it: BaselineDrift_kPa_per_s."""
    unit = register.unit.replace("/", "_per_")
    return f"{pascal(register.name)}_{unit}" if unit else pascal(register.name)


def _members() -> Iterator[str]:
    for register in _MEASURED:
        if register.name != "status":
            yield f"    {member(register)} : {_TYPES[register.wire]};  (* {ascii_text(register.doc)} *)\n"
        if register.not_available is not None:
            yield f"    {member(register)}_Valid : BOOL;\n"


def _bit(bit: Bit) -> str:
    return f"    {pascal(bit.name)} : BOOL;  (* {ascii_text(bit.doc)} *)\n"


def _pattern(bank: Bank) -> str:
    """The condition that the test words stand in the order of `bank`."""
    registers = [register for register in REGISTERS if register.address in TEST]
    data = b"".join(bank.words(register, register.constant or 0) for register in registers)
    words = [data[at : at + 2].hex().upper() for at in range(0, len(data), 2)]
    return "\n        AND ".join(f"Words[{at}] = WORD#16#{word}" for at, word in enumerate(words))


def _body() -> Iterator[str]:
    for register in _MEASURED:
        if register.wire.words == 2:
            yield f"Decode(First := Words[{register.address}], Second := Words[{register.address + 1}]);"
        if register.bits:
            yield from (
                f"Status.{pascal(b.name)} := (Decode.Bits AND DWORD#16#{1 << b.number:08X}) <> DWORD#0;"
                for b in register.bits.bits
            )
        else:
            yield from _assigned(register, f"Values.{member(register)}")


def _assigned(register: Register, value: str) -> Iterator[str]:
    if register.wire is Wire.U32:
        yield f"{value} := Decode.Bits;"
    elif register.wire is Wire.U16:
        yield f"{value} := WORD_TO_UINT(Words[{register.address}]);"
    else:
        yield f"{value} := Decode.Value;"
    if register.not_available is not None:
        told = "Decode.Valid" if register.wire is Wire.F32 else f"Words[{register.address}] <> WORD#16#FFFF"
        yield f"{value}_Valid := Fresh AND {told};"
        yield f"IF NOT {value}_Valid THEN"
        yield f"    {value} := {_without(register)};"
        yield "END_IF;"


def _without(register: Register) -> str:
    if register.name in _FORCES:
        return "ForceUpperLimit_N"
    return "0.0" if register.wire is Wire.F32 else "0"
