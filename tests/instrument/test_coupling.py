"""Link and instrument, coupled: what a host is to be spared."""

import pytest

from instrument.core import Instrument
from instrument.coupling import Coupling
from instrument.errors import ProtocolMismatch, TimeOutMismatch
from instrument.rig.frames import BoardKind, Hello, encode
from instrument.settings import Settings
from tests.instrument.rig.test_link import hello, sample

SLOW_TO_SHUT = encode(Hello(BoardKind.REAL, 0x100, 1200, 7, 400, 2000), 0)


@pytest.mark.parametrize(
    ("wrong", "error"),
    [(hello(version=9), ProtocolMismatch), (SLOW_TO_SHUT, TimeOutMismatch)],
    ids=["another version", "slow to shut"],
)
def test_after_a_board_that_was_refused_whoever_comes_has_to_greet_before_a_sample_is_used(wrong, error):
    coupling = Coupling(Instrument(Settings()))
    coupling.attach(0.0)
    assert coupling.receive(hello() + sample(0), 0.0)
    with pytest.raises(error):
        coupling.receive(wrong, 0.1)
    coupling.detach(0.1)
    coupling.attach(0.2)
    assert coupling.receive(sample(1) + sample(2), 0.3) == []
    assert coupling.receive(hello(1300) + sample(3), 0.4)
