"""Tests of the session: link and instrument together."""

import pytest

from pneuforce.errors import ProtocolMismatch, TimeoutMismatch
from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.protocol.frames import BoardKind, Hello, encode
from tests.instrument.rig.test_link import hello, sample

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
