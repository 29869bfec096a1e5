"""Random samples and bytes for the C code of the firmware, under sanitizers of address and behaviour."""

from __future__ import annotations

import random
import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.attack.result import AttackResult
from tests.firmware.compiled import ROOT

SOURCE = Path(__file__).with_name("firmware.c")
FLAGS = ("-std=c11", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")


def attack_firmware(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Run the firmware on this machine. A report of a sanitizer is a finding."""
    with TemporaryDirectory() as folder:
        program = Path(folder) / "firmware"
        sources = ("-I", ROOT / "firmware/pneuforce", SOURCE, "-lm")
        subprocess.run(["gcc", *FLAGS, *sources, "-o", program], check=True)
        run = subprocess.run(
            [program, str(amount), str(rng.randrange(2**31))], capture_output=True, text=True, check=False
        )
    if run.returncode:
        result.check(False, (run.stdout + run.stderr).strip().replace("\n", " ")[:400])
        return
    result.sent = amount
    for what, number in zip(("inlet open", "held", "tripped"), run.stdout.split(), strict=True):
        result.notes[what] = int(number)
