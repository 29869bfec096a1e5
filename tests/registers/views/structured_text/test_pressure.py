"""The writing block in its cycle, against the instrument itself, in virtual time."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from registers.codes import COMMANDS, REFUSALS, STATES
from registers.map import BY_NAME
from registers.modbus.bank import Bank
from registers.modbus.identity import Identity
from registers.modbus.pdu import Responder
from registers.source import Peer
from tests.instrument.driving import PLC, ROBOT, VENT, Drive
from tests.registers.modbus.serving import IDENTITY
from tests.registers.views.structured_text.compiled import PYTESTMARKS, Block
from tests.registers.views.structured_text.test_reading import words_of

pytestmark = [*PYTESTMARKS, pytest.mark.usefixtures("blocks")]
CYCLE_S = 0.01
OTHER = Peer("modbus_tcp", "10.0.0.2")
MODE, LEASE = BY_NAME["mode"].address, BY_NAME["lease"].address


class Master:
    """A PLC: its Modbus master with functions 04 and 06, the two blocks, and the instrument."""

    def __init__(self, drive):
        self.drive = drive
        self.responder = Responder(Bank(), drive.instrument, Identity(IDENTITY))
        self.reading, self.pressure = Block("PF_Reading"), Block("PF_Pressure")
        self.inputs, self.written = {}, []
        self.deaf = False  #: nobody answers
        self.lost = set()  #: addresses whose write is carried out and its answer lost

    def ask(self, request):
        return None if self.deaf else self.responder.answer(request, Peer(*PLC), self.drive.now_s)

    def read(self, address, count):
        answer = self.ask(struct.pack(">BHH", 4, address, count))
        return None if answer is None else words_of(answer[2:])

    def write(self):
        """Done, Error and ExceptionCode of the write that the block asks for."""
        address, value = int(self.pressure["Address"]), int(self.pressure["Value"])
        answer = self.ask(struct.pack(">BHH", 6, address, value))
        if answer is None or address in self.lost:
            return {"Done": 0, "Error": 1, "ExceptionCode": 0}
        refused = answer[0] > 0x80
        self.written.append((address, value, answer[1] if refused else 0))
        return {"Done": not refused, "Error": refused, "ExceptionCode": answer[1] if refused else 0}

    def cycle(self):
        self.drive.run(CYCLE_S)
        now_s = self.drive.now_s
        words, told = self.read(0, 36), self.read(524, 3)
        if words:
            self.reading.words(words)
        self.reading.cycle(now_s, CommunicationOk=words is not None)
        if told:
            self.inputs |= dict(zip(("AnswerSequence", "AnswerState", "AnswerResult"), told, strict=True))
        answer = self.write() if self.pressure["Write"] else {"Done": 0, "Error": 0}
        seen = {"State": self.reading["Values.State"], "Refusal": self.reading["Values.Refusal"]}
        self.pressure.cycle(now_s, Fresh=self.reading["Fresh"], **seen, **self.inputs, **answer)

    def run(self, seconds, **inputs):
        self.inputs |= inputs
        for _ in range(round(seconds / CYCLE_S)):
            self.cycle()
        return self

    @property
    def state(self):
        return STATES.names[int(self.reading["Values.State"])]

    @property
    def reason(self):
        return REFUSALS.names[int(self.pressure["Reason"])]

    def asked_to_hold(self):
        return [code for address, value, code in self.written if (address, value) == (MODE, 1)]


@pytest.fixture
def plc():
    return Master(Drive.zeroed()).run(0.3)


@pytest.fixture
def holding(plc):
    plc.run(2.0, Hold=True)
    assert plc.state == "holding"
    return plc


def test_it_vents_first_and_rests(plc):
    assert plc.written == [(MODE, 0, 0), (LEASE, 0, 0)]
    assert plc.run(1.0).written == [(MODE, 0, 0), (LEASE, 0, 0)]


def test_it_inflates_in_the_order_that_the_instrument_asks_for(plc):
    plc.run(2.0, Hold=True, Setpoint_kPa=6.5, ForceLimit_N=3.5)
    assert plc.written[2:7] == [(516, 0, 0), (517, 2000, 0), (544, 6500, 0), (545, 3500, 0), (516, 1, 0)]
    assert plc.pressure["Holding"] == 1
    assert plc.drive.see().setpoint_kpa == 6.5
    assert plc.drive.see().force_limit_n == 3.5


def test_it_renews_its_lease_and_asks_for_inflation_once(holding):
    holding.run(5.0)
    assert holding.state == "holding"
    assert holding.drive.see().lease_holder == "modbus_tcp"
    assert len(holding.asked_to_hold()) == 1


def test_a_new_setpoint_is_written_while_it_holds(holding):
    holding.run(1.5, Setpoint_kPa=9.0)
    assert holding.drive.see().setpoint_kpa == 9.0
    assert len(holding.asked_to_hold()) == 1


def test_it_vents_when_told_and_leaves_no_lease_behind(holding):
    holding.run(1.0, Hold=False)
    assert holding.state == "vented"
    assert holding.written[-2:] == [(MODE, 0, 0), (LEASE, 0, 0)]
    assert holding.run(4.0).state == "vented"


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1.99, 12.01, -8.0, 1e9])
def test_a_setpoint_out_of_span_is_not_written(plc, value):
    plc.run(1.0, Hold=True, Setpoint_kPa=value)
    assert (plc.pressure["SpanError"], plc.pressure["Ended"]) == (1, 1)
    assert len(plc.written) == 2
    assert plc.run(1.0, Setpoint_kPa=8.0).asked_to_hold() == []  # a wish does not wait


def test_a_setpoint_that_breaks_while_it_holds_leaves_the_old_one(holding):
    holding.run(1.0, Setpoint_kPa=float("nan"))
    assert holding.drive.see().setpoint_kpa == 8.0
    assert holding.state == "holding"


def trip(plc):
    plc.drive.latched.add(4)
    plc.run(0.5)
    assert plc.state == "tripped"


def test_after_a_trip_it_does_not_ask_again_until_cleared_and_told_anew(holding):
    trip(holding)
    holding.run(3.0)
    assert holding.pressure["Ended"] == 1
    assert len(holding.asked_to_hold()) == 1
    holding.run(0.2, Hold=False)
    holding.run(4.0, Hold=True)
    assert (holding.pressure["Refused"], holding.reason) == (1, "fault_latched")
    holding.run(0.5, Hold=False, Run=True, Command=COMMANDS.codes["clear_faults"])
    assert holding.pressure["CommandDone"] == 1
    holding.run(2.0, Hold=True, Run=False)
    assert holding.pressure["Holding"] == 1


def test_a_clear_whose_answer_is_lost_is_repeated_and_runs_once(holding):
    trip(holding)
    before = holding.drive.instrument.command().clear
    holding.lost = {523}
    holding.run(0.3, Hold=False, Run=True)
    assert holding.pressure["CommandDone"] == 0
    holding.lost = set()
    holding.run(0.5)
    assert holding.pressure["CommandDone"] == 1
    assert holding.drive.instrument.command().clear == before + 1


def test_a_command_that_is_withdrawn_before_anybody_answered_does_not_run_later(holding):
    trip(holding)
    holding.lost = {520}
    holding.run(0.3, Hold=False, Run=True)
    holding.lost = set()
    holding.run(1.0, Run=False)
    assert 523 not in [address for address, *_ in holding.written]
    assert holding.state == "tripped"


def test_a_clear_while_the_cause_lasts_fails_with_the_reason(holding):
    holding.drive.causes.add(4)
    trip(holding)
    holding.run(2.0, Hold=False, Run=True)
    assert (holding.pressure["CommandFailed"], holding.reason) == (1, "cause_persists")


def test_an_operators_vent_ends_the_hold(holding):
    assert holding.drive.write(VENT, OTHER) == "none"
    holding.run(5.0)
    assert holding.state == "vented"
    assert holding.pressure["Ended"] == 1
    assert len(holding.asked_to_hold()) == 1
    assert holding.drive.see().lease_holder == "none"


def test_anothers_lease_is_a_refusal_with_its_reason(plc):
    plc.drive.must({"lease_s": 60.0}, ROBOT)
    plc.run(5.0, Hold=True)
    assert (plc.pressure["Refused"], plc.reason, plc.pressure["Ended"]) == (1, "lease", 1)
    assert plc.asked_to_hold() == []
    written = len(plc.written)
    assert len(plc.run(1.0).written) == written


def test_a_master_that_loses_its_line_is_vented_by_the_lease_and_does_not_inflate_when_it_is_back(holding):
    holding.deaf = True
    holding.run(4.0)
    assert holding.drive.see().state == "tripped"
    holding.deaf = False
    holding.run(3.0)
    assert holding.pressure["Ended"] == 1
    assert len(holding.asked_to_hold()) == 1


def test_a_request_to_inflate_whose_answer_is_lost_is_not_repeated_but_vented(plc):
    plc.lost = {LEASE}
    plc.run(0.5, Hold=True)
    plc.lost = set()
    plc.run(2.0)
    assert plc.pressure["Ended"] == 1
    assert plc.asked_to_hold() == []
    assert plc.state == "vented"


def test_a_wish_of_before_the_connection_inflates_nothing_when_it_comes(plc):
    plc.deaf = True
    plc.run(1.0, Hold=True)
    plc.deaf = False
    plc.run(3.0)
    assert plc.asked_to_hold() == []
    plc.run(0.1, Hold=False)
    assert plc.run(2.0, Hold=True).pressure["Holding"] == 1


def test_a_reading_that_stands_still_lets_the_lease_run_out(holding):
    image = holding.read(0, 36)
    holding.read = lambda address, count: image if address == 0 else None
    holding.run(0.6)
    written = len(holding.written)
    holding.run(3.0)
    assert len(holding.written) == written
    assert holding.drive.see().state == "tripped"


def test_no_program_inflates_by_its_first_cycle():
    plc = Master(Drive.zeroed()).run(3.0, Hold=True)
    assert plc.asked_to_hold() == []
    assert plc.pressure["Ended"] == 1


def test_a_program_loaded_anew_while_its_switch_is_on_vents_and_waits_for_the_switch(holding):
    holding.pressure, holding.written = Block("PF_Pressure"), []
    holding.run(3.0)
    assert holding.asked_to_hold() == []
    assert holding.state == "vented"


HAPPENINGS = {
    "the switch is turned": lambda plc: plc.inputs.update(Hold=not plc.inputs.get("Hold", False)),
    "faults are cleared": lambda plc: plc.inputs.update(Run=not plc.inputs.get("Run", False)),
    "the line is cut or mended": lambda plc: setattr(plc, "deaf", not plc.deaf),
    "another vents": lambda plc: plc.drive.write(VENT, OTHER),
    "the board trips": lambda plc: plc.drive.latched.add(4),
    "answers get lost": lambda plc: setattr(plc, "lost", set() if plc.lost else {MODE, LEASE, 544, 523}),
}
course = st.lists(st.tuples(st.sampled_from(sorted(HAPPENINGS)), st.floats(0.02, 1.5)), max_size=12)


@given(course=course)
@settings(max_examples=25, deadline=None)
def test_whatever_happens_it_asks_for_inflation_once_for_each_turn_of_the_switch_and_can_always_vent(course):
    plc = Master(Drive.zeroed()).run(0.3)
    turned_on = 0
    for happening, wait_s in course:
        HAPPENINGS[happening](plc)
        turned_on += happening == "the switch is turned" and plc.inputs["Hold"]
        plc.run(wait_s)
        assert len(plc.asked_to_hold()) <= turned_on
    plc.deaf, plc.lost = False, set()
    plc.run(4.0, Hold=False, Run=False)
    assert plc.state in ("vented", "tripped")
    assert plc.drive.see().lease_holder == "none"
