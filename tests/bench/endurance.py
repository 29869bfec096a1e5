"""Growth of the instrument during a virtual day: `python -m tests.bench.endurance [HOURS]`.

Link, instrument, event log, Modbus and CAN run in this process on the simulated rig, in virtual time. A PLC
polls 20 times per second. Every 10 minutes it vents the balloon for half a minute and inflates it again.
Every hour the link to the rig breaks.
"""

import gc
import sys
import threading
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from pneuforce.instrument.audit.audit_logger import AuditLogger
from pneuforce.instrument.audit.writer import EventLogWriter
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.recording.broadcaster import EntryBroadcaster
from pneuforce.registers.can.node import CanNode
from pneuforce.registers.can.options import CanOptions
from pneuforce.registers.map import COMMAND_KEY
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.source import Peer
from pneuforce.sim.factory import build_world
from pneuforce.sim.rig import STEP_S
from pneuforce.sim.scenario import load as load_scenario

HOURS, HOUR_S = 24, 3600
TICK_STEPS, POLL_STEPS = 5, 25
CYCLE_S, VENTED_S = 600, 30
PLC = Peer("modbus_tcp", "127.0.0.1")
READ = bytes.fromhex("04 0000 0014")
SCENARIO = "taps"


class VirtualInstrument:
    """Instrument with its servers and its rig, without ports. The time advances in steps of 2 ms."""

    def __init__(self, folder, world=None):
        """Connect to `world`, which answers bytes of the host with bytes of the board every 2 ms."""
        self.writer = EventLogWriter(Path(folder) / "events.sqlite")
        self.session = Session(Instrument(Settings()), EntryBroadcaster())
        self.source = AuditLogger(self.session, self.writer, lambda: round(self.now_s * 1e6))
        self.node = CanNode(self.source, CanOptions())
        identification = DeviceIdentification({})
        self.modbus = RequestHandler(RegisterBank(), self.source, identification)
        self.world = world or build_world(load_scenario(SCENARIO))
        self.steps = self.trips = self.frames = 0
        self.session.attach(self.now_s)

    @property
    def now_s(self):
        return self.steps * STEP_S

    def step(self):
        """Advance by 2 ms."""
        self.steps += 1
        to_board, now_s = b"", self.now_s
        if self.steps % TICK_STEPS == 0:
            self.session.tick(now_s)
            to_board = self.session.outgoing(now_s)
            self.source.tick(now_s)
            self.frames += len(self.node.tick(now_s))
        for sample in self.session.receive(self.world.step(to_board), now_s):
            self.session.process(sample, now_s)
            self.source.on_sample(now_s)
            self.frames += len(self.node.on_sample(now_s))
        if self.steps % POLL_STEPS == 0:
            assert len(self.modbus.answer(READ, PLC, now_s)) == 42
        if self.steps % round(1 / STEP_S) == 0:
            self._command(now_s)

    def _command(self, now_s):
        """Do what the PLC does once per second, and break the link once per hour."""
        instrument, second = self.session.instrument, round(now_s)
        if second % HOUR_S == 0:
            self.session.detach(now_s)
            self.session.attach(now_s)
        if instrument.tripped:
            self.trips += 1
            self.source.write(PLC, {"mode": "vent"}, now_s)
            self._run_command("clear_faults", now_s)
        elif second % CYCLE_S == 1:
            self.source.write(PLC, {"mode": "vent"}, now_s)
        elif second % CYCLE_S > VENTED_S and instrument.requested.mode == "vent":
            self.source.write(PLC, {"mode": "vent"}, now_s)
            self.source.write(PLC, {"mode": "hold", "setpoint_requested_kpa": 8.0}, now_s)

    def _run_command(self, code, now_s):
        sequence = (self.session.instrument.peers.last_command(PLC).sequence + 1) & 0xFFFF
        fields = {"command_key": COMMAND_KEY, "command_code": code, "command_argument": 0}
        self.source.write(PLC, fields | {"command_sequence": sequence}, now_s)


def occupied(path):
    """Return memory [kB], objects, open descriptors, threads and the size of the event log [kB]."""
    gc.collect()
    process = psutil.Process()
    files = sum(file.stat().st_size for file in path.parent.glob(path.name + "*"))
    return (
        process.memory_info().rss // 1024,
        len(gc.get_objects()),
        process.num_fds(),
        threading.active_count(),
        files // 1024,
    )


def bench_endurance(brief=False, hours=1.0):
    """Print the growth between the first tenth of the time and its end."""
    hours = 0.01 if brief else hours
    steps, begun_s = round(hours * HOUR_S / STEP_S), time.monotonic()
    with TemporaryDirectory() as folder:
        instrument = VirtualInstrument(folder)
        path = instrument.writer.path
        for step in range(steps):
            if step == steps // 10:
                before = occupied(path)
            instrument.step()
        after = occupied(path)
        instrument.writer.close()
    growth = [b - a for a, b in zip(before, after, strict=True)]
    chain = instrument.session.instrument
    print(
        f"{hours:g} virtual hours in {time.monotonic() - begun_s:.0f} s: {chain.sample_counter} samples, "
        f"{chain.inflation_count} inflations, {instrument.trips} trips, {instrument.frames} CAN frames; "
        f"growth from a tenth of the time to its end: memory {growth[0]:+d} kB of {after[0]}, objects "
        f"{growth[1]:+d} of {after[1]}, descriptors {growth[2]:+d} of {after[2]}, threads {growth[3]:+d} of "
        f"{after[3]}; event log {growth[4]:+d} kB"
    )


if __name__ == "__main__":
    bench_endurance(hours=float(sys.argv[1]) if sys.argv[1:] else HOURS)
