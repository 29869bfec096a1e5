"""Time from a touch to the first valid force of the contact: `python -m tests.bench.touch`.

Instrument, CAN nodes and simulated rig run in this process in virtual time, in steps of 2 ms. A robot moves
the balloon towards tissue at a constant speed. The figures therefore contain the physics of the balloon, the
tube, the filters of the instrument and the period of the frames, but no delay of a bus or of a computer.
"""

import statistics

from pneuforce.registers.can.frames import FORCE, decode
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions
from pneuforce.sim.contacts.tissue import HalfSpace, Rigid
from pneuforce.sim.contacts.tool import MovedTool
from tests.instrument.recording.virtual_host import VirtualHost

RATES_HZ = (500, 100)  #: at 500 Hz there is a frame for each sample, as in RDT and on the local socket
SPEEDS_MM_PER_S = (1.0, 5.0, 20.0)
SETPOINT_KPA, DISTANCE_MM, REST_S, TIMEOUT_S = 8.0, 2.0, 2.5, 5.0
TOUCHES, PHASE_MM = 20, 0.0137  #: each touch begins at another time between two frames
TISSUES = {"rigid wall": Rigid(), "soft tissue (20 kPa)": HalfSpace(20.0, 8.0)}


class TouchedRig:
    """Held balloon of the simulated rig, and the nodes that send its force."""

    def __init__(self):
        self._host = VirtualHost()
        self._hand = self._host.world.rig.hand
        self._hand.plays_phases = False
        self._nodes = {
            rate_hz: CanNode(self._host.instrument, CanOptions(force_rate_hz=rate_hz)) for rate_hz in RATES_HZ
        }
        self._host.inflate(SETPOINT_KPA, proof_test="forbidden")
        self._host.run(
            10.0, lambda: self._host.instrument.snapshot(("can", ""), self._host.now_s).state == "holding"
        )

    def touch(self, tissue, speed_mm_per_s, distance_mm):
        """Return the delay of the first valid force [s] by frame rate, and the true force then [N]."""
        tool = MovedTool(tissue, distance_mm)
        self._hand.give_to_robot(tool)
        touched_s, delays_s, force_n = None, {}, 0.0
        while len(delays_s) < len(self._nodes):
            tool.command(speed_mm_per_s)
            seen = self._step()
            now_s, travel_mm = self._host.now_s, tool.push.travel_mm
            if touched_s is None and travel_mm > 0:
                touched_s = now_s - travel_mm / tool.speed_mm_per_s
            assert touched_s is not None or not seen, "a force was shown before the touch"
            assert touched_s is None or now_s < touched_s + TIMEOUT_S, "the contact was not detected"
            if seen and not delays_s:
                force_n = self._host.world.rig.truth.force_n
            for rate_hz in seen:
                delays_s.setdefault(rate_hz, now_s - touched_s)
        self._move_away(tool)
        return delays_s, force_n

    def _step(self):
        """Advance by 2 ms. Return the rates of the nodes whose frame contains a valid force above 0 N."""
        samples = len(self._host.forces)
        self._host.step()
        if len(self._host.forces) == samples:
            return []
        return [rate_hz for rate_hz, node in self._nodes.items() if self._shows_contact(node)]

    def _shows_contact(self, node):
        frames = [frame for frame in node.on_sample(self._host.now_s) if frame.id == FORCE.base_id + 5]
        values = [decode(FORCE, frame.data) for frame in frames]
        return any({"force_valid", "in_contact"} <= v["condensed_status"] and v["force"] > 0 for v in values)

    def _move_away(self, tool):
        for _ in range(round(REST_S / 0.002)):
            tool.command(-20.0 if tool.push.travel_mm > -10.0 else 0.0)
            self._step()


def bench_touch(brief=False):
    """Print the time from the touch to the frame with the first valid force, for tissues and speeds."""
    rig, count = TouchedRig(), 1 if brief else TOUCHES
    for name, tissue in list(TISSUES.items())[: 1 if brief else None]:
        for speed in SPEEDS_MM_PER_S[1:2] if brief else SPEEDS_MM_PER_S:
            touches = [rig.touch(tissue, speed, DISTANCE_MM + n * PHASE_MM) for n in range(count)]
            force_n = statistics.median(force_n for _, force_n in touches)
            print(f"touch of a {name} at {speed:g} mm/s: {_delays(touches)}; true force then {force_n:.2f} N")


def _delays(touches):
    """Return median and maximum of the delay for each frame rate."""
    texts = []
    for rate_hz in RATES_HZ:
        delays_ms = [1e3 * delays[rate_hz] for delays, _ in touches]
        texts.append(
            f"{rate_hz} Hz median {statistics.median(delays_ms):.0f} ms, longest {max(delays_ms):.0f} ms"
        )
    return "; ".join(texts)


if __name__ == "__main__":
    bench_touch()
