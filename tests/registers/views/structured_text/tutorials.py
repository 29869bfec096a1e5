"""Programs of the PLC tutorials, and models of the manufacturers' Modbus blocks that the programs call.

Each model waits for a reply of the test. The models follow the manufacturers' documents that the tutorials
name. They have not been compared with a real controller.
"""

import re
from pathlib import Path
from typing import NamedTuple

from pneuforce.registers.views import siemens_scl
from tests.registers.views.structured_text.sources import EXTENDED_PROGRAM, LIBRARY

FOLDER = Path(__file__).parents[4] / "docs/tutorials"
#: Arrays that the library in Structured Text names. SCL has no names for arrays.
ALIASES = {
    "PF_MEASURED_WORDS": "ARRAY[0..35] OF WORD",
    "PF_TEST_WORDS": "ARRAY[0..4] OF WORD",
    "PF_DIAGNOSTIC_WORDS": "ARRAY[0..29] OF WORD",
}
#: Variables of each model: the waiting request, and the reply that the test writes.
REQUEST = """
    Waiting : BOOL; FunctionCode : UINT; Address : UINT; Count : UINT; Value : UINT;
    Reply : BOOL; ReplyFailed : BOOL; ReplyCode : UINT;
"""
REQUEST = "VAR\n" + "".join(f"    {v.strip()};\n" for v in REQUEST.split(";") if v.strip()) + "END_VAR\n"
TWINCAT_CALL = """
    IF bExecute AND NOT LastExecute THEN
        bBusy := TRUE;
        bError := FALSE;
    ELSIF Reply THEN
        bBusy := FALSE;
        bError := ReplyFailed;
        nErrId := UINT_TO_UDINT(ReplyCode);
    END_IF;
    Reply := FALSE;
    Waiting := bBusy;
    LastExecute := bExecute;
END_FUNCTION_BLOCK
"""
TWINCAT_INPUTS = """
VAR_INPUT
    sIPAddr : STRING; nTCPPort : UINT; nUnitID : BYTE; nMBAddr : WORD; nQuantity : WORD; nValue : WORD;
    bExecute : BOOL; tTimeout : TIME;
END_VAR
VAR_OUTPUT bBusy : BOOL; bError : BOOL; nErrId : UDINT; END_VAR
VAR LastExecute : BOOL; END_VAR
"""
TWINCAT = f"""
FUNCTION_BLOCK FB_MBReadInputRegs{TWINCAT_INPUTS}{REQUEST}
    FunctionCode := 4;
    Address := WORD_TO_UINT(nMBAddr);
    Count := WORD_TO_UINT(nQuantity);
{TWINCAT_CALL}
FUNCTION_BLOCK FB_MBWriteSingleReg{TWINCAT_INPUTS}{REQUEST}
    FunctionCode := 6;
    Address := WORD_TO_UINT(nMBAddr);
    Value := WORD_TO_UINT(nValue);
{TWINCAT_CALL}
"""
CODESYS_INPUTS = """
VAR_INPUT
    uiUnitId : UINT; uiStartItem : UINT; uiQuantity : UINT; uiItem : UINT; uiValue : UINT;
    udiReplyTimeout : UDINT; udiTimeOut : UDINT; xExecute : BOOL;
END_VAR
VAR_OUTPUT xBusy : BOOL; xDone : BOOL; xError : BOOL; eErrorID : UINT; eException : UINT; END_VAR
VAR LastExecute : BOOL; END_VAR
"""
CODESYS_CALL = """
    IF xExecute AND NOT LastExecute THEN
        xBusy := TRUE;
    ELSIF Reply THEN
        xBusy := FALSE;
        xDone := NOT ReplyFailed;
        xError := ReplyFailed;
        eException := 0;
        eErrorID := ReplyCode;
        IF ReplyCode > 256 THEN
            eErrorID := 51;
            eException := ReplyCode - 256;
        END_IF;
    END_IF;
    IF NOT xExecute THEN
        xDone := FALSE;
        xError := FALSE;
    END_IF;
    Reply := FALSE;
    Waiting := xBusy;
    LastExecute := xExecute;
END_FUNCTION_BLOCK
"""
CODESYS = f"""
FUNCTION_BLOCK ClientTCP
VAR_INPUT uiPort : UINT; tConnnectTimeOut : TIME; xConnect : BOOL; END_VAR
VAR_OUTPUT xConnected : BOOL; xError : BOOL; END_VAR
VAR
    LineOk : BOOL;
    Broken : BOOL;
    Attempt : TON;
END_VAR
    Attempt(IN := xConnect AND NOT xConnected AND NOT xError, PT := tConnnectTimeOut);
    Broken := xConnected AND (Broken OR NOT LineOk);
    IF NOT xConnect THEN
        xConnected := FALSE;
        xError := FALSE;
    ELSIF LineOk AND NOT xError THEN
        xConnected := TRUE;
    ELSIF Attempt.Q THEN
        xError := TRUE;
    END_IF;
END_FUNCTION_BLOCK
FUNCTION_BLOCK ClientRequestReadInputRegisters{CODESYS_INPUTS}{REQUEST}
    FunctionCode := 4;
    Address := uiStartItem;
    Count := uiQuantity;
{CODESYS_CALL}
FUNCTION_BLOCK ClientRequestWriteSingleRegister{CODESYS_INPUTS}{REQUEST}
    FunctionCode := 6;
    Address := uiItem;
    Value := uiValue;
{CODESYS_CALL}
"""
TIA = f"""
FUNCTION_BLOCK MB_CLIENT
VAR_INPUT
    REQ : BOOL; DISCONNECT : BOOL; MB_MODE : USINT; MB_DATA_ADDR : UDINT; MB_DATA_LEN : UINT;
    FirstWord : WORD;
END_VAR
VAR_OUTPUT DONE : BOOL; BUSY : BOOL; ERROR : BOOL; STATUS : WORD; END_VAR
{REQUEST}
    DONE := FALSE;
    ERROR := FALSE;
    IF REQ AND NOT BUSY THEN
        BUSY := TRUE;
        FunctionCode := 4;
        IF MB_MODE = 106 THEN
            FunctionCode := 6;
        END_IF;
        Address := UDINT_TO_UINT(MB_DATA_ADDR);
        Count := MB_DATA_LEN;
        Value := WORD_TO_UINT(FirstWord);
    ELSIF Reply THEN
        BUSY := FALSE;
        DONE := NOT ReplyFailed;
        ERROR := ReplyFailed;
        STATUS := UINT_TO_WORD(ReplyCode);
    END_IF;
    Reply := FALSE;
    Waiting := BUSY;
END_FUNCTION_BLOCK
"""


class Tutorial(NamedTuple):
    """Tutorial of a PLC family: its program, the model of its Modbus blocks, and their error codes."""

    file: str
    fence: str
    program: str
    requests: tuple[str, ...]
    models: str
    #: Text in the tutorial that the compiler of the tests does not accept, and its replacement.
    replaced: dict[str, str]
    timeout_s: float
    no_answer_code: int
    exception_base: int

    def sources(self):
        """Return the master, the program and any extended program, in plain Structured Text."""
        text = (FOLDER / self.file).read_text(encoding="utf-8")
        found = re.findall(rf"```{self.fence}\n(.*?)```", text, re.DOTALL)
        return [plain_text(source) for source in found] if self.fence == "scl" else found

    def text(self):
        """Return the library, the models and the program of the tutorial, for the compiler."""
        master, program, *_ = self.sources()
        source = f"{master}\n{program}"
        for old, new in self.replaced.items():
            assert old in source, old
            source = source.replace(old, new)
        library = structured_text_of(siemens_scl.render()) if self.fence == "scl" else LIBRARY
        return separate_lines(self.models) + library + source

    def extended_text(self):
        """Return the same text with the extended program of the PLC guide as well."""
        return f"{self.text()}\n{EXTENDED_PROGRAM}"


def plain_text(scl):
    """Return SCL without the marks of names and without the lines that Structured Text lacks."""
    text = re.sub(r"(?<!\w)#(?=\w)", "", scl).replace('"', "")
    return re.sub(r"^(VERSION : .*|BEGIN)\n", "", text, flags=re.MULTILINE)


def structured_text_of(scl):
    """Return the library in SCL as Structured Text that the compiler of the tests accepts."""
    text = plain_text(scl).replace(": TON_TIME;", ": TON;")
    text = re.sub(r"^TYPE (\w+)$", r"TYPE \1 :", text, flags=re.MULTILINE)
    for name, array in ALIASES.items():
        text = text.replace(f": {array};", f": {name};")
    return "".join(f"TYPE {name} : {array}; END_TYPE\n" for name, array in ALIASES.items()) + text


def separate_lines(text):
    """Return the text with one declaration in each line, as `compiled.members` expects."""

    def split(declarations):
        kind, body = declarations[1], declarations[2]
        lines = "".join(f"    {part.strip()};\n" for part in body.split(";") if part.strip())
        return f"{kind}\n{lines}END_VAR"

    return re.sub(r"^(VAR(?:_INPUT|_OUTPUT)?)\s(.*?)END_VAR", split, text, flags=re.MULTILINE | re.DOTALL)


TUTORIALS = [
    Tutorial(
        "twincat.md", "iecst", "MAIN", ("ReadRequest", "WriteRequest"), TWINCAT,
        {"pDestAddr := ADR(Words), cbLength := SIZEOF(Words),": ""}, 0.5, 0x745, 0x8000,
    ),
    Tutorial(
        "codesys.md", "iecst", "PLC_PRG", ("ReadRequest", "WriteRequest"), CODESYS,
        {
            "ModbusFB.Error.RequestException": "51",
            "ModbusFB.": "",
            "aIPaddr := ServerAddress, ": "",
            "rClient := Client, ": "",
            "pData := ADR(Words),": "",
            "TO_UINT(WriteRequest.eException)": "WriteRequest.eException",
        }, 0.5, 56, 256,
    ),
    Tutorial(
        "tia-portal.md", "scl", "PneuForce", ("Client",), TIA,
        {
            "FUNCTION_BLOCK PneuForce": "PROGRAM PneuForce",
            "Simulated);\nEND_FUNCTION_BLOCK": "Simulated);\nEND_PROGRAM",
            "    Client : MB_CLIENT;\n": "    Client : MB_CLIENT;\n    Words : PF_MEASURED_WORDS;\n",
            "ARRAY[0..35] OF WORD": "PF_MEASURED_WORDS",
            "ARRAY[0..4] OF WORD": "PF_TEST_WORDS",
            "ARRAY[0..29] OF WORD": "PF_DIAGNOSTIC_WORDS",
            "MB_DATA_PTR := PF_Data.Words,": "FirstWord := Words[0],",
            "        CONNECT := PF_Data.Connection,\n": "",
            "PF_Data.": "",
        }, 0.5, 0x80C8, 0x8380,
    ),
]  # fmt: skip
