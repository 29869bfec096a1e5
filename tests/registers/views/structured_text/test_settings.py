"""Tests of the function block PF_Settings with PF_Pressure and the instrument, in virtual time."""

import math

import pytest

from pneuforce.registers.codes import REJECT_REASONS
from pneuforce.registers.map import BY_NAME
from tests.instrument.instrument_harness import ROBOT, InstrumentHarness
from tests.registers.views.structured_text.blocks import Block
from tests.registers.views.structured_text.test_pressure import Master

pytestmark = pytest.mark.usefixtures("blocks")
PROOF_TEST, REFERENCE = BY_NAME["proof_test"].address, BY_NAME["reference_pressure_pa"].address
ALARM_2 = [BY_NAME[name].address for name in ("force_limit_2_mn", "alarm_hysteresis_mn", "alarm_delay")]
SETTINGS = {PROOF_TEST, REFERENCE, *ALARM_2}
NAN = float("nan")


class Plc(Master):
    """Simulated PLC with both blocks. The master writes what PF_Settings requests."""

    def __init__(self, **settings):
        super().__init__(InstrumentHarness.zeroed(**settings))
        self.settings = self.writer = Block("PF_Settings")
        self.given = {}  #: inputs of PF_Settings

    def run_blocks(self, now_s, values):
        super().run_blocks(now_s, values | {"Wait": self.settings["Writing"]})
        outputs = {f"Pressure{name}": self.pressure[name] for name in ("Busy", "Write", "Address", "Value")}
        vented = self.reading["Status.Vented"]
        self.settings.cycle(now_s, Vented=vented, **values, **outputs, **self.given)

    def set(self, seconds, **given):
        """Run with other inputs of PF_Settings. Return the settings that were written."""
        self.given |= given
        before = len(self.written)
        self.run(seconds)
        return [written for written in self.written[before:] if written[0] in SETTINGS]

    @property
    def setting_reason(self):
        return REJECT_REASONS.names[int(self.settings["Reason"])]


@pytest.fixture
def plc():
    return Plc().run(0.5)


def test_without_inputs_only_the_proof_test_is_allowed_once(plc):
    assert plc.written == [(516, 0, 0), (517, 0, 0), (PROOF_TEST, 0, 0)]
    assert plc.set(2.0) == []


def test_the_writes_of_the_pressure_block_are_unchanged(plc):
    plc.run(2.0, Hold=True, Setpoint_kPa=6.5, ForceLimit_N=3.5)
    assert plc.written[3:8] == [(516, 0, 0), (517, 2000, 0), (544, 6500, 0), (545, 3500, 0), (516, 1, 0)]
    assert plc.state == "holding"
    plc.run(5.0)
    assert plc.state == "holding"
    plc.run(1.0, Hold=False)
    assert plc.written[-2:] == [(516, 0, 0), (517, 0, 0)]


def test_proof_tests_are_forbidden_while_holding_and_allowed_again(plc):
    plc.run(2.0, Hold=True)
    assert plc.set(0.3, ForbidProofTest=True) == [(PROOF_TEST, 1, 0)]
    assert plc.set(0.3, ForbidProofTest=False) == [(PROOF_TEST, 0, 0)]
    assert plc.state == "holding"


def test_the_second_alarm_is_written_once_for_each_change(plc):
    given = {"WriteAlarm2": True, "ForceLimit2_N": 4.0, "AlarmHysteresis_N": 0.2, "AlarmDelay_ms": 150}
    limit, hysteresis, delay = ALARM_2
    assert plc.set(1.0, **given) == [(limit, 4000, 0), (hysteresis, 200, 0), (delay, 150, 0)]
    snapshot = plc.harness.snapshot()
    assert (snapshot.force_limit_2_n, snapshot.alarm_hysteresis_n, snapshot.alarm_delay_s) == (4.0, 0.2, 0.15)
    assert plc.set(0.5, AlarmHysteresis_N=0.3) == [(hysteresis, 300, 0)]
    assert plc.set(0.5, AlarmDelay_ms=10) == [(delay, 10, 0)]
    assert plc.set(0.5, ForceLimit2_N=5.0) == [(limit, 5000, 0)]
    assert plc.set(0.5, WriteAlarm2=False, ForceLimit2_N=6.0, AlarmHysteresis_N=0.0, AlarmDelay_ms=0) == []


def test_the_reference_is_written_while_vented_when_it_changes(plc):
    given = {"WriteReference": True, "ReferencePressure_kPa": 1.6}
    assert plc.set(1.0, **given) == [(REFERENCE, 1600, 0)]
    assert plc.harness.snapshot().reference_pressure_kpa == 1.6
    assert plc.set(1.0, ReferencePressure_kPa=-0.5) == [(REFERENCE, 0x10000 - 500, 0)]
    assert plc.harness.snapshot().reference_pressure_kpa == -0.5
    plc.run(2.0, Hold=True)
    assert plc.state == "holding"
    assert plc.set(1.0, ReferencePressure_kPa=1.0) == []
    plc.run(1.2, Hold=False)
    assert plc.written[-1] == (REFERENCE, 1000, 0)
    assert plc.harness.snapshot().reference_pressure_kpa == 1.0
    assert plc.set(1.0, WriteReference=False, ReferencePressure_kPa=2.0) == []


def test_a_monitored_reference_is_written_again_and_again_in_each_state():
    plc = Plc(reference_timeout_s=0.5).run(0.5)
    given = {"WriteReference": True, "ReferenceMonitored": True, "ReferencePressure_kPa": 1.5}
    assert 4 <= len(plc.set(1.0, **given)) <= 5
    plc.run(2.0, Hold=True)
    assert plc.state == "holding"
    assert math.isfinite(plc.harness.snapshot().force_n)
    assert 4 <= len(plc.set(1.0)) <= 5
    assert plc.set(1.0, ReferencePressure_kPa=NAN) == []
    assert not math.isfinite(plc.harness.snapshot().force_n)


@pytest.mark.parametrize(
    ("name", "value", "in_range"),
    [
        ("ReferencePressure_kPa", -1.0, True), ("ReferencePressure_kPa", -1.01, False),
        ("ReferencePressure_kPa", 3.0, True), ("ReferencePressure_kPa", 3.01, False),
        ("ForceLimit2_N", 0.1, True), ("ForceLimit2_N", 0.09, False),
        ("ForceLimit2_N", 20.0, True), ("ForceLimit2_N", 20.1, False),
        ("AlarmHysteresis_N", 0.0, True), ("AlarmHysteresis_N", -0.01, False),
        ("AlarmHysteresis_N", 10.0, True), ("AlarmHysteresis_N", 10.1, False),
        ("AlarmDelay_ms", 10000, True), ("AlarmDelay_ms", 10001, False),
        ("ReferencePressure_kPa", NAN, False), ("ForceLimit2_N", NAN, False),
        ("AlarmHysteresis_N", NAN, False),
    ],
)  # fmt: skip
def test_the_limits_of_the_inputs_are_those_of_the_registers(name, value, in_range):
    enable = "WriteReference" if name == "ReferencePressure_kPa" else "WriteAlarm2"
    block = Block("PF_Settings").cycle(0.0, **{name: value, enable: True})
    assert block["RangeError"] == (not in_range)
    assert block.cycle(0.01, **{enable: False})["RangeError"] == 0


@pytest.mark.parametrize("given", [{"WriteReference": True, "ReferencePressure_kPa": NAN},
                                   {"WriteAlarm2": True, "ForceLimit2_N": NAN}])  # fmt: skip
def test_an_invalid_setting_is_not_written(plc, given):
    assert plc.set(1.0, **given) == []
    assert plc.settings["RangeError"] == 1


def test_all_settings_are_written_again_after_an_interruption(plc):
    given = {"WriteAlarm2": True, "WriteReference": True, "ReferencePressure_kPa": 1.0}
    first = plc.set(1.0, ForbidProofTest=True, **given)
    assert {address for address, *_ in first} == SETTINGS
    plc.line_cut = True
    assert plc.set(1.0) == []
    plc.line_cut = False
    assert sorted(plc.set(8.0)) == sorted(first)


def test_a_rejected_setting_shows_its_reason_and_is_repeated_after_5_s(plc):
    plc.harness.write_ok({"lease_s": 60.0}, ROBOT)
    assert plc.set(4.8, ForbidProofTest=True) == [(PROOF_TEST, 1, 6)]
    assert (plc.settings["Rejected"], plc.settings["RejectedAddress"]) == (1, PROOF_TEST)
    assert plc.setting_reason == "lease"
    plc.harness.write_ok({"lease_s": 0.0}, ROBOT)
    assert plc.set(0.5) == [(PROOF_TEST, 1, 0)]
    assert plc.settings["Rejected"] == 0
    assert plc.set(2.0, ForbidProofTest=False) == [(PROOF_TEST, 0, 0)]


def test_a_lost_answer_is_no_rejection_and_the_write_is_repeated_after_5_s(plc):
    plc.lost = {PROOF_TEST}
    plc.set(1.0, ForbidProofTest=True)
    assert plc.read(PROOF_TEST, 1) == [1]
    assert plc.settings["Rejected"] == 0
    plc.lost = set()
    assert plc.set(3.5) == []
    assert plc.set(1.0) == [(PROOF_TEST, 1, 0)]


def test_a_vent_follows_a_setting_in_progress_and_a_rejected_hold_keeps_its_reason(plc):
    plc.run(2.0, Hold=True)
    plc.set(0.02, ForbidProofTest=True)
    plc.run(0.2, Hold=False)
    assert plc.harness.snapshot().state in ("venting", "vented")
    plc.run(1.0)
    plc.harness.write_ok({"lease_s": 60.0}, ROBOT)
    plc.run(3.0, Hold=True)
    assert (plc.pressure["Rejected"], plc.reason) == (1, "lease")


def test_no_setting_is_written_between_the_writes_of_an_inflation(plc):
    for _ in range(30):
        plc.set(0.01, ForbidProofTest=not plc.given.get("ForbidProofTest"))
    begin = len(plc.written)
    plc.inputs["Hold"] = True
    for _ in range(60):
        plc.set(0.01, ForbidProofTest=not plc.given["ForbidProofTest"])
    addresses = [address for address, *_ in plc.written[begin:]]
    at = addresses.index(517)
    assert addresses[at - 1 : at + 4] == [516, 517, 544, 545, 516]
    plc.set(0.3, ForbidProofTest=True)
    assert plc.harness.snapshot().state == "settling" or plc.state == "holding"
