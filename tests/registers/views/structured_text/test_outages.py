"""Tests of the tutorial programs with a cable that is pulled while the master reads.

The master then reports no result for a write that waits, and sends this write when the cable is back.
"""

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuforce.registers.map import BY_NAME
from pneuforce.registers.views.st_pressure import pressure_block
from tests.registers.views.structured_text.controller import Controller
from tests.registers.views.structured_text.tutorials import TUTORIALS

STAGES = {name: int(code) for name, code in re.findall(r"^    (\w+) : INT := (\d+);", pressure_block(), re.M)}
INFLATION = ("REARM", "TAKE_LEASE", "SET_PRESSURE", "SET_FORCE_LIMIT", "INFLATE")
COMMAND = ("SEND_KEY", "SEND_CODE", "SEND_ARGUMENT", "SEND_SEQUENCE")
MODE, LEASE = BY_NAME["mode"].address, BY_NAME["lease"].address
KEY, SEQUENCE = BY_NAME["command_key"].address, BY_NAME["command_sequence"].address
#: Longest time between the last cycle with a request and its write. The master may have begun to send.
LATEST_S = 0.05

pytestmark = pytest.mark.usefixtures("blocks")
each_tutorial = pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda tutorial: tutorial.file)


class Watched(Controller):
    """Simulated PLC that rejects a late request to inflate."""

    requested_s = -1.0  #: time of the last cycle with fresh values and a request to inflate

    def cycle(self):
        written = len(self.written)
        super().cycle()
        if self.program["Reading.Fresh"] and self.program["Inflate"]:
            self.requested_s = self.harness.now_s
        for at_s, address, value in self.written[written:]:
            assert (address, value) != (MODE, 1) or at_s - self.requested_s <= LATEST_S

    def cut_in_a_read(self, stage):
        """Pull the cable when a write of this stage waits and the master reads."""
        for _ in range(300):
            self.cycle()
            waits = self.program["Pressure.Stage"] == STAGES[stage] and self.program["Pressure.Write"]
            if waits and self.program["Master.Phase"] in (1, 2):
                break
        else:
            pytest.fail(f"no write of the stage {stage} waits while the master reads")
        self.line_cut = True
        self.written.clear()
        return self

    def outage(self, seconds):
        """Let an outage last, and connect the cable again. A slow task makes the test short."""
        self.run(min(seconds, 1.0))
        self.cycle_s = 0.1
        self.run(seconds - min(seconds, 1.0))
        self.cycle_s = 0.01
        self.line_cut = False
        return self

    @property
    def writes(self):
        return [(address, value) for _, address, value in self.written]


def ready(tutorial, **options):
    return Watched(tutorial, **options).run(0.7)


@each_tutorial
@pytest.mark.parametrize(
    ("stage", "seconds"), [*((stage, 1.0) for stage in INFLATION), ("REARM", 20.0), ("INFLATE", 5.0)]
)
def test_an_outage_before_the_inflation_ends_the_request(tutorial, stage, seconds):
    plc = ready(tutorial).run(0.01, Inflate=1).cut_in_a_read(stage).outage(seconds)
    assert plc.program["Pressure.Ended"] == 1
    plc.run(1.5)
    assert plc.writes[0] == (MODE, 0)
    assert set(plc.writes) == {(MODE, 0), (LEASE, 0)}
    assert (plc.program["Reading.Fresh"], plc.program["Pressure.Ended"]) == (1, 1)
    assert plc.harness.snapshot().setpoint_kpa != 8.0


@each_tutorial
@pytest.mark.parametrize("seconds", [0.2, 5.0])
def test_a_request_that_ends_in_an_outage_is_not_sent(tutorial, seconds):
    plc = ready(tutorial).run(0.01, Inflate=1).cut_in_a_read("INFLATE")
    plc.run(0.1, Inflate=0).outage(seconds).run(1.0)
    assert plc.writes[:2] == [(MODE, 0), (MODE, 0)]
    assert (MODE, 1) not in plc.writes
    assert (plc.program["Pressure.Stage"], plc.program["Pressure.Ended"]) == (STAGES["IDLE"], 0)


@each_tutorial
def test_after_an_outage_a_new_request_inflates(tutorial):
    plc = ready(tutorial).run(0.01, Inflate=1).cut_in_a_read("INFLATE").outage(1.0).run(1.0)
    plc.run(0.1, Inflate=0).run(3.0, Inflate=1)
    assert (plc.state, plc.program["MayPush"]) == ("holding", 1)


@each_tutorial
@pytest.mark.parametrize(
    ("stage", "seconds"), [*((stage, 0.2) for stage in COMMAND), ("SEND_KEY", 5.0), ("SEND_SEQUENCE", 5.0)]
)
def test_a_command_that_is_withdrawn_in_an_outage_does_not_run(tutorial, stage, seconds):
    plc = ready(tutorial).run(0.01, ClearFaults=1).cut_in_a_read(stage)
    plc.run(0.1, ClearFaults=0).outage(seconds).run(1.0)
    assert {address for address, _ in plc.writes} == {KEY}
    assert plc.program["Pressure.Busy"] == 0
    plc.run(1.5, ClearFaults=1)
    assert plc.program["Pressure.CommandDone"] == 1


@each_tutorial
def test_a_vent_is_sent_instead_of_the_waiting_lease(tutorial):
    plc = ready(tutorial).run(3.0, Inflate=1)
    plc.cut_in_a_read("KEEP_HOLDING").run(0.1, Inflate=0).outage(0.2).run(1.0)
    assert plc.writes[0] == (MODE, 0)
    assert plc.state in ("venting", "vented")


def test_a_vent_is_repeated_if_the_master_had_begun_to_send_the_request_to_inflate():
    plc = ready(TUTORIALS[0]).run(0.01, Inflate=1)
    while plc.program["Pressure.Stage"] != STAGES["INFLATE"] or plc.program["Master.Phase"] != 3:
        plc.cycle()
    begun = plc.program["Pressure.Value"]
    plc.program["Inflate"] = 0
    plc.cycle()
    assert (begun, plc.program["Pressure.Value"]) == (1, 0)
    plc.run(1.0)
    assert plc.writes[-3:] == [(MODE, 0), (MODE, 0), (LEASE, 0)]


def test_a_setting_that_waits_during_an_outage_is_not_sent_with_its_old_value():
    plc = ready(TUTORIALS[0], extended=True).run(2.0).run(0.01, RobotMoves=1)
    plc.run(0.3)
    plc.program["RobotMoves"] = 0
    while not (plc.program["Settings.Writing"] and plc.program["Master.Phase"] in (1, 2)):
        plc.cycle()
    plc.line_cut = True
    plc.written.clear()
    plc.run(0.1, RobotMoves=1).outage(5.0).run(1.5)
    assert (BY_NAME["proof_test"].address, 0) not in plc.writes
    assert plc.read_proof_test() == "forbidden"


EVENTS = ("Inflate", "ClearFaults", "line")


@settings(max_examples=8)
@given(events=st.lists(st.tuples(st.sampled_from(EVENTS), st.floats(0.01, 1.2)), max_size=10))
def test_any_outages_never_delay_a_request_to_inflate(events):
    plc = ready(TUTORIALS[0])
    for event, wait_s in events:
        if event == "line":
            plc.line_cut = not plc.line_cut
        else:
            plc.program[event] = not plc.program[event]
        plc.run(wait_s)
