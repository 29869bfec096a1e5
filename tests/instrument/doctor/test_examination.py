"""The examination on the simulated rig, in virtual time: a healthy one, and with each fault put in."""

import re

import pytest

from instrument.doctor.causes import LINE, causes_of
from instrument.doctor.check import Verdict
from instrument.doctor.circuit import circuit_checks
from instrument.doctor.examination import Examination, Stage
from instrument.doctor.signal import LATE, board_checks, signal_checks
from instrument.faults import HostFault
from instrument.rig.frames import Fault, Hello, Valve
from sim.faults import Faults
from sim.published import PublishedPlant
from tests.sim.station import Station

LISTEN_S, LEAK_S = 3.0, 4.0


class Ward(Station):
    """A station whose rig is examined."""

    def __init__(self, inflate_kpa=None, fault=None, arguments=None):
        super().__init__(PublishedPlant())
        self.faults = Faults(self.world)
        if fault:
            self.faults.put_in(fault, arguments)
        self.run(1.0)
        self.begin(inflate_kpa)
        take = self.instrument.take
        self.instrument.take = lambda raw: (take(raw), self.examination.on_sample(self.now_s))

    def begin(self, inflate_kpa=None):
        self.examination = Examination(self.instrument, self.link, inflate_kpa, LISTEN_S, LEAK_S)

    def step(self):
        super().step()
        if hasattr(self, "examination") and self._steps % 5 == 0:
            self.examination.tick(self.now_s)

    def examined(self, stage=Stage.DONE):
        assert self.run(60.0, lambda: self.examination.stage is stage)
        return self

    @property
    def checks(self):
        checks = [*signal_checks(self.examination), *circuit_checks(self.examination)]
        return {check.name: check for check in checks}

    @property
    def verdicts(self):
        return {name: check.verdict for name, check in self.checks.items()}


def test_a_healthy_rig_is_good_in_all_that_was_looked_at_and_no_valve_has_moved():
    ward = Ward().examined()
    circuit = {"filling", "settling", "leak", "venting"}
    assert {name for name, v in ward.verdicts.items() if v is Verdict.NOT_CHECKED} == circuit
    assert {v for name, v in ward.verdicts.items() if name not in circuit} == {Verdict.GOOD}
    assert {row.valves for row in ward.examination.rows} == {Valve.NONE}


@pytest.mark.parametrize("setpoint_kpa", [5.0, 8.0, 11.0])
def test_a_healthy_circuit_is_good_and_vented_afterwards(setpoint_kpa):
    ward = Ward(setpoint_kpa).examined()
    assert set(ward.verdicts.values()) == {Verdict.GOOD}
    assert ward.world.rig.truth.balloon_kpa < 0.4
    assert not ward.instrument.holding


@pytest.mark.parametrize(
    ("fault", "arguments", "check"),
    [
        ("sensor_open", {}, "sensor"),
        ("sensor_short", {}, "sensor"),
        ("board_frozen", {}, "sensor"),
        ("sensor_drift", {"kpa": 1.5}, "sensor zero"),
        ("supply_low", {}, "supply"),
        ("supply_high", {}, "supply"),
        ("clock_off", {"rate": 1.007}, "board clock"),
        ("clock_off", {"rate": 0.993}, "board clock"),
        ("dropped_bytes", {"share": 0.001}, "samples"),
        ("flipped_bits", {}, "samples"),
    ],
)
def test_what_is_wrong_with_the_signal_is_found(fault, arguments, check):
    verdicts = Ward(None, fault, arguments).examined().verdicts
    assert verdicts[check] in {Verdict.BAD, Verdict.DOUBTFUL}


@pytest.mark.parametrize(
    ("fault", "check"), [("stall", "gaps"), ("line_cut", "gaps"), ("board_reset", "faults")]
)
def test_what_happens_while_it_listens_is_found(fault, check):
    ward = Ward()
    ward.run(1.0)
    ward.faults.put_in(fault)
    assert ward.examined().verdicts[check] is Verdict.BAD


@pytest.mark.parametrize(
    ("fault", "arguments", "stage", "check"),
    [
        ("no_supply", {}, Stage.ZEROING, "filling"),
        ("inlet_shut", {}, Stage.ZEROING, "filling"),
        ("regulator_high", {}, Stage.ZEROING, "filling"),
        ("leak", {"kpa_per_s": 0.03}, Stage.LEAKING, "leak"),
        ("burst", {}, Stage.LEAKING, "leak"),
        ("inlet_open", {}, Stage.LEAKING, "leak"),
        ("vent_shut", {}, Stage.LEAKING, "venting"),
        ("occluded", {}, Stage.LEAKING, "venting"),
    ],
)
def test_what_is_wrong_with_the_circuit_is_found_and_it_ends(fault, arguments, stage, check):
    ward = Ward(8.0).examined(stage)
    ward.faults.put_in(fault, arguments)
    ward.examined()
    assert ward.verdicts[check] is Verdict.BAD
    assert not ward.instrument.holding


def touched():
    """A ward where a hand presses the balloon that should only be held."""
    ward = Ward(8.0).examined(Stage.LEAKING)
    ward.run(1.0)
    ward.world.rig.hand.press(1.0)
    return ward


def test_a_balloon_that_is_touched_is_no_leak_and_asked_for_again():
    ward = touched()
    ward.run(1.0)
    ward.world.rig.hand.release()
    check = ward.examined().checks["leak"]
    assert check.verdict is Verdict.NOT_CHECKED
    assert re.fullmatch(r"the balloon was pressed \(\+0\.\d\d kPa\)", check.found)
    assert check.advice.startswith("let go and run it again")


def test_a_balloon_that_is_vented_while_pressed_says_nothing_of_the_vent():
    verdicts = touched().examined().verdicts
    assert {verdicts[name] for name in ("leak", "venting")} == {Verdict.NOT_CHECKED}
    assert verdicts["filling"] is verdicts["settling"] is Verdict.GOOD


def test_a_vent_that_is_shut_is_bad_though_the_balloon_is_pressed():
    ward = touched()
    ward.faults.put_in("vent_shut")
    assert ward.examined().verdicts["venting"] is Verdict.BAD


class Slow(Ward):
    """A board that takes 3 % more of the host's time, as an emulated one on a busy machine."""

    @property
    def now_s(self):
        return 1000.0 + 1.03 * self.world.now_s


def test_a_rate_that_is_off_though_nothing_was_lost_is_no_cable():
    check = Slow().examined().checks["samples"]
    assert (check.verdict, check.advice) == (Verdict.DOUBTFUL, LATE)


def test_a_link_that_was_lost_later_stands_in_the_gaps():
    ward = Ward(5.0).examined(Stage.LEAKING)
    ward.faults.put_in("line_cut")
    assert ward.examined().verdicts["gaps"] is Verdict.BAD


def test_the_zero_of_a_rig_that_has_tripped_for_another_reason_is_not_judged():
    assert Ward(None, "supply_low").examined().verdicts["sensor zero"] is Verdict.NOT_CHECKED


@pytest.mark.parametrize(
    ("fault", "named", "advice"),
    [
        ("no_supply", "no rise", "the gas supply"),
        ("regulator_high", "occlusion", "THE BALLOON MAY BE INFLATED"),
    ],
)
def test_a_setpoint_that_is_not_reached_says_why_and_what_to_look_at(fault, named, advice):
    check = Ward(8.0, fault).examined().checks["filling"]
    assert check.found == f"8 kPa were not reached: {named}"
    assert advice in check.advice


def test_a_leak_test_that_was_cut_short_by_the_line_does_not_blame_the_balloon():
    ward = Ward(5.0).examined(Stage.LEAKING)
    ward.run(1.0)
    ward.faults.put_in("line_cut")
    check = ward.examined().checks["leak"]
    assert check.found == "was not held for 4 s: link lost"
    assert check.advice == LINE


#: A face of the host has no lease, no force limit and no CAN master to run into.
NOT_MET = {HostFault.LEASE_EXPIRED, HostFault.FORCE_LIMIT, HostFault.CAN_MASTER_LOST}


@pytest.mark.parametrize("fault", [*list(Fault)[1:], *set(HostFault) - NOT_MET])
def test_for_each_fault_there_is_something_to_look_at(fault):
    assert causes_of([fault])


@pytest.mark.parametrize(
    ("rate", "verdict"), [(1.004, Verdict.GOOD), (0.993, Verdict.DOUBTFUL), (1.015, Verdict.BAD)]
)
def test_a_resonator_is_good_within_half_a_percent_and_bad_beyond_one(rate, verdict):
    assert Ward(None, "clock_off", {"rate": rate}).examined().verdicts["board clock"] is verdict


def test_a_board_that_booted_after_its_port_was_opened_was_reset_by_that():
    def verdict(uptime_ms, since_opened_s):
        return board_checks(Hello(0, 0x100, uptime_ms, 7, 250, 2000), since_opened_s)[1].verdict

    assert verdict(400, 2.1) is Verdict.DOUBTFUL
    assert verdict(60_000, 0.1) is Verdict.GOOD
