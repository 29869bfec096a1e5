"""Tests of the session: link and instrument together."""

import pytest

from pneuforce.errors import ProtocolMismatch, TimeoutMismatch
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.protocol.frames import BoardKind, BoardState, Fault, Hello, encode
from tests.instrument.recording.virtual_host import VirtualHost
from tests.instrument.rig.test_link import hello, sample

PTY_BYTES = 4095  #: bytes that a pseudo-terminal of Linux stores
SLOW_TO_SHUT = encode(Hello(BoardKind.REAL, 0x100, 1200, 7, 400, 2000), 0)


@pytest.mark.parametrize(
    ("wrong", "error"),
    [(hello(version=9), ProtocolMismatch), (SLOW_TO_SHUT, TimeoutMismatch)],
    ids=["another version", "another silence limit"],
)
def test_after_an_incompatible_board_samples_are_ignored_until_a_new_handshake(wrong, error):
    session = Session(Instrument(Settings()))
    session.attach(0.0)
    assert session.receive(hello() + sample(0), 0.0)
    with pytest.raises(error):
        session.receive(wrong, 0.1)
    session.detach(0.1)
    session.attach(0.2)
    assert session.receive(sample(1) + sample(2), 0.3) == []
    assert session.receive(hello(1300) + sample(3), 0.4)


def test_the_pressure_after_a_lost_port_has_no_memory_of_the_pressure_before_it():
    """The board vents while the cable is pulled."""
    host = VirtualHost()
    host.inflate()
    host.run(10.0, lambda: host.instrument.sample.state == BoardState.HOLDING)
    host.session.detach(host.now_s)
    for _ in range(3000):
        host.world.step(b"")
        host.now_s += 0.002
    host.session.attach(host.now_s)
    counted = host.instrument.sample_counter
    host.run(1.0, lambda: host.instrument.sample_counter > counted)
    assert abs(host.instrument.measurement.pressure_kpa) < 0.3


@pytest.mark.parametrize("first", ["tick", "samples"])
@pytest.mark.parametrize("stall_s", [0.3, 1.5, 1.9])
def test_after_a_stall_the_balloon_is_still_held_whatever_the_host_does_first(stall_s, first):
    """The samples of the stall fill the buffer of the port, so that the next bytes of the board are lost.

    The host may tick before it reads the buffer.
    """
    host = stalled(stall_s, first)
    assert (host.instrument.sample.state, list(host.instrument.faults)) == (BoardState.HOLDING, [])


@pytest.mark.parametrize("first", ["tick", "samples"])
@pytest.mark.parametrize("stall_s", [3.0, 15.0])
def test_after_a_long_stall_the_board_is_not_called_defective(stall_s, first):
    """The board has vented. The first samples come from the buffer, and the next ones are much younger."""
    assert set(stalled(stall_s, first).instrument.faults) == {HostFault.LINK_LOST, Fault.HOST_SILENT}


def stalled(stall_s, first):
    """Return the host 2 s after a stall. It ticks first, or reads the samples first."""
    host = VirtualHost()
    host.inflate()
    host.run(10.0, lambda: host.instrument.sample.state == BoardState.HOLDING)
    buffered = b"".join([host.world.step(b"") for _ in range(round(stall_s / 0.002))])[:PTY_BYTES]
    host.now_s += stall_s
    if first == "tick":
        host.session.tick(host.now_s)
        host.world.step(host.session.outgoing(host.now_s))
    for raw in host.session.receive(buffered, host.now_s):
        host.session.process(raw, host.now_s)
    host.run(2.0)
    return host
