"""Damaged and forged bytes on the cable between the rig and the instrument, in virtual time."""

from __future__ import annotations

import math
import random
from tempfile import TemporaryDirectory

from pneuforce.errors import ProtocolMismatch, TimeoutMismatch
from pneuforce.protocol.frames import BoardState, Command, Event, Hello, Identify, Mode, Sample, Vent, encode
from pneuforce.sim.factory import build_world
from pneuforce.sim.scenario import load as load_scenario
from tests.attack.modbus import mutated
from tests.attack.result import AttackResult
from tests.bench.endurance import SCENARIO, VirtualInstrument

STEPS_PER_ROUND = 500 * 60
NOISE_END = 500 * 20  #: step of a round at which the noise ends; the rig must then work again
STRANGE = (0, 1, 2, 255, 0x7FFF, 0x8000, 0xFFFF, 0xFFFF_FFFF)


class NoisyCable:
    """Cable to a simulated rig that damages bytes, or adds forged frames, in a part of the time."""

    def __init__(self, rng: random.Random, result: AttackResult, *, forges: bool) -> None:
        self._rng, self._result, self._forges = rng, result, forges
        self._world = build_world(load_scenario(SCENARIO))
        self._steps = 0

    def step(self, to_board: bytes) -> bytes:
        """Carry bytes to the board and return its answer 2 ms later."""
        self._steps += 1
        if self._steps % STEPS_PER_ROUND >= NOISE_END:
            return self._world.step(to_board)
        if to_board and self._rng.random() < 0.3:
            to_board = mutated(to_board, self._rng)
        from_board = self._world.step(to_board)
        self._result.sent += 1
        if self._forges:
            return from_board + forged(self._rng) if self._rng.random() < 0.2 else from_board
        return mutated(from_board, self._rng) if from_board and self._rng.random() < 0.3 else from_board


def forged(rng: random.Random) -> bytes:
    """Return a frame with a valid CRC and random content, of the board or of the host."""

    def number(bits: int) -> int:
        return rng.choice((rng.getrandbits(bits), rng.choice(STRANGE) & (1 << bits) - 1))

    sample = Sample(
        number(32),
        number(16),
        number(16),
        number(8),
        rng.choice((*BoardState, number(8))),
        number(8),
        number(16),
        number(8),
        number(16),
    )
    message = rng.choice(
        (
            sample,
            sample,
            Hello(number(8), number(16), number(32), number(32), number(16), number(16)),
            Event(number(32), number(8), number(8), number(8)),
            Command(rng.choice(list(Mode)), 0, number(16), 0),
            Identify(),
            Vent(),
        )
    )
    return encode(message, number(16))


def attack_cable(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Damage bytes in both directions. A force is valid only while the board holds the balloon."""
    _attack(result, rng, amount, forges=False)


def attack_board(result: AttackResult, rng: random.Random, amount: int) -> None:
    """Add forged frames of a board. No exception may be raised, and the rig must recover."""
    _attack(result, rng, amount, forges=True)


def _attack(result: AttackResult, rng: random.Random, amount: int, *, forges: bool) -> None:
    with TemporaryDirectory() as folder:
        rig = VirtualInstrument(folder, NoisyCable(rng, result, forges=forges))
        while result.sent < amount:
            held = False
            for _ in range(STEPS_PER_ROUND):
                _step(rig, result)
                holds, valid = _observed(rig)
                result.check(holds or not valid, f"{rig.now_s:.3f} s: a force is valid without a hold")
                held = held or holds
            result.check(held, f"{rig.now_s:.1f} s: the rig did not recover")
            result.notes["rounds"] += 1
        result.notes["trips"] = rig.trips
        rig.writer.close()


def _step(rig: VirtualInstrument, result: AttackResult) -> None:
    try:
        rig.step()
    except (ProtocolMismatch, TimeoutMismatch):  # the host process closes the port and opens it again
        result.notes["handshakes refused"] += 1
        rig.session.detach(rig.now_s)
        rig.session.attach(rig.now_s)


def _observed(rig: VirtualInstrument) -> tuple[bool, bool]:
    """Return whether the board reports that it holds, and whether the force is valid."""
    instrument = rig.session.instrument
    holds = instrument.sample is not None and instrument.sample.state == BoardState.HOLDING
    return holds, math.isfinite(instrument.measurement.force_n)
