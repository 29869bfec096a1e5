"""Tests of the back-off with the settings of the CAN connection and of the web process."""

import pytest

from pneuforce.instrument.service.processes import service_process
from pneuforce.registers.can import connection as live
from pneuforce.support.backoff import Backoff


def of(module):
    return Backoff(module.FIRST_WAIT_S, module.MAX_WAIT_S, module.STABLE_S)


def waits_s(backoff, count):
    for _ in range(count):
        yield backoff.wait_s
        backoff.attempted()


@pytest.mark.parametrize(
    ("module", "waits"),
    [(live, [0.1, 0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0]), (service_process, [1, 2, 4, 8, 16, 32, 60, 60])],
    ids=["CAN", "web"],
)
def test_the_waits_double_up_to_the_maximum(module, waits):
    assert list(waits_s(of(module), len(waits))) == waits


@pytest.mark.parametrize(("module", "stable_s"), [(live, 5.0), (service_process, 60.0)], ids=["CAN", "web"])
def test_a_stable_connection_resets_the_wait_and_an_early_failure_does_not(module, stable_s):
    for lasted_s, was_stable in ((stable_s - 0.1, False), (stable_s + 0.1, True)):
        backoff = of(module)
        *_, third_s = waits_s(backoff, 3)
        backoff.opened(100.0)
        assert backoff.failed(100.0 + lasted_s) is was_stable
        assert backoff.wait_s == (module.FIRST_WAIT_S if was_stable else 2 * third_s)
