"""Attacks on the instrument: `make attack` runs all, `python -m tests.attack NAME …` runs some.

Each attack sends a fixed amount of random input to parts of the instrument that run on this machine. The
input depends on the seed only. The command prints one line per attack, and ends with code 1 if an attack
found a defect.
"""

from __future__ import annotations

import argparse
import logging
import random
import secrets
import sys
import time

from tests.attack.can import attack_can, attack_canopen
from tests.attack.configurations import attack_configurations
from tests.attack.firmware import attack_firmware
from tests.attack.modbus import attack_modbus, attack_rtu
from tests.attack.page import attack_page
from tests.attack.rdt import attack_rdt
from tests.attack.recordings import attack_recordings
from tests.attack.result import AttackResult
from tests.attack.rig import attack_board, attack_cable
from tests.attack.soak import attack_soak

#: Each attack with its full and its brief amount.
ATTACKS = {
    "modbus": (attack_modbus, 12_600, 160),
    "rtu": (attack_rtu, 12_600, 500),
    "can": (attack_can, 18_000, 240),
    "canopen": (attack_canopen, 100_000, 1_000),
    "rdt": (attack_rdt, 200_000, 2_000),
    "cable": (attack_cable, 200_000, 5_000),
    "board": (attack_board, 200_000, 5_000),
    "firmware": (attack_firmware, 136_000_000, 1_000_000),
    "configurations": (attack_configurations, 3_500, 60),
    "recordings": (attack_recordings, 900, 4),
    "page": (attack_page, 20_000, 1_500),
    "soak": (attack_soak, 3_600, 15),
}


def run(name: str, seed: int, brief: bool) -> AttackResult:
    """Run one attack and return its result."""
    attack, amount, brief_amount = ATTACKS[name]
    result = AttackResult(name)
    attack(result, random.Random(f"{seed} {name}"), brief_amount if brief else amount)
    return result


def main() -> None:
    """Run the attacks that the command line names."""
    parser = argparse.ArgumentParser(prog="python -m tests.attack", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(ATTACKS)}")
    parser.add_argument("--seed", type=int, default=None, help="seed of the input; default: a new seed")
    parser.add_argument("--brief", action="store_true", help="send only a small amount")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in ATTACKS]
    if unknown:
        parser.error(f"{unknown[0]} is unknown")
    logging.disable()
    seed = secrets.randbelow(10**6) if arguments.seed is None else arguments.seed
    print(f"seed {seed}", flush=True)
    found = 0
    for name in arguments.names or ATTACKS:
        begun_s = time.monotonic()
        result = run(name, seed, arguments.brief)
        found += len(result.findings)
        print(f"{result.line()}  [{time.monotonic() - begun_s:.0f} s]", flush=True)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
