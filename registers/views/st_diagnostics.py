"""Optional function block of the Structured Text library that reads identity, faults and firmware."""

from __future__ import annotations

from pneuforce.registers.document_text import DIAGNOSTIC_BLOCK
from pneuforce.registers.map import MAP_VERSION, REGISTERS
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.views.st_reading import members, statements

_DIAGNOSTIC = tuple(register for register in REGISTERS if register.address in DIAGNOSTIC_BLOCK)

_TEXT = """\
TYPE PF_DIAGNOSTIC_WORDS : ARRAY[0..{last_word}] OF WORD; END_TYPE

(* Identity, faults, event log and firmware of the instrument. *)
TYPE PF_DIAGNOSTIC_VALUES :
STRUCT
{values}END_STRUCT;
END_TYPE

(* Optional. Reads the registers {first} to {last} with one request: after each connect, every
   ReadEvery, and when Failure changes. While Failure is TRUE, it reads once per second. *)
FUNCTION_BLOCK PF_Diagnostics
VAR_INPUT
    Words : PF_DIAGNOSTIC_WORDS;    (* {count} words from address {first} *)
    LowWordFirst : BOOL;            (* output of PF_WordOrder *)
    Fresh : BOOL;                   (* output of PF_Reading *)
    Failure : BOOL;                 (* PF_Reading.Status.AnyFailure *)
    ReadEvery : TIME := T#60s;
    Done : BOOL;                    (* from the master: Words contains the answer to this request *)
    Error : BOOL;                   (* from the master: the request was rejected or not answered *)
END_VAR
VAR_OUTPUT
    Read : BOOL;                    (* to the master: read the Words; TRUE until Done or Error *)
    Valid : BOOL;                   (* FALSE: Values are missing or old *)
    MapMatches : BOOL;              (* the library was generated for this register map *)
    Values : PF_DIAGNOSTIC_VALUES;  (* from the last successful request *)
END_VAR
VAR
    Decode : PF_Decode;
    Waited : TON;
    LastFailure : BOOL;
    Old : BOOL;
END_VAR
    IF NOT Fresh OR Failure <> LastFailure THEN
        Old := TRUE;
        Valid := FALSE;
    END_IF;
    LastFailure := Failure;
    Waited(IN := NOT Read, PT := ReadEvery);
    IF Read AND Error THEN
        Read := FALSE;
        Valid := FALSE;
    ELSIF Read AND Done THEN
        Read := FALSE;
        Valid := NOT Old;
        Decode(First := Words[0], Second := Words[1], LowWordFirst := LowWordFirst);
{body}        MapMatches := Values.MapVersion = {version} AND Values.MapHash = DWORD#16#{hash:08X};
    ELSIF Fresh AND NOT Read AND NOT Done AND NOT Error
        AND (Waited.Q OR (Failure OR NOT Valid) AND Waited.ET >= T#1s) THEN
        Read := TRUE;
        Old := FALSE;
    END_IF;
END_FUNCTION_BLOCK
"""


def diagnostics_block() -> str:
    """Return the types and the function block that read the diagnostic registers."""
    return _TEXT.format(
        first=DIAGNOSTIC_BLOCK.start,
        last=DIAGNOSTIC_BLOCK.stop - 1,
        count=len(DIAGNOSTIC_BLOCK),
        last_word=len(DIAGNOSTIC_BLOCK) - 1,
        values="".join(members(_DIAGNOSTIC)),
        body="".join(f"        {line}\n" for line in statements(_DIAGNOSTIC, DIAGNOSTIC_BLOCK.start)),
        version=MAP_VERSION,
        hash=MAP_HASH,
    )
