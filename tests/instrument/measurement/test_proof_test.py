"""Evaluation of the proof test: capacities, responses and verdicts."""

import math

import pytest

from pneuforce.instrument.measurement.proof_test import (
    ProofTest,
    PulseResponse,
    Verdict,
    commissioned_response,
    judge,
    largest_ratio,
)
from pneuforce.instrument.model import Balloon, Circuit
from pneuforce.instrument.model.capacity import capacity_mm3_per_kpa, tubes_capacity_mm3_per_kpa
from pneuforce.protocol.frames import BoardState, Sample

BALLOON, CIRCUIT = Balloon(), Circuit()
LOCKED, FILL, SAFE = 2, 3, 0


def test_tubes_and_balloon_of_the_paper_take_up_256_mm3_per_kpa_at_8_kpa():
    # 137 by compression of 15 cm³ at 109.3 kPa, 119 by the growth 4πR² dR/dP of the balloon
    assert capacity_mm3_per_kpa(8.0, BALLOON, CIRCUIT) == pytest.approx(137.4 + 119.5, abs=0.5)
    assert tubes_capacity_mm3_per_kpa(8.0, CIRCUIT) == pytest.approx(116.0, abs=0.1)


def test_the_capacity_is_the_derivative_of_the_amount_of_gas():
    def amount_mm3(kpa):  # at the pressure of 8 kPa
        volume_mm3 = CIRCUIT.volume_mm3 + 4 / 3 * math.pi * BALLOON.radius_mm(kpa) ** 3
        return volume_mm3 * (CIRCUIT.ambient_kpa + kpa) / (CIRCUIT.ambient_kpa + 8.0)

    expected = (amount_mm3(8.001) - amount_mm3(7.999)) / 0.002
    assert capacity_mm3_per_kpa(8.0, BALLOON, CIRCUIT) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("kpa", "blocked"), [(5.0, 1.8), (8.0, 2.2), (11.0, 2.7)])
def test_the_limit_is_the_geometric_mean_of_a_free_and_a_blocked_response(kpa, blocked):
    assert largest_ratio(kpa, BALLOON, CIRCUIT) ** 2 == pytest.approx(blocked, abs=0.05)


@pytest.mark.parametrize(
    ("inlet", "vent", "verdict"),
    [
        (1.0, 1.0, Verdict.PASSED),
        (0.6, 1.4, Verdict.PASSED),
        (2.2, 2.2, Verdict.OCCLUDED),
        (30.0, 30.0, Verdict.OCCLUDED),
        (2.2, 1.0, Verdict.INCONCLUSIVE),  # a contact began between the pulses
        (1.0, 2.2, Verdict.INCONCLUSIVE),  # a contact ended between the pulses
        (0.0, 1.0, Verdict.INCONCLUSIVE),  # no gas supply
        (1.0, 0.0, Verdict.INCONCLUSIVE),  # the vent does not open
        (-3.0, 4.0, Verdict.INCONCLUSIVE),
        (math.nan, 1.0, Verdict.INCONCLUSIVE),
        (2.2, math.nan, Verdict.INCONCLUSIVE),
        (math.inf, math.nan, Verdict.INCONCLUSIVE),
    ],
)
def test_only_two_large_responses_show_a_blocked_tube(inlet, vent, verdict):
    assert judge(inlet, vent, (0.6, 1.5)) is verdict


def responses(test, steps):
    """Process samples (state, valves, reading [kPa], number of samples). Return the responses."""
    found = []
    for state, valves, kpa, count in steps:
        message = Sample(0, 8000, 5000, valves, state, 0, 0, 0, 8000)
        found += [test.step(message, kpa, 0.002) for _ in range(count)]
    return [response for response in found if response]


def test_the_response_is_the_pressure_change_per_opening_time_of_each_valve():
    H, T = BoardState.HOLDING, BoardState.TESTING
    found = responses(
        ProofTest(),
        [
            (H, LOCKED, 8.0, 300),
            (T, FILL, 8.0, 8),
            (T, LOCKED, 8.08, 172),
            (T, SAFE, 8.08, 5),
            (T, LOCKED, 8.01, 175),
            (H, LOCKED, 8.01, 5),
        ],
    )
    assert found == [
        PulseResponse(pytest.approx(0.08 / 0.016, rel=0.01), pytest.approx(0.07 / 0.010, rel=0.01))
    ]


def test_a_test_with_a_lost_pulse_an_invalid_reading_or_a_vent_gives_no_response():
    H, T, V = BoardState.HOLDING, BoardState.TESTING, BoardState.VENTING
    lost = responses(ProofTest(), [(H, LOCKED, 8.0, 9), (T, LOCKED, 8.0, 9), (H, LOCKED, 8.0, 1)])
    assert all(math.isnan(value) for value in lost[0])
    pulses = [(H, LOCKED, 8.0, 9), (T, FILL, math.nan, 8), (T, SAFE, 8.0, 9), (H, LOCKED, 8.0, 1)]
    assert judge(*responses(ProofTest(), pulses)[0], (0, 100)) is not Verdict.OCCLUDED
    assert responses(ProofTest(), [(T, FILL, 8.0, 8), (V, SAFE, 7.0, 9)]) == []


def verdicts(*ratios):
    """Judge tests at 8 kPa, whose responses are given relative to the commissioned circuit."""
    test, expected = ProofTest(), commissioned_response(8.0, BALLOON, CIRCUIT)
    responses(test, [(BoardState.HOLDING, LOCKED, 8.0, 1)])
    return [test.judge(PulseResponse(r * expected[0], r * expected[1]), BALLOON, CIRCUIT) for r in ratios]


def test_the_first_response_that_passes_is_the_reference():
    assert verdicts(0.5, 1.0) == [Verdict.PASSED, Verdict.OCCLUDED]
    assert verdicts(1.0, 1.0, 0.7, 1.4) == [Verdict.PASSED] * 4
    assert verdicts(1.4, 1.0) == [Verdict.PASSED] * 2


def test_the_first_response_is_compared_with_the_commissioned_circuit():
    assert verdicts(2.2) == [Verdict.OCCLUDED]
    assert verdicts(0.2, 1.0) == [Verdict.INCONCLUSIVE, Verdict.PASSED]


def test_a_forged_setpoint_of_zero_is_inconclusive():
    assert ProofTest().judge(PulseResponse(5.0, 5.0), BALLOON, CIRCUIT) is Verdict.INCONCLUSIVE
