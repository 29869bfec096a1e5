"""The vent pulse of the proof test, for every setpoint in steps of 1 Pa."""

import pytest

from pneuforce.protocol.limits import SETPOINT_PA
from pneuforce.sim.board.proof_test import ProofTestPulses
from pneuforce.sim.board.reading import PressureReading
from tests.firmware.compiled import library


def python_vent_ms(setpoint_kpa, reading_kpa):
    reading, pulses = PressureReading(), ProofTestPulses()
    reading.filtered_kpa = reading_kpa
    pulses.start(setpoint_kpa, reading)
    return 2 * pulses._vent_samples


@pytest.mark.parametrize("above_kpa", [0.0, 0.1])
def test_the_vent_pulse_lasts_8_to_22_ms_at_every_setpoint_and_on_both_boards(above_kpa):
    durations_ms = set()
    for setpoint_pa in range(SETPOINT_PA[0], SETPOINT_PA[1] + 1):
        setpoint_kpa = setpoint_pa / 1e3
        vent_ms = library().vent_ms_of_proof_test(setpoint_pa, round(1e3 * above_kpa))
        assert vent_ms == python_vent_ms(setpoint_kpa, setpoint_kpa + above_kpa), setpoint_pa
        durations_ms.add(vent_ms)
    assert (min(durations_ms), max(durations_ms)) == ((8, 20) if above_kpa == 0.0 else (10, 22))
