"""Function blocks of the Structured Text library that return the measured values and their validity."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pneuforce.registers.codes import STATUS
from pneuforce.registers.document_text import MEASURED_BLOCK, TEST_BLOCK, ascii_text
from pneuforce.registers.field import StatusBit, WireType
from pneuforce.registers.map import BY_NAME, REGISTERS, Register
from pneuforce.registers.modbus.register_bank import RegisterBank

#: Values that a control loop uses. An invalid value becomes its upper limit, because 0 would be unsafe.
_FORCES = ("force", "force_uncompensated")
_MEASURED = tuple(register for register in REGISTERS if register.address in MEASURED_BLOCK)
#: Names of registers that are keywords of CODESYS and TwinCAT, and the names of their values.
_RENAMED = {"method": "ForceMethod"}
_TYPES = {WireType.F32: "REAL", WireType.U32: "DWORD", WireType.U16: "UINT"}

_TYPE_DECLARATIONS = """\
(* Words as the Modbus master delivers them. *)
TYPE PF_MEASURED_WORDS : ARRAY[0..{measured_last}] OF WORD; END_TYPE
TYPE PF_TEST_WORDS : ARRAY[0..{test_last}] OF WORD; END_TYPE

(* Measured values. A value without its own _Valid is valid while PF_Reading.Fresh is TRUE. *)
TYPE PF_VALUES :
STRUCT
{values}END_STRUCT;
END_TYPE

(* Status bits. *)
TYPE PF_STATUS :
STRUCT
{bits}END_STRUCT;
END_TYPE
"""

_DECODE = """\
(* Converts two words to 32 bits and to a REAL. The REAL is computed from sign, exponent and fraction, so the
   result is the same on every PLC. For NaN and infinity, Valid is FALSE and Value is 0.0. *)
FUNCTION_BLOCK PF_Decode
VAR_INPUT
    First : WORD;   (* word at the lower address *)
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
        (* Every step is exact, because the factors are powers of two. *)
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
(* Finds the word order from the test registers {test_first} to {test_end}. Read them once after each connect.
   If Known is FALSE, the server is not a pneuforce instrument, or the master swaps the bytes of each word. *)
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
(* Decodes the registers {first} to {last}, read with one request: value and validity of each quantity.
   Fresh becomes TRUE when the sample counter changes. Fresh becomes FALSE if the counter does not change for
   FreshWithin. The check is necessary because a master keeps the words of its last read when the
   communication stops. *)
FUNCTION_BLOCK PF_Reading
VAR_INPUT
    Words : PF_MEASURED_WORDS;
    CommunicationOk : BOOL;              (* TRUE: the last read succeeded, and the word order is known *)
    LowWordFirst : BOOL;                 (* output of PF_WordOrder *)
    FreshWithin : TIME := T#500ms;       (* at least three polling intervals *)
    ForceUpperLimit_N : REAL := 5.0;     (* value of Force_N while it is not valid *)
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
    CounterKnown : BOOL;
    CounterChanged : BOOL;
    Same : BOOL;
END_VAR
    Decode(First := Words[{counter}], Second := Words[{counter_end}], LowWordFirst := LowWordFirst);
    Same := CounterKnown AND Decode.Bits = LastCounter;
    IF NOT CommunicationOk THEN
        CounterChanged := FALSE;
    ELSIF CounterKnown AND NOT Same THEN
        CounterChanged := TRUE;
    END_IF;
    CounterKnown := CommunicationOk;
    LastCounter := Decode.Bits;
    Unchanged(IN := Same, PT := FreshWithin);
    IF Unchanged.Q THEN
        CounterChanged := FALSE;
    END_IF;
    Fresh := CommunicationOk AND CounterChanged;

{body}END_FUNCTION_BLOCK
"""


def reading_blocks() -> str:
    """Return the types and function blocks that convert words to values."""
    counter = BY_NAME["sample_counter"].address
    return "\n".join(
        (
            _TYPE_DECLARATIONS.format(
                measured_last=len(MEASURED_BLOCK) - 1,
                test_last=len(TEST_BLOCK) - 1,
                values="".join(members(_MEASURED)),
                bits="".join(map(_bit, STATUS.bits)),
            ),
            _DECODE,
            _WORD_ORDER.format(
                test_first=TEST_BLOCK.start,
                test_end=TEST_BLOCK.stop - 1,
                high_first=_pattern(RegisterBank()),
                low_first=_pattern(RegisterBank(word_swap=True)),
            ),
            _READING.format(
                first=MEASURED_BLOCK.start,
                last=MEASURED_BLOCK.stop - 1,
                counter=counter,
                counter_end=counter + 1,
                body="".join(f"    {line}\n" for line in statements(_MEASURED, MEASURED_BLOCK.start)),
            ),
        )
    )


def pascal(name: str) -> str:
    """Return the name of a register or bit in Pascal case: force_limit becomes ForceLimit."""
    return "".join(word.capitalize() for word in name.split("_"))


def member(register: Register) -> str:
    """Return the name of a measured value with its unit, for example BaselineDrift_kPa_per_s."""
    unit = register.unit.replace("/", "_per_")
    name = _RENAMED.get(register.name) or pascal(register.name)
    return f"{name}_{unit}" if unit else name


def members(registers: Iterable[Register]) -> Iterator[str]:
    """Yield the members of the structure that contains the values of `registers`."""
    for register in registers:
        if register.name != "status":
            yield f"    {member(register)} : {_TYPES[register.wire]};  (* {ascii_text(register.doc)} *)\n"
        if register.not_available is not None:
            yield f"    {member(register)}_Valid : BOOL;\n"


def _bit(bit: StatusBit) -> str:
    return f"    {pascal(bit.name)} : BOOL;  (* {ascii_text(bit.doc)} *)\n"


def _pattern(bank: RegisterBank) -> str:
    """Return the Structured Text condition that is TRUE if the test words have the word order of `bank`."""
    registers = [register for register in REGISTERS if register.address in TEST_BLOCK]
    data = b"".join(bank.encode_words(register, register.constant or 0) for register in registers)
    words = [data[at : at + 2].hex().upper() for at in range(0, len(data), 2)]
    return "\n        AND ".join(f"Words[{at}] = WORD#16#{word}" for at, word in enumerate(words))


def statements(registers: Iterable[Register], first: int) -> Iterator[str]:
    """Yield the statements that decode `registers`. Words[0] is the register at the address `first`."""
    for register in registers:
        at = register.address - first
        if register.wire.words == 2:
            yield f"Decode(First := Words[{at}], Second := Words[{at + 1}]);"
        if register.bits:
            yield from (
                f"Status.{pascal(b.name)} := (Decode.Bits AND DWORD#16#{1 << b.number:08X}) <> DWORD#0;"
                for b in register.bits.bits
            )
        else:
            yield from _assignment(register, f"Values.{member(register)}", f"Words[{at}]")


def _assignment(register: Register, value: str, word: str) -> Iterator[str]:
    if register.wire is WireType.U32:
        yield f"{value} := Decode.Bits;"
    elif register.wire is WireType.U16:
        yield f"{value} := WORD_TO_UINT({word});"
    else:
        yield f"{value} := Decode.Value;"
    if register.not_available is not None:
        valid = "Decode.Valid" if register.wire is WireType.F32 else f"{word} <> WORD#16#FFFF"
        yield f"{value}_Valid := Fresh AND {valid};"
        yield f"IF NOT {value}_Valid THEN"
        yield f"    {value} := {_substitute(register)};"
        yield "END_IF;"


def _substitute(register: Register) -> str:
    if register.name in _FORCES:
        return "ForceUpperLimit_N"
    return "0.0" if register.wire is WireType.F32 else "0"
