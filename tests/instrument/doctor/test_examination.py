"""Tests of the doctor's examination on the simulated rig, without a fault and with each fault."""

import re

import pytest

from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.peers import Peers
from pneuforce.instrument.core.reject_reason import REMEDIES, RejectReason
from pneuforce.instrument.doctor import check, circuit, port, signal
from pneuforce.instrument.doctor.causes import CAUSES, INFLATED, LINE, causes_of
from pneuforce.instrument.doctor.check import CheckResult
from pneuforce.instrument.doctor.circuit import circuit_checks
from pneuforce.instrument.doctor.examination import Examination, ExaminationStage
from pneuforce.instrument.doctor.signal import SLOW_CLOCK, board_checks, inflation_obstacle, signal_checks
from pneuforce.instrument.rig.firmware import Firmware
from pneuforce.protocol.frames import Fault, Hello, Valve
from pneuforce.sim.faults import FaultInjector
from pneuforce.sim.plants.published import PublishedPlant
from tests.instrument.instrument_harness import FOREIGN_FIRMWARE, OUR_FIRMWARE
from tests.sim.station import Station

OBSERVE_S, LEAK_TEST_S = 3.0, 4.0
#: First word of each advice.
VERBS = "(check|clean|cut|install|end|look|open|reduce|replace|run|set|stop|use|write|flash) "


class ExaminedRig(Station):
    """Simulated rig with an instrument and an examination."""

    def __init__(self, inflate_kpa=None, fault=None, arguments=None):
        super().__init__(PublishedPlant())
        self.faults = FaultInjector(self.world)
        if fault:
            self.faults.inject(fault, arguments)
        self.run(1.0)
        self.start_examination(inflate_kpa)
        process = self.instrument.process
        self.instrument.process = lambda raw: (process(raw), self.examination.on_sample(self.now_s))

    def start_examination(self, inflate_kpa=None):
        self.examination = Examination(
            self.instrument, self.link, inflation_obstacle, inflate_kpa, OBSERVE_S, LEAK_TEST_S
        )

    def step(self):
        super().step()
        if hasattr(self, "examination") and self._steps % 5 == 0:
            self.examination.tick(self.now_s)

    def examined(self, stage=ExaminationStage.DONE):
        assert self.run(60.0, lambda: self.examination.stage is stage)
        return self

    @property
    def checks(self):
        checks = [*signal_checks(self.examination), *circuit_checks(self.examination)]
        return {check.name: check for check in checks}

    @property
    def results(self):
        return {name: check.result for name, check in self.checks.items()}


def test_a_healthy_rig_passes_all_checks_of_the_signal_and_no_valve_moves():
    rig = ExaminedRig().examined()
    circuit = {"filling", "settling", "leak", "inlet valve", "venting"}
    assert {name for name, v in rig.results.items() if v is CheckResult.NOT_CHECKED} == circuit
    assert {v for name, v in rig.results.items() if name not in circuit} == {CheckResult.PASS}
    assert {sample.valves for sample in rig.examination.samples} == {Valve.NONE}


@pytest.mark.parametrize("setpoint_kpa", [5.0, 8.0, 11.0])
def test_a_healthy_circuit_passes_and_is_vented_afterwards(setpoint_kpa):
    rig = ExaminedRig(setpoint_kpa).examined()
    assert set(rig.results.values()) == {CheckResult.PASS}
    assert rig.world.rig.truth.balloon_kpa < 0.4
    assert not rig.instrument.holding


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
def test_a_fault_of_the_signal_is_found(fault, arguments, check):
    results = ExaminedRig(None, fault, arguments).examined().results
    assert results[check] in {CheckResult.FAIL, CheckResult.WARNING}


@pytest.mark.parametrize(
    ("fault", "check"), [("stall", "gaps"), ("line_cut", "gaps"), ("board_reset", "faults")]
)
def test_a_fault_during_the_observation_is_found(fault, check):
    rig = ExaminedRig()
    rig.run(1.0)
    rig.faults.inject(fault)
    assert rig.examined().results[check] is CheckResult.FAIL


@pytest.mark.parametrize(
    ("fault", "arguments", "stage", "check"),
    [
        ("no_supply", {}, ExaminationStage.ZEROING, "filling"),
        ("inlet_shut", {}, ExaminationStage.ZEROING, "filling"),
        ("regulator_high", {}, ExaminationStage.ZEROING, "filling"),
        ("leak", {"kpa_per_s": 0.03}, ExaminationStage.LEAK_TEST, "leak"),
        ("burst", {}, ExaminationStage.LEAK_TEST, "leak"),
        ("inlet_open", {}, ExaminationStage.LEAK_TEST, "leak"),
        ("vent_shut", {}, ExaminationStage.LEAK_TEST, "venting"),
        ("occluded", {}, ExaminationStage.LEAK_TEST, "venting"),
    ],
)
def test_a_fault_of_the_circuit_is_found_and_the_examination_ends(fault, arguments, stage, check):
    rig = ExaminedRig(8.0).examined(stage)
    rig.faults.inject(fault, arguments)
    rig.examined()
    assert rig.results[check] is CheckResult.FAIL
    assert not rig.instrument.holding


def repaired_rig(fault, stage, inflate_kpa):
    """Return a rig of which a fault was removed after a trip, and whose board was not reset afterwards."""
    rig = ExaminedRig(8.0).examined(stage)
    rig.faults.inject(fault)
    rig.examined()
    rig.faults.remove(fault)
    assert rig.run(10.0, lambda: rig.instrument.vented(rig.now_s))
    rig.instrument.peers = Peers()
    rig.start_examination(inflate_kpa)
    return rig


def test_a_latched_fault_whose_cause_is_gone_is_cleared_and_the_circuit_is_tested():
    rig = repaired_rig("sensor_open", ExaminationStage.OBSERVING, 8.0)
    assert rig.instrument.tripped
    results = rig.examined().results
    assert results.pop("faults") is CheckResult.WARNING
    assert set(results.values()) == {CheckResult.PASS}
    assert "cleared" in rig.checks["faults"].finding


def test_a_cause_that_ends_shortly_after_the_start_does_not_count_as_present():
    rig = ExaminedRig(None, "sensor_open")
    rig.run(0.6)
    assert rig.examination.faults_before
    rig.faults.remove("sensor_open")
    assert "cleared now" in rig.examined().checks["faults"].finding


def test_each_advice_begins_with_what_to_do(monkeypatch):
    advices = [advice.removeprefix(INFLATED) for advice in CAUSES.values()]

    def graded(name, finding, advice, **results):
        advices.append(advice.removeprefix(INFLATED))
        return check.graded(name, finding, advice, **results)

    for module in (circuit, port, signal):
        monkeypatch.setattr(module, "graded", graded)
    assert ExaminedRig(8.0).examined().checks
    board_checks(Hello(0, OUR_FIRMWARE.version, 400, 7, 250, 2000), OUR_FIRMWARE, 1.0)
    port.port_checks("/dev/tty")
    advices += [signal.SLOW_CLOCK, circuit.INLET_ADVICE, port.INSTALL_RULES]
    assert len(advices) > 30
    assert [advice for advice in advices if advice and not re.match(VERBS, advice)] == []


def test_a_rig_with_a_fault_that_is_present_is_not_inflated():
    rig = ExaminedRig(8.0, "sensor_open").examined()
    assert rig.results["faults"] is CheckResult.FAIL
    assert "a cause is present" in rig.checks["faults"].finding
    assert rig.results["filling"] is CheckResult.NOT_CHECKED
    assert {sample.valves for sample in rig.examination.samples} == {Valve.NONE}


def test_a_rig_whose_vent_had_failed_is_inflated_only_in_the_next_examination():
    rig = repaired_rig("vent_shut", ExaminationStage.LEAK_TEST, 8.0)
    assert rig.examined().results["faults"] is CheckResult.FAIL
    assert {sample.valves for sample in rig.examination.samples} == {Valve.NONE}
    rig.start_examination(8.0)
    assert set(rig.examined().results.values()) == {CheckResult.PASS}


def touched():
    """Return a rig whose balloon is pressed during the leak test."""
    rig = ExaminedRig(8.0).examined(ExaminationStage.LEAK_TEST)
    rig.run(1.0)
    rig.world.rig.hand.press(1.0)
    return rig


@pytest.mark.parametrize(
    ("setpoint_kpa", "leak_kpa_per_s", "result"),
    [
        (5.0, 0.002, CheckResult.PASS),
        (5.0, 0.02, CheckResult.WARNING),
        (5.0, 0.05, CheckResult.FAIL),
        (8.0, 0.01, CheckResult.WARNING),
        (8.0, 0.03, CheckResult.FAIL),
        (11.0, 0.02, CheckResult.WARNING),
    ],
)
def test_top_ups_during_the_leak_test_do_not_hide_the_leak(setpoint_kpa, leak_kpa_per_s, result, monkeypatch):
    monkeypatch.setattr(f"{__name__}.LEAK_TEST_S", 20.0)
    rig = ExaminedRig(setpoint_kpa, "leak", {"kpa_per_s": leak_kpa_per_s}).examined()
    check = rig.checks["leak"]
    fallen_kpa = float(re.match(r"falls by (\d\.\d+) kPa in 20 s", check.finding)[1])
    assert 10 * leak_kpa_per_s <= fallen_kpa <= 25 * leak_kpa_per_s
    assert check.result is result
    assert ("without the gas of" in check.finding) == (leak_kpa_per_s >= 0.01)
    assert rig.results["inlet valve"] is CheckResult.PASS


def test_a_touched_balloon_is_not_a_leak_and_the_user_should_run_the_check_again():
    rig = touched()
    rig.run(1.0)
    rig.world.rig.hand.release()
    check = rig.examined().checks["leak"]
    assert check.result is CheckResult.NOT_CHECKED
    assert re.fullmatch(r"the balloon was pressed \(\+0\.\d\d kPa\)", check.finding)
    assert check.advice.startswith("remove the contact and run")


@pytest.mark.parametrize("kpa_per_s", [0.02, 0.03, 0.1])
def test_a_leaking_inlet_valve_fails_although_its_rise_looks_like_a_contact(kpa_per_s):
    rig = ExaminedRig(5.0, "inlet_leak", {"kpa_per_s": kpa_per_s}).examined()
    check = rig.checks["inlet valve"]
    assert check.result is CheckResult.FAIL
    assert "rises steadily by" in check.finding
    assert "the closed inlet valve leaks" in check.advice
    assert rig.results["leak"] is CheckResult.NOT_CHECKED


def test_a_slow_rise_without_contact_does_not_hide_the_check_of_the_vent():
    rig = ExaminedRig(5.0, "inlet_leak", {"kpa_per_s": 0.006}).examined()
    assert rig.results["inlet valve"] is CheckResult.WARNING
    assert rig.results["venting"] is CheckResult.PASS


def test_the_vent_is_not_checked_if_the_balloon_is_pressed():
    results = touched().examined().results
    assert {results[name] for name in ("leak", "inlet valve", "venting")} == {CheckResult.NOT_CHECKED}
    assert results["filling"] is results["settling"] is CheckResult.PASS


def test_a_closed_vent_fails_even_if_the_balloon_is_pressed():
    rig = touched()
    rig.faults.inject("vent_shut")
    assert rig.examined().results["venting"] is CheckResult.FAIL


class SlowRig(ExaminedRig):
    """Rig that runs 3 % slower than the host, like an emulated board on an overloaded machine."""

    @property
    def now_s(self):
        return 1000.0 + 1.03 * self.world.now_s


def test_a_wrong_rate_without_lost_samples_does_not_blame_the_cable():
    check = SlowRig().examined().checks["samples"]
    assert (check.result, check.advice) == (CheckResult.WARNING, SLOW_CLOCK)


@pytest.mark.parametrize(("kept", "finding"), [(0, "0 samples"), (1, "1 sample"), (2, "2 samples")])
def test_the_number_of_samples_has_its_noun_in_words(kept, finding):
    examination = ExaminedRig().examined().examination
    observed = examination.samples_of(ExaminationStage.OBSERVING)
    examination.samples = observed[:kept]
    assert signal_checks(examination)[0].finding == finding


def test_a_link_that_is_lost_later_fails_the_check_of_the_gaps():
    rig = ExaminedRig(5.0).examined(ExaminationStage.LEAK_TEST)
    rig.faults.inject("line_cut")
    assert rig.examined().results["gaps"] is CheckResult.FAIL


def test_the_zero_of_a_rig_that_tripped_for_another_reason_is_not_checked():
    assert ExaminedRig(None, "supply_low").examined().results["sensor zero"] is CheckResult.NOT_CHECKED


@pytest.mark.parametrize(
    ("fault", "named", "advice"),
    [
        ("no_supply", "no rise", "the gas supply"),
        ("regulator_high", "occlusion", "THE BALLOON MAY BE INFLATED"),
    ],
)
def test_an_unreached_setpoint_names_the_fault_and_the_part_to_check(fault, named, advice):
    check = ExaminedRig(8.0, fault).examined().checks["filling"]
    assert check.finding == f"8 kPa were not reached: {named}"
    assert advice in check.advice


def test_a_leak_test_that_the_link_interrupts_does_not_blame_the_balloon():
    rig = ExaminedRig(5.0).examined(ExaminationStage.LEAK_TEST)
    rig.run(1.0)
    rig.faults.inject("line_cut")
    check = rig.examined().checks["leak"]
    assert check.finding == "was not held for 4 s: link lost"
    assert check.advice == LINE


@pytest.mark.parametrize(
    ("inflate_kpa", "fault"),
    [(8.0, "no_supply"), (5.0, "sensor_open"), (5.0, "supply_low"), (5.0, "vent_shut"), (5.0, "leak")],
)
def test_each_check_that_has_not_passed_says_what_to_do(inflate_kpa, fault):
    checks = ExaminedRig(inflate_kpa, fault).examined().checks.values()
    not_passed = {CheckResult.FAIL, CheckResult.WARNING}
    assert not_passed & {check.result for check in checks}
    assert [check for check in checks if check.result in not_passed and not check.advice] == []


def test_a_rejected_inflation_gives_the_advice_for_its_reject_reason():
    examination = ExaminedRig(5.0).examined().examination
    examination.samples = [s for s in examination.samples if s.stage is not ExaminationStage.FILLING]
    for reason, finding, code in (
        (RejectReason.NONE, "the sensor has no zero", RejectReason.NOT_ZEROED),
        (RejectReason.IN_CONTACT, "rejected: in_contact", RejectReason.IN_CONTACT),
    ):
        examination.reject_reason = reason
        check = circuit_checks(examination)[0]
        assert (check.finding, check.advice) == (finding, REMEDIES[code])


#: Faults that cannot occur, because an examination uses no lease, no force limit and no CAN master.
IMPOSSIBLE = {HostFault.LEASE_EXPIRED, HostFault.FORCE_LIMIT, HostFault.CAN_MASTER_LOST}


@pytest.mark.parametrize("fault", [*list(Fault)[1:], *set(HostFault) - IMPOSSIBLE])
def test_each_fault_has_a_part_to_check(fault):
    assert causes_of([fault])


@pytest.mark.parametrize(
    ("rate", "result"), [(1.004, CheckResult.PASS), (0.993, CheckResult.WARNING), (1.015, CheckResult.FAIL)]
)
def test_a_resonator_passes_within_half_a_percent_and_fails_beyond_one_percent(rate, result):
    assert ExaminedRig(None, "clock_off", {"rate": rate}).examined().results["board clock"] is result


@pytest.mark.parametrize(
    ("firmware", "result", "named"),
    [
        (OUR_FIRMWARE, CheckResult.PASS, f"image {OUR_FIRMWARE.image_crc:08X}"),
        (
            FOREIGN_FIRMWARE,
            CheckResult.WARNING,
            "image DEADBEEF: the image on the board is not a released image",
        ),
        (Firmware(0x100, None), CheckResult.WARNING, "firmware 1.0, no image reported"),
    ],
)
def test_a_firmware_that_is_not_that_of_this_package_is_a_warning(firmware, result, named):
    check = board_checks(Hello(0, firmware.version, 400, 7, 250, 2000), firmware, 2.1)[1]
    assert (check.name, check.result) == ("firmware", result)
    assert named in check.finding
    assert ("pneuforce flash" in check.advice) == (result is CheckResult.WARNING)


def test_a_board_that_booted_after_the_port_was_opened_was_reset_by_the_opening():
    def reset_result(uptime_ms, since_opened_s):
        return board_checks(
            Hello(0, OUR_FIRMWARE.version, uptime_ms, 7, 250, 2000), OUR_FIRMWARE, since_opened_s
        )[2].result

    assert reset_result(400, 2.1) is CheckResult.WARNING
    assert reset_result(60_000, 0.1) is CheckResult.PASS
