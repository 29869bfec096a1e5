"""Host process in virtual time: session and simulated rig in steps of 2 ms, with all entries recorded."""

from dataclasses import dataclass, field
from functools import cache

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.recording.broadcaster import EntryBroadcaster, Subscriber
from pneuforce.instrument.recording.checkpoint import restore_session, save_session
from pneuforce.instrument.recording.paced_replay import PacedReplay
from pneuforce.instrument.recording.schema import STOP_REQUESTED, EndReason
from pneuforce.instrument.recording.writer import RecordingWriter
from pneuforce.instrument.service.local_socket.stream_header import stream_header
from pneuforce.instrument.stream.entry import INPUTS, EntryDecoder, EntryKind, StreamEntry, json_entry
from pneuforce.instrument.stream.sample_record import unpack
from pneuforce.sim.factory import build_world
from pneuforce.sim.scenario import load
from pneuforce.sim.world import World

PLC, ROBOT, PAGE = ("modbus_tcp", "10.0.0.1"), ("can", ""), ("web", "")
STEPS_PER_TICK = 5
START_S = 1000.0


@dataclass
class RecordedEntries:
    """Checkpoint and entries, as a recorder receives them."""

    checkpoint: bytes
    entries: list


@dataclass
class VirtualHost:
    """Host process that a test advances step by step."""

    world: World = field(default_factory=lambda: build_world(load("demo")))
    session: Session = field(default_factory=lambda: Session(Instrument(Settings()), EntryBroadcaster()))
    now_s: float = START_S
    open: bool = True
    steps: int = 0
    to_board: bytes = b""
    command_sequence: int = 0
    damaged_bytes: int = 0
    snapshots: dict = field(default_factory=dict)  #: snapshots of the recording as text, by time [s]
    forces: list = field(default_factory=list)
    entries: list = field(default_factory=list)
    subscriber: Subscriber | None = None
    checkpoint: bytes = b""

    def __post_init__(self):
        self.session.attach(self.now_s)

    @property
    def instrument(self):
        return self.session.instrument

    def run(self, seconds, until=None):
        for _ in range(round(seconds * 500)):
            self.step()
            if until and until():
                break
        else:
            assert until is None, "the condition was not reached in time"
        self._drain()

    def step(self):
        self.now_s += 0.002
        self.steps += 1
        received = self.world.step(self.to_board)
        self.to_board = b""
        if received and self.open:
            for raw in self.session.receive(received, self.now_s):
                self.session.process(raw, self.now_s)
                self.forces.append((self.now_s, self.instrument.measurement.force_n))
        if self.steps % STEPS_PER_TICK == 0:
            self.session.tick(self.now_s)
            if self.subscriber:
                self.snapshots[self.now_s] = repr(self.instrument.snapshot(PAGE, self.now_s))
            if self.open:
                self.to_board = self.session.outgoing(self.now_s)

    def silence(self, seconds):
        """Hold back the bytes of the rig for a time, then deliver them at once."""
        self.world.line.noise.stalled = True
        self.run(seconds)
        self.world.line.noise.stalled = False

    def reopen(self, seconds):
        """Close the port, and open it again after a time."""
        self.session.detach(self.now_s)
        self.open = False
        self.run(seconds)
        self.open = True
        self.session.attach(self.now_s)

    def write(self, values, peer=PLC):
        return str(self.session.write(peer, values, self.now_s))

    def write_ok(self, values, peer=PLC):
        assert self.write(values, peer) == "none"

    def clear(self):
        self.command_sequence += 1
        command = {
            "command_code": "clear_faults",
            "command_argument": 0,
            "command_sequence": self.command_sequence,
        }
        self.write_ok({"command_key": 0x5046} | command)
        self.run(2.0, lambda: not self.instrument.faults)

    def inflate(self, setpoint_kpa=8.0, **more_values):
        self.run(10.0, lambda: self.instrument.vented(self.now_s) and self.instrument.chain.zero.taken)
        self.write_ok({"mode": "vent"})
        self.write_ok({"mode": "hold", "setpoint_requested_kpa": setpoint_kpa} | more_values)

    def wait_for_contact(self):
        self.run(30.0, lambda: self.instrument.measurement.in_contact)

    def record(self):
        """Start to store all entries. `recorded` returns them."""
        self.subscriber = Subscriber("record")
        self.session.sink.subscribers.append(self.subscriber)
        self.checkpoint = save_session(self.session)

    def recorded(self):
        self._drain()
        return RecordedEntries(self.checkpoint, self.entries)

    def _drain(self):
        if self.subscriber:
            self.entries += EntryDecoder().feed(self.subscriber.take_all())


@cache
def eventful():
    """Return a host and a recording that begins during a contact and contains every kind of failure."""
    host = VirtualHost()
    host.inflate()
    host.wait_for_contact()
    host.run(0.3)
    host.record()
    host.run(4.0)
    host.write_ok({"setpoint_requested_kpa": 9.5, "ambient_pressure_kpa": 98.0, "force_limit_2_n": 0.5})
    host.run(4.0)
    host.world.line.noise.bursts = 2e-3
    host.run(3.0)
    host.world.line.noise.bursts = 0.0
    host.damaged_bytes = host.session.link.decoder.skipped_bytes
    host.silence(0.15)
    host.run(1.0)
    host.silence(0.6)  # long enough to trip
    host.run(1.0)
    host.clear()
    host.inflate(7.0, lease_s=1.0)
    host.write_ok({"force_limit_n": 4.0})
    host.run(3.0)  # the lease expires
    host.clear()
    host.world.rig.reset_board()
    host.run(3.0)
    host.clear()
    host.inflate(6.0)
    host.wait_for_contact()
    host.reopen(0.5)
    host.run(2.0)
    host.session.master_lost(host.now_s)
    host.run(0.1)
    host.session.master_recovered(host.now_s)
    host.instrument.can_down = True
    host.run(0.1)
    host.instrument.can_down = False
    host.clear()
    host.inflate(6.0)
    host.wait_for_contact()
    host.session.leave(host.now_s)
    host.run(0.5)
    return host, host.recorded()


def inputs():
    return [entry for entry in eventful()[1].entries if entry.kind in INPUTS]


def samples():
    return [unpack(entry.body) for entry in eventful()[1].entries if entry.kind is EntryKind.SAMPLE]


def session():
    return restore_session(eventful()[1].checkpoint)


def write_recording(recorded, path, **header):
    """Write the recorded entries to a file, as the recorder does. `header` replaces fields of the header."""
    file, begin_s = RecordingWriter(path), recorded.entries[0].t_s
    fields = stream_header(Configuration(), simulated=True, faults=()) | header
    file.add_entry(json_entry(EntryKind.HEADER, begin_s, fields))
    file.add_entry(StreamEntry(EntryKind.CHECKPOINT, begin_s, recorded.checkpoint))
    for number, entry in enumerate(recorded.entries):
        file.add_entry(entry)
        if number % 1000 == 0:
            file.add_entry(
                json_entry(
                    EntryKind.EVENT, entry.t_s, {"at": "2027-01-31", "mono_s": entry.t_s, "kind": "test"}
                )
            )
            file.commit()
    file.end(EndReason.END, STOP_REQUESTED)
    file.commit()
    file.close()


def make_replay(**options):
    return PacedReplay(lambda: (session(), iter(inputs())), **options)


def advance(replay, duration_s, begin_s=50.0, step_s=0.005):
    """Advance the clock and the replay in steps. Return each sample with the clock time of its replay."""
    replayed, now_s = [], begin_s
    while now_s < begin_s + duration_s:
        replayed += [(now_s, sample) for sample in replay.advance(now_s)]
        now_s += step_s
    return replayed
