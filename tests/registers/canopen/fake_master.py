"""Plays cases to a slave without I/O, in virtual time, and says what came back."""

from registers.can.options import Options
from registers.can.wire import CanFrame
from registers.canopen.node import CanopenNode
from registers.canopen.readings import Identity
from tests.registers.can.rig import Rig
from tests.registers.canopen.cases import OPERATIONAL, STOPPED

TICK_S = 0.01
INTO = {OPERATIONAL: b"\x01\x05", STOPPED: b"\x02\x05"}
IDENTITY = Identity(software="0.1.0")


def frame_of(text):
    """ "605 40 00 10 00" as a frame; to 605h with 8 bytes, unless it ends with "!"."""
    can_id, *data = text.rstrip("!").split()
    raw = bytes.fromhex("".join(data))
    return CanFrame(int(can_id, 16), raw.ljust(8, b"\0") if can_id == "605" and "!" not in text else raw)


def matches(expected, frame):
    can_id, *pattern = expected.split()
    if frame.id != int(can_id, 16):
        return False
    rest = frame.data[len(pattern) :]
    if pattern and pattern[-1] == "…":
        pattern, rest = pattern[:-1], b""
    given = frame.data[: len(pattern)] == bytes.fromhex("".join(pattern))
    return given and not any(rest)


def agrees(expected, frames):
    """Whether these frames, and no others, are what a case expects."""
    rows = [row for row in expected.split("|") if row.strip()]
    return len(rows) == len(frames) and all(map(matches, rows, frames))


def told(frames):
    return " | ".join(f"{frame.id:03X} {frame.data.hex(' ').upper()}" for frame in frames)


class Master:
    """Talks to a node whose time it decides."""

    def __init__(self, state="pre", rig=None, **options):
        self.rig = rig or Rig(force_n=1.0, setpoint_kpa=8.0, setpoint_requested_kpa=8.0, lease_s=0.0)
        self.node = CanopenNode(self.rig, Options(**options), IDENTITY)
        self.now_s = 0.0
        self.node.tick(self.now_s)
        if state in INTO:
            self.node.receive(CanFrame(0, INTO[state]), self.now_s)
            self.node.tick(self.now_s)

    def say(self, step):
        """What comes of one step of a case."""
        first, _, rest = step.partition(" ")
        if first == "faults":
            self.rig.set(faults=tuple(map(int, rest.split())), active_faults=len(rest.split()))
            return []
        if first.startswith("+"):
            return [frame for _, frame in self.wait(float(first)) if frame.id == int(rest, 16)]
        return self.node.receive(frame_of(step), self.now_s)

    def wait(self, seconds, samples=False):
        """(time, frame) of all that comes by time, with samples or without."""
        frames = []
        for _ in range(round(seconds / TICK_S)):
            for _ in range(5):
                self.now_s += TICK_S / 5
                if samples:
                    frames += [(self.now_s, frame) for frame in self.node.on_sample(self.now_s)]
            frames += [(self.now_s, frame) for frame in self.node.tick(self.now_s)]
        return frames
