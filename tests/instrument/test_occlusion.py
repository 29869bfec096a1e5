"""A blocked tube of a held balloon is found by the proof test: instrument and rig in virtual time."""

import copy
import math
from functools import cache

import pytest

from pneuforce.instrument.core.controller import Instrument
from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.session import Session
from pneuforce.instrument.core.settings import Settings
from pneuforce.protocol.frames import BoardState, Fault
from pneuforce.registers.map import COMMAND_KEY
from pneuforce.sim.sensor import Sensor, SensorSettings
from tests.instrument.recording.virtual_host import PLC, ROBOT, VirtualHost

HOLD = {"mode": "hold"}


class Holding(VirtualHost):
    """Instrument that holds a balloon, with a hand that acts only on request."""

    @classmethod
    def at(cls, kpa=8.0, **settings):
        return cls._at(kpa, tuple(settings.items())).copied()

    @classmethod
    @cache
    def _at(cls, kpa, settings):
        host = cls(session=Session(Instrument(Settings(**dict(settings)))))
        host.world.rig.hand.plays_phases = False
        host.run(3.0)
        host.write({"mode": "vent"})
        host.write(HOLD | {"setpoint_requested_kpa": kpa})
        host.run(10, lambda: host.instrument.snapshot(PLC, host.now_s).state == "holding")
        return host

    def copied(self):
        """Return a copy with new noise, because the generator of the noise cannot be copied."""
        sensor = self.world.rig.sensor
        noise, sensor._noise = sensor._noise, None
        host = copy.deepcopy(self)
        sensor._noise = noise
        host.world.rig.sensor._noise = Sensor(SensorSettings(), seed=2)._noise
        return host

    def write(self, values, peer=PLC):
        assert str(self.session.write(peer, values, self.now_s)) == "none"

    @property
    def seen(self):
        return self.instrument.snapshot(PLC, self.now_s)

    @property
    def testing(self):
        return self.instrument.sample.state == BoardState.TESTING

    @property
    def tests(self):
        return self.instrument.proof_tests.count

    def tested(self):
        """Run until the next test has ended."""
        self.run(70, lambda: self.testing)
        self.run(1, lambda: not self.testing)
        return self


@pytest.mark.parametrize("kpa", [5.0, 8.0, 11.0])
def test_a_tube_that_is_blocked_while_the_balloon_is_held_trips_within_a_period(kpa):
    host = Holding.at(kpa, proof_test_s=20.0).tested()
    host.world.faults.inject("occluded")
    host.world.rig.hand.press(2.0)
    host.run(2)
    assert host.seen.force_n == 0.0  # the hidden failure: nothing shows the contact
    host.run(24, lambda: host.instrument.tripped)
    assert host.seen.first_out_fault == Fault.OCCLUSION
    assert math.isnan(host.seen.force_n)
    assert "vent_fault" in host.seen.status
    host.run(1.0)
    assert not host.instrument.sample.valves


@cache
def pressed(kpa):
    """Return an instrument that is in contact, which tests copy."""
    host = Holding.at(kpa)
    host.world.rig.hand.press(1.0)
    host.run(2)
    assert "in_contact" in host.seen.status
    return host


def blocked_and_cleared():
    """Return an instrument whose fault 10 is cleared although the tube is still blocked."""
    host = Holding.at(8.0)
    host.world.faults.inject("occluded")
    host.run(0.5)
    host.write({"mode": "vent"})
    host.run(3.0)
    assert host.seen.first_out_fault == Fault.OCCLUSION
    assert clear(host) == 0
    host.write({"mode": "vent"})
    host.run(1.0)
    assert host.world.rig.truth.balloon_kpa > 7
    return host


def test_after_a_blocked_tube_maintenance_is_required_until_a_proof_test_passes():
    host = blocked_and_cleared()
    assert "tube_unproven" in host.seen.maintenance_causes
    assert "maintenance_required" in host.seen.status
    host.world.faults.remove("occluded")
    host.run(3.0)
    clear(host, 2)  # the gas from the balloon looks like an inlet valve that does not close
    host.write({"mode": "vent"})
    host.write(HOLD)
    host.run(10.0, lambda: host.seen.state == "holding")
    assert "tube_unproven" in host.seen.maintenance_causes  # the dead volume also holds a pressure
    host.tested()
    assert host.seen.state == "holding"
    assert host.seen.maintenance_causes == frozenset()


def test_a_new_balloon_ends_the_doubt_about_the_tube():
    host = blocked_and_cleared()
    new_balloon = {"command_key": COMMAND_KEY, "command_code": "new_balloon", "command_sequence": 2}
    host.write(new_balloon | {"command_argument": 7})
    assert host.seen.maintenance_causes == frozenset()


@pytest.mark.parametrize("kpa", [5.0, 8.0, 11.0])
def test_a_tube_that_is_blocked_in_a_contact_is_found_by_the_vent(kpa):
    host = pressed(kpa).copied()
    host.world.faults.inject("occluded")
    host.run(0.5)
    host.write({"mode": "vent"})
    host.run(1.0, lambda: host.instrument.tripped)
    assert host.seen.first_out_fault == Fault.OCCLUSION
    assert host.world.rig.truth.balloon_kpa > 3  # the balloon is still inflated


def clear(host, sequence=1):
    """Clear the faults. Return the first-out fault that remains."""
    command = {"command_key": COMMAND_KEY, "command_code": "clear_faults", "command_sequence": sequence}
    host.session.write(PLC, command, host.now_s)
    host.run(0.5)
    return host.instrument.snapshot(PLC, host.now_s).first_out_fault


@pytest.mark.parametrize("in_contact", [False, True])
@pytest.mark.parametrize("fault", ["occluded", "vent_shut"])
def test_a_failed_vent_is_never_shown_as_verified_and_can_be_cleared(fault, in_contact):
    host = pressed(8.0).copied() if in_contact else Holding.at(8.0)
    host.world.faults.inject(fault)
    host.run(0.5)
    host.write({"mode": "vent"})
    for _ in range(80):
        host.run(0.1)
        assert "vented" not in host.seen.status
    assert "vent_fault" in host.seen.status
    assert host.world.rig.truth.balloon_kpa > 7
    host.world.faults.remove(fault)
    host.world.rig.hand.release()
    host.run(3.0)
    assert "vented" not in host.seen.status  # the fault is still latched
    new_balloon = {"command_key": COMMAND_KEY, "command_code": "new_balloon", "command_sequence": 1}
    host.write(new_balloon | {"command_argument": 7})  # advised before the faults are cleared
    assert (host.seen.answer_state, host.seen.balloon_id) == ("done", 7)
    assert clear(host, 2) == 0
    assert "vented" in host.seen.status
    host.write({"mode": "vent"})
    host.write(HOLD)
    host.run(10.0, lambda: host.seen.state == "holding")
    assert host.seen.state == "holding"


@pytest.mark.parametrize("kpa", [5.0, 8.0, 11.0])
@pytest.mark.parametrize("release_s", [0.0, 0.2, 0.4, None])
def test_a_vent_of_a_pressed_balloon_is_no_blocked_tube(kpa, release_s):
    host = pressed(kpa).copied()
    host.write({"mode": "vent"})
    if release_s is not None:
        host.run(release_s)
        host.world.rig.hand.release()
    host.run(4.0, lambda: host.seen.state == "vented")
    assert host.seen.state == "vented"


@pytest.mark.parametrize(
    ("kpa", "force_n", "pressed_s", "released_s"),
    [(5.0, 1.7, 0.03, 0.88), (6.5, 2.1, 0.28, 0.88), (9.5, 2.5, 0.0, 0.9)],
)
def test_a_contact_that_lost_samples_hide_is_no_blocked_tube(kpa, force_n, pressed_s, released_s):
    host = Holding.at(kpa)
    host.world.line.noise.stalled = True
    host.run(pressed_s)
    host.world.rig.hand.press(force_n)
    host.run(0.8 - pressed_s)
    host.world.line.noise.stalled = False
    host.run(released_s - 0.8)
    host.world.rig.hand.release()
    host.run(5.0)
    assert list(host.instrument.faults) == [HostFault.LINK_LOST]


@pytest.mark.parametrize("kpa", [5.0, 8.0, 11.0])
@pytest.mark.parametrize("in_contact", [False, True])
def test_a_blocked_tube_is_found_by_the_vent_after_lost_samples(kpa, in_contact):
    host = pressed(kpa).copied() if in_contact else Holding.at(kpa)
    host.world.faults.inject("occluded")
    host.silence(0.5)
    host.run(2.0)
    assert list(host.instrument.faults) == [HostFault.LINK_LOST, Fault.OCCLUSION]


def test_without_the_proof_test_the_blocked_tube_stays_hidden_but_a_bit_says_so():
    host = Holding.at(proof_test_s=0.0)
    host.world.faults.inject("occluded")
    host.world.rig.hand.press(2.0)
    host.run(15)
    assert host.seen.force_n == 0.0
    assert {"holding", "proof_test_overdue"} <= host.seen.status
    assert "force_valid" in host.seen.status


def test_the_force_is_unavailable_for_less_than_a_second_and_no_contact_appears():
    host = Holding.at(proof_test_s=15.0).tested()
    host.run(1.0)
    host.forces.clear()
    host.run(20)
    missing = [t_s for t_s, force_n in host.forces if math.isnan(force_n)]
    assert 0.5 < len(missing) * 0.002 <= 1.0
    assert missing[-1] - missing[0] <= 1.0
    assert {force_n for _, force_n in host.forces if force_n == force_n} == {0.0}
    assert host.seen.contact_counter == 0


def test_a_test_shows_the_state_holding_with_function_check_and_without_a_valid_force():
    host = Holding.at()
    host.run(20, lambda: host.testing)
    host.run(0.1)
    assert host.seen.state == "holding"
    assert {"holding", "function_check"} <= host.seen.status
    assert not {"force_valid", "failure", "inflating", "out_of_range"} & host.seen.status
    host.tested()
    host.run(0.2)
    assert "function_check" not in host.seen.status


@cache
def begun_test():
    """Return an instrument at the begin of its second proof test, which tests copy."""
    host = Holding.at(proof_test_s=10.0).tested()
    host.run(20, lambda: host.testing)
    return host


#: Begin of a contact after the begin of the test, and the duration of the contact [s].
CONTACTS = [(delay_s, 2.0) for delay_s in (0.0, 0.02, 0.1, 0.2, 0.3, 0.36, 0.4, 0.5, 0.6, 0.7)]
CONTACTS += [(delay_s, 0.05) for delay_s in (0.0, 0.1, 0.3, 0.4, 0.6)]
CONTACTS += [(delay_s, 0.3) for delay_s in (0.02, 0.2, 0.36, 0.5, 0.7)]


@pytest.mark.parametrize(("delay_s", "press_s"), CONTACTS)
def test_a_contact_during_the_test_does_not_trip_and_its_force_is_true_afterwards(delay_s, press_s):
    host = begun_test().copied()
    host.run(delay_s + 1e-3)
    host.world.rig.hand.press(1.0)
    host.run(press_s)
    if press_s < 2:
        host.world.rig.hand.release()
    host.run(4.0)
    host.forces.clear()
    host.run(1.0)
    assert not host.instrument.tripped
    expected_n = 1.0 if press_s == 2.0 else 0.0
    mean_n = sum(force_n for _, force_n in host.forces) / len(host.forces)
    assert mean_n == pytest.approx(expected_n, abs=0.06)


def test_no_test_starts_in_a_contact():
    host = Holding.at(proof_test_s=10.0).tested()
    host.run(5)
    host.world.rig.hand.press(1.0)
    host.run(1)
    before = host.tests
    host.run(20)
    assert host.tests == before
    assert host.seen.force_n == pytest.approx(1.0, abs=0.1)
    host.world.rig.hand.release()
    host.run(5)
    assert host.tests == before + 1


def test_any_peer_can_forbid_the_test_and_the_bit_shows_it_after_ten_periods():
    host = Holding.at(proof_test_s=5.0).tested()
    host.write({"proof_test": "forbidden"}, ROBOT)
    host.write({"proof_test": "allowed"}, PLC)
    before = host.tests
    host.run(49)
    assert host.tests == before
    assert "proof_test_overdue" not in host.seen.status
    host.run(3)
    assert "proof_test_overdue" in host.seen.status
    assert host.seen.proof_test == "allowed"
    assert host.instrument.snapshot(ROBOT, host.now_s).proof_test == "forbidden"
    host.write({"proof_test": "allowed"}, ROBOT)
    host.run(5)
    assert host.tests == before + 1
    assert "proof_test_overdue" not in host.seen.status


@pytest.mark.parametrize("fault", ["no_supply", "inlet_shut"])
def test_a_pulse_without_gas_neither_passes_nor_trips(fault):
    host = Holding.at(proof_test_s=5.0).tested()
    host.world.faults.inject(fault)
    host.run(20)
    assert not host.instrument.tripped
    assert host.seen.proof_test_age_s > 15


def test_ten_tests_of_a_free_balloon_pass():
    host = Holding.at(proof_test_s=5.0)
    passed = []
    for _ in range(10):
        host.tested()
        host.run(0.01)
        passed.append(host.seen.proof_test_age_s < 0.1)
    assert all(passed)
    assert host.seen.contact_counter == 0


@pytest.mark.parametrize("force_n", [0.5, 1.0, 2.0])
def test_a_trip_by_a_contact_during_the_inflation_is_cleared_in_the_documented_order(force_n):
    host = VirtualHost(session=Session(Instrument(Settings())))
    host.world.rig.hand.plays_phases = False
    host.run(3.0)

    def hold_after_vent():
        host.session.write(PLC, {"mode": "vent"}, host.now_s)
        host.run(2.0)
        host.session.write(PLC, HOLD | {"setpoint_requested_kpa": 8.0}, host.now_s)

    hold_after_vent()
    host.run(0.6)
    host.world.rig.hand.press(force_n)
    host.run(5.0, lambda: host.instrument.tripped)
    assert host.instrument.snapshot(PLC, host.now_s).first_out_fault == Fault.OCCLUSION
    host.world.rig.hand.release()
    assert clear(host) == 0
    hold_after_vent()
    host.run(10.0, lambda: host.instrument.snapshot(PLC, host.now_s).state == "holding")
    assert host.instrument.snapshot(PLC, host.now_s).state == "holding"
