"""A host in virtual time: coupling and simulated rig, a step of 2 ms each, everything on the tape."""

from dataclasses import dataclass, field
from functools import cache

from instrument.cli.begin import begin_of
from instrument.config import Configuration
from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.settings import Settings
from instrument.tape.checkpoint import freeze, thaw
from instrument.tape.entry import INPUTS, Decoder, Entry, Kind, told
from instrument.tape.feed import Feed, Listener
from instrument.tape.file import TapeFile
from instrument.tape.measured import unpack
from instrument.tape.playing import Playing
from instrument.tape.schema import ASKED, How
from sim.scenario import load
from sim.staging import world_of
from sim.world import World

PLC, ROBOT, PAGE = ("modbus_tcp", "10.0.0.1"), ("can", ""), ("page", "")
STEPS_PER_BEAT = 5
BEGUN_S = 1000.0


@dataclass
class Tape:
    """What a recorder would have kept."""

    checkpoint: bytes
    entries: list


@dataclass
class VirtualHost:
    """Does what the host does, at the times that the test says."""

    world: World = field(default_factory=lambda: world_of(load("demo")))
    coupling: Coupling = field(default_factory=lambda: Coupling(Instrument(Settings()), Feed()))
    now_s: float = BEGUN_S
    open: bool = True
    steps: int = 0
    to_board: bytes = b""
    orders: int = 0
    damaged_bytes: int = 0
    seen: dict = field(default_factory=dict)  #: all that the page may see, in words, by time
    forces: list = field(default_factory=list)
    entries: list = field(default_factory=list)
    listener: Listener | None = None
    checkpoint: bytes = b""

    def __post_init__(self):
        self.coupling.attach(self.now_s)

    @property
    def instrument(self):
        return self.coupling.instrument

    def run(self, seconds, until=None):
        for _ in range(round(seconds * 500)):
            self.step()
            if until and until():
                break
        else:
            assert until is None, "what was waited for did not come"
        self._drain()

    def step(self):
        self.now_s += 0.002
        self.steps += 1
        heard = self.world.step(self.to_board)
        self.to_board = b""
        if heard and self.open:
            for raw in self.coupling.receive(heard, self.now_s):
                self.coupling.take(raw, self.now_s)
                self.forces.append((self.now_s, self.instrument.measurement.force_n))
        if self.steps % STEPS_PER_BEAT == 0:
            self.coupling.beat(self.now_s)
            self.seen[self.now_s] = repr(self.instrument.snapshot(PAGE, self.now_s))
            if self.open:
                self.to_board = self.coupling.orders(self.now_s)

    def silence(self, seconds):
        """The far end stays silent, and then says all at once what it meant to say."""
        self.world.line.noise.stalled = True
        self.run(seconds)
        self.world.line.noise.stalled = False

    def reopen(self, seconds):
        """The port goes, and comes back."""
        self.coupling.detach(self.now_s)
        self.open = False
        self.run(seconds)
        self.open = True
        self.coupling.attach(self.now_s)

    def write(self, values, peer=PLC):
        return str(self.coupling.write(peer, values, self.now_s))

    def must(self, values, peer=PLC):
        assert self.write(values, peer) == "none"

    def clear(self):
        self.orders += 1
        order = {"command_code": "clear_faults", "command_argument": 0, "command_sequence": self.orders}
        self.must({"command_key": 0x5046} | order)
        self.run(2.0, lambda: not self.instrument.faults)

    def inflate(self, setpoint_kpa=8.0, **more):
        self.run(10.0, lambda: self.instrument.vented(self.now_s) and self.instrument.chain.zero.taken)
        self.must({"mode": "vent"})
        self.must({"mode": "hold", "setpoint_requested_kpa": setpoint_kpa} | more)

    def until_contact(self):
        self.run(30.0, lambda: self.instrument.measurement.in_contact)

    def record(self):
        """From now on everything is kept, for `recorded`."""
        self.listener = Listener("record")
        self.coupling.tape.listeners.append(self.listener)
        self.checkpoint = freeze(self.coupling)

    def recorded(self):
        self._drain()
        return Tape(self.checkpoint, self.entries)

    def _drain(self):
        if self.listener:
            self.entries += Decoder().feed(self.listener.take())


@cache
def eventful():
    """A recording that begins in the middle of a contact, and in which all goes wrong that may."""
    host = VirtualHost()
    host.inflate()
    host.until_contact()
    host.run(0.3)
    host.record()
    host.run(4.0)
    host.must({"setpoint_requested_kpa": 9.5})
    host.run(4.0)
    host.world.line.noise.bursts = 2e-3
    host.run(3.0)
    host.world.line.noise.bursts = 0.0
    host.damaged_bytes = host.coupling.link.decoder.skipped_bytes
    host.silence(0.15)
    host.run(1.0)
    host.silence(0.6)  # long enough to trip
    host.run(1.0)
    host.clear()
    host.inflate(7.0, lease_s=1.0)
    host.must({"force_limit_n": 4.0})
    host.run(3.0)  # the lease runs out
    host.clear()
    host.world.rig.reset_board()
    host.run(3.0)
    host.clear()
    host.inflate(6.0)
    host.until_contact()
    host.reopen(0.5)
    host.run(2.0)
    host.coupling.master_lost(host.now_s)
    host.run(0.1)
    host.coupling.master_back(host.now_s)
    host.instrument.can_down = True
    host.run(0.1)
    host.instrument.can_down = False
    host.clear()
    host.inflate(6.0)
    host.until_contact()
    host.coupling.leave(host.now_s)
    host.run(0.5)
    return host, host.recorded()


def inputs():
    return [entry for entry in eventful()[1].entries if entry.kind in INPUTS]


def samples():
    return [unpack(entry.body) for entry in eventful()[1].entries if entry.kind is Kind.MEASURED]


def coupling():
    return thaw(eventful()[1].checkpoint)


def write(tape, path):
    """As the recorder writes it."""
    file, begin_s = TapeFile(path), tape.entries[0].t_s
    file.put(told(Kind.BEGIN, begin_s, begin_of(Configuration(), simulated=True, faults=())))
    file.put(Entry(Kind.CHECKPOINT, begin_s, tape.checkpoint))
    for number, entry in enumerate(tape.entries):
        file.put(entry)
        if number % 1000 == 0:
            file.put(told(Kind.EVENT, entry.t_s, {"at": "2027-01-31", "mono_s": entry.t_s, "kind": "test"}))
            file.commit()
    file.end(How.END, ASKED)
    file.commit()
    file.close()


def playing(**how):
    return Playing(lambda: (coupling(), iter(inputs())), **how)


def play(show, until_s, begin_s=50.0, step_s=0.005):
    """Advance by the clock; what was measured, with the time of the clock."""
    found, now_s = [], begin_s
    while now_s < begin_s + until_s:
        found += [(now_s, sample) for sample in show.advance(now_s)]
        now_s += step_s
    return found
