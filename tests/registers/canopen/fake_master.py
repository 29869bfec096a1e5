"""Simulated master that sends frames to a node without I/O, in simulated time."""

from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.canopen.node import CanopenNode
from pneuforce.registers.canopen.node_values import CanopenIdentity
from tests.registers.can.fake_source import FakeSource
from tests.registers.canopen.cases import OPERATIONAL, STOPPED

TICK_S = 0.01
NMT_COMMAND = {OPERATIONAL: b"\x01\x05", STOPPED: b"\x02\x05"}
IDENTITY = CanopenIdentity(software="0.1.0")


def parse_frame(text):
    """Return a text like "605 40 00 10 00" as a frame; cases.py describes the format."""
    can_id, *data = text.rstrip("!").split()
    raw = bytes.fromhex("".join(data))
    return CanFrame(int(can_id, 16), raw.ljust(8, b"\0") if can_id == "605" and "!" not in text else raw)


def frame_matches(expected, frame):
    """Return True if the frame has the identifier and the data of the text `expected`."""
    can_id, *pattern = expected.split()
    if frame.id != int(can_id, 16):
        return False
    rest = frame.data[len(pattern) :]
    if pattern and pattern[-1] == "…":
        pattern, rest = pattern[:-1], b""
    given = frame.data[: len(pattern)] == bytes.fromhex("".join(pattern))
    return given and not any(rest)


def frames_match(expected, frames):
    """Return True if the frames are exactly those of the text `expected`."""
    rows = [row for row in expected.split("|") if row.strip()]
    return len(rows) == len(frames) and all(map(frame_matches, rows, frames))


def format_frames(frames):
    return " | ".join(f"{frame.id:03X} {frame.data.hex(' ').upper()}" for frame in frames)


class FakeMaster:
    """Master of one node. The master controls the time of the node."""

    def __init__(self, state="pre", source=None, storage=None, **options):
        self.source = source or FakeSource(
            force_n=1.0, setpoint_kpa=8.0, setpoint_requested_kpa=8.0, lease_s=0.0
        )
        self.node = CanopenNode(self.source, CanOptions(**options), IDENTITY, storage)
        self.now_s = 0.0
        self.node.tick(self.now_s)
        if state in NMT_COMMAND:
            self.node.receive(CanFrame(0, NMT_COMMAND[state]), self.now_s)
            self.node.tick(self.now_s)

    def send(self, step):
        """Carry out one step of a case and return the frames that the node sends."""
        first, _, rest = step.partition(" ")
        if first == "faults":
            self.source.set(faults=tuple(map(int, rest.split())), active_fault_count=len(rest.split()))
            return []
        if first.startswith("+"):
            return [frame for _, frame in self.wait(float(first)) if frame.id == int(rest, 16)]
        return self.node.receive(parse_frame(step), self.now_s)

    def wait(self, seconds, samples=False):
        """Let simulated time pass. Return (time, frame) of each frame that the node sends."""
        frames = []
        for _ in range(round(seconds / TICK_S)):
            for _ in range(5):
                self.now_s += TICK_S / 5
                if samples:
                    frames += [(self.now_s, frame) for frame in self.node.on_sample(self.now_s)]
            frames += [(self.now_s, frame) for frame in self.node.tick(self.now_s)]
        return frames
