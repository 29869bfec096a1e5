"""Tests of the function block PF_Pressure with the instrument, in virtual time."""

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneuforce.registers.codes import COMMANDS, REJECT_REASONS, STATES
from pneuforce.registers.map import BY_NAME
from pneuforce.registers.modbus.device_identification import DeviceIdentification
from pneuforce.registers.modbus.pdu import RequestHandler
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.source import Peer
from tests.instrument.instrument_harness import PLC, ROBOT, VENT, InstrumentHarness
from tests.registers.modbus.serving import IDENTITY
from tests.registers.views.structured_text.blocks import Block
from tests.registers.views.structured_text.test_reading import words_of

pytestmark = pytest.mark.usefixtures("blocks")
CYCLE_S = 0.01
OTHER = Peer("modbus_tcp", "10.0.0.2")
MODE, LEASE = BY_NAME["mode"].address, BY_NAME["lease"].address


class Master:
    """Simulated PLC: Modbus master with functions 04 and 06, the two blocks, and the instrument."""

    def __init__(self, harness):
        self.harness = harness
        self.request_handler = RequestHandler(
            RegisterBank(), harness.instrument, DeviceIdentification(IDENTITY)
        )
        self.reading, self.pressure = Block("PF_Reading"), Block("PF_Pressure")
        self.writer = self.pressure  #: the block whose writes are carried out
        self.inputs, self.written = {}, []
        self.line_cut = False  #: if True, no request is answered
        self.lost = set()  #: addresses whose writes are carried out, but whose answers are lost

    def request(self, request):
        return None if self.line_cut else self.request_handler.answer(request, Peer(*PLC), self.harness.now_s)

    def read(self, address, count):
        answer = self.request(struct.pack(">BHH", 4, address, count))
        return None if answer is None else words_of(answer[2:])

    def write(self):
        """Carry out the write that `writer` requests. Return Done, Error and ExceptionCode."""
        address, value = int(self.writer["Address"]), int(self.writer["Value"])
        answer = self.request(struct.pack(">BHH", 6, address, value))
        if answer is None or address in self.lost:
            return {"Done": 0, "Error": 1, "ExceptionCode": 0}
        rejected = answer[0] > 0x80
        self.written.append((address, value, answer[1] if rejected else 0))
        return {"Done": not rejected, "Error": rejected, "ExceptionCode": answer[1] if rejected else 0}

    def cycle(self):
        self.harness.run(CYCLE_S)
        now_s = self.harness.now_s
        words, answer_words = self.read(0, 36), self.read(524, 3)
        if words:
            self.reading.words(words)
        self.reading.cycle(now_s, CommunicationOk=words is not None)
        if answer_words:
            self.inputs |= dict(
                zip(("AnswerSequence", "AnswerState", "AnswerResult"), answer_words, strict=True)
            )
        answer = self.write() if self.writer["Write"] else {"Done": 0, "Error": 0}
        seen = {"Fresh": self.reading["Fresh"], "RejectReason": self.reading["Values.RejectReason"]}
        self.run_blocks(now_s, seen | answer)

    def run_blocks(self, now_s, values):
        """Run the blocks that write. `values` are the inputs that all these blocks have."""
        self.pressure.cycle(now_s, State=self.reading["Values.State"], **values, **self.inputs)

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
        return REJECT_REASONS.names[int(self.pressure["Reason"])]

    def hold_requests(self):
        return [code for address, value, code in self.written if (address, value) == (MODE, 1)]


@pytest.fixture
def plc():
    return Master(InstrumentHarness.zeroed()).run(0.3)


@pytest.fixture
def holding(plc):
    plc.run(2.0, Hold=True)
    assert plc.state == "holding"
    return plc


def test_the_block_vents_first_and_then_writes_nothing(plc):
    assert plc.written == [(MODE, 0, 0), (LEASE, 0, 0)]
    assert plc.run(1.0).written == [(MODE, 0, 0), (LEASE, 0, 0)]


def test_the_block_inflates_in_the_required_order(plc):
    plc.run(2.0, Hold=True, Setpoint_kPa=6.5, ForceLimit_N=3.5)
    assert plc.written[2:7] == [(516, 0, 0), (517, 2000, 0), (544, 6500, 0), (545, 3500, 0), (516, 1, 0)]
    assert plc.pressure["Holding"] == 1
    assert plc.harness.snapshot().setpoint_kpa == 6.5
    assert plc.harness.snapshot().force_limit_n == 3.5


def test_the_block_renews_its_lease_and_requests_inflation_once(holding):
    holding.run(5.0)
    assert holding.state == "holding"
    assert holding.harness.snapshot().lease_holder == "modbus_tcp"
    assert len(holding.hold_requests()) == 1


def test_a_new_setpoint_is_written_while_holding(holding):
    holding.run(1.5, Setpoint_kPa=9.0)
    assert holding.harness.snapshot().setpoint_kpa == 9.0
    assert len(holding.hold_requests()) == 1


def test_a_new_force_limit_is_written_while_holding(holding):
    holding.run(0.5, ForceLimit_N=2.5)
    assert holding.harness.snapshot().force_limit_n == 2.5
    assert holding.state == "holding"


def test_only_the_lease_is_written_again_while_nothing_changes(holding):
    holding.run(0.5, Setpoint_kPa=9.0, ForceLimit_N=2.5)
    before = len(holding.written)
    holding.run(3.0)
    assert {address for address, *_ in holding.written[before:]} == {LEASE}
    assert 5 <= len(holding.written) - before <= 6


def test_holding_is_shown_only_while_values_are_fresh_and_the_balloon_is_held(holding):
    assert holding.pressure["Holding"] == 1
    holding.line_cut = True
    holding.run(0.02)
    assert holding.pressure["Holding"] == 0
    holding.line_cut = False
    holding.run(0.1)
    assert holding.pressure["Holding"] == 1
    holding.run(0.02, Hold=False)
    assert holding.pressure["Holding"] == 0


@pytest.mark.parametrize(
    ("name", "value", "in_range"),
    [
        ("Setpoint_kPa", 2.0, True),
        ("Setpoint_kPa", 12.0, True),
        ("ForceLimit_N", 0.1, True),
        ("ForceLimit_N", 20.0, True),
        ("ForceLimit_N", 0.09, False),
        ("ForceLimit_N", 20.1, False),
        ("Lease_ms", 200, True),
        ("Lease_ms", 60000, True),
        ("Lease_ms", 199, False),
        ("Lease_ms", 60001, False),
    ],
)
def test_the_limits_of_the_inputs_are_those_of_the_registers(name, value, in_range):
    block = Block("PF_Pressure").cycle(0.0, **{name: value})
    assert block["RangeError"] == (not in_range)


def test_the_block_vents_on_request_and_releases_the_lease(holding):
    holding.run(1.0, Hold=False)
    assert holding.state == "vented"
    assert holding.written[-2:] == [(MODE, 0, 0), (LEASE, 0, 0)]
    assert holding.run(4.0).state == "vented"


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1.99, 12.01, -8.0, 1e9])
def test_a_setpoint_out_of_range_is_not_written(plc, value):
    plc.run(1.0, Hold=True, Setpoint_kPa=value)
    assert (plc.pressure["RangeError"], plc.pressure["Ended"]) == (1, 1)
    assert len(plc.written) == 2
    assert plc.run(1.0, Setpoint_kPa=8.0).hold_requests() == []  # the request is not postponed


def test_an_invalid_setpoint_while_holding_keeps_the_old_one(holding):
    holding.run(1.0, Setpoint_kPa=float("nan"))
    assert holding.harness.snapshot().setpoint_kpa == 8.0
    assert holding.state == "holding"


def trip(plc):
    plc.harness.latched.add(4)
    plc.run(0.5)
    assert plc.state == "tripped"


def test_after_a_trip_the_block_inflates_only_after_clearing_and_a_new_request(holding):
    trip(holding)
    holding.run(3.0)
    assert holding.pressure["Ended"] == 1
    assert len(holding.hold_requests()) == 1
    holding.run(0.2, Hold=False)
    holding.run(4.0, Hold=True)
    assert (holding.pressure["Rejected"], holding.reason) == (1, "fault_latched")
    holding.run(0.5, Hold=False, Run=True, Command=COMMANDS.codes["clear_faults"])
    assert holding.pressure["CommandDone"] == 1
    holding.run(2.0, Hold=True, Run=False)
    assert holding.pressure["Holding"] == 1


def test_a_clear_command_with_a_lost_answer_is_repeated_and_runs_once(holding):
    trip(holding)
    before = holding.harness.instrument.command().clear
    holding.lost = {523}
    holding.run(0.3, Hold=False, Run=True)
    assert holding.pressure["CommandDone"] == 0
    holding.lost = set()
    holding.run(0.5)
    assert holding.pressure["CommandDone"] == 1
    assert holding.harness.instrument.command().clear == before + 1


def test_a_command_that_is_cancelled_before_an_answer_does_not_run_later(holding):
    trip(holding)
    holding.lost = {520}
    holding.run(0.3, Hold=False, Run=True)
    holding.lost = set()
    holding.run(1.0, Run=False)
    assert 523 not in [address for address, *_ in holding.written]
    assert holding.state == "tripped"


def test_a_clear_command_fails_with_a_reason_while_the_cause_persists(holding):
    holding.harness.causes.add(4)
    trip(holding)
    holding.run(2.0, Hold=False, Run=True)
    assert (holding.pressure["CommandFailed"], holding.reason) == (1, "cause_persists")


def test_a_command_that_succeeds_shows_no_reason_of_an_earlier_rejection(holding):
    trip(holding)
    holding.run(0.2, Hold=False)
    holding.run(4.0, Hold=True)
    assert holding.reason == "fault_latched"
    holding.run(0.5, Hold=False, Run=True)
    assert (holding.pressure["CommandDone"], holding.pressure["Rejected"], holding.reason) == (1, 0, "none")


def test_the_sequence_number_of_a_command_wraps():
    block = Block("PF_Pressure")
    sent = {}
    answers = {"AnswerSequence": 0xFFFF, "AnswerState": 0, "AnswerResult": 0}
    for cycle in range(40):
        write = bool(block["Write"])
        if write:
            sent[int(block["Address"])] = int(block["Value"])
        block.cycle(cycle * CYCLE_S, Fresh=True, State=6, Run=cycle > 10, Done=write, Error=0, **answers)
    assert sent[523] == 0


def changed(plc, changes):
    """Let the PLC read `changes` (address: word, or None for no answer) instead of the true registers."""
    read = plc.read

    def read_changed(address, count):
        words = read(address, count)
        if address in changes:
            return changes[address]
        return [changes.get(address + at, word) for at, word in enumerate(words)]

    plc.read = read_changed
    return read


def test_a_command_without_an_answer_fails_after_3_s(plc):
    changed(plc, {524: None})
    assert plc.run(2.8, Run=True).pressure["CommandFailed"] == 0
    assert plc.run(0.4).pressure["CommandFailed"] == 1
    assert plc.pressure["CommandDone"] == 0


def command_ends(plc, seconds, **inputs):
    """Run the PLC, and return CommandDone and CommandFailed of each cycle."""
    plc.inputs |= inputs
    ends = []
    for _ in range(round(seconds / CYCLE_S)):
        plc.cycle()
        ends.append((int(plc.pressure["CommandDone"]), int(plc.pressure["CommandFailed"])))
    return ends


def test_the_result_of_a_command_stays_until_run_falls(holding):
    trip(holding)
    assert command_ends(holding, 1.0, Hold=False, Run=True)[-50:] == [(1, 0)] * 50
    assert command_ends(holding, 0.2, Run=False) == [(0, 0)] * 20
    holding.harness.causes.add(4)
    trip(holding)
    assert command_ends(holding, 2.0, Run=True)[-50:] == [(0, 1)] * 50
    assert command_ends(holding, 0.2, Run=False) == [(0, 0)] * 20


def test_the_result_of_a_sent_command_is_shown_for_one_cycle_if_run_has_fallen(plc):
    read = changed(plc, {524: None})
    plc.run(0.5, Run=True).run(0.5, Run=False)
    plc.read = read
    ends = command_ends(plc, 0.5)
    assert (ends.count((1, 0)), ends.count((0, 0))) == (1, len(ends) - 1)


def test_a_sent_command_without_an_answer_fails_for_one_cycle_if_run_has_fallen(plc):
    changed(plc, {524: None})
    plc.run(0.5, Run=True)
    ends = command_ends(plc, 4.0, Run=False)
    assert (ends.count((0, 1)), ends.count((0, 0))) == (1, len(ends) - 1)


def test_a_cancelled_command_fails_for_one_cycle(holding):
    trip(holding)
    holding.lost = {520}
    holding.run(0.3, Hold=False, Run=True)
    assert command_ends(holding, 1.0, Run=False) == [(0, 1)] + [(0, 0)] * 99


def test_after_a_rejected_command_the_next_one_runs(plc):
    plc.harness.write_ok({"lease_s": 60.0}, ROBOT)
    plc.run(1.0, Run=True)
    assert (plc.pressure["CommandFailed"], plc.reason) == (1, "lease")
    plc.harness.write_ok({"lease_s": 0.0}, ROBOT)
    plc.run(0.1, Run=False).run(0.5, Run=True)
    assert (plc.pressure["CommandDone"], plc.pressure["CommandFailed"]) == (1, 0)


def test_a_hold_that_does_not_inflate_ends_after_3_s(plc):
    changed(plc, {25: STATES.codes["vented"]})
    assert plc.run(2.8, Hold=True).pressure["Ended"] == 0
    assert plc.harness.snapshot().state == "holding"
    assert plc.run(1.0).pressure["Ended"] == 1
    assert plc.harness.snapshot().state == "vented"


def test_a_rejected_hold_without_a_reason_ends_after_3_s(plc):
    plc.harness.write_ok({"lease_s": 60.0}, ROBOT)
    changed(plc, {27: 0})
    assert plc.run(2.8, Hold=True).pressure["Ended"] == 0
    plc.run(0.5)
    assert (plc.pressure["Ended"], plc.pressure["Rejected"], plc.reason) == (1, 1, "none")


def test_a_vent_by_an_operator_ends_the_hold(holding):
    assert holding.harness.write(VENT, OTHER) == "none"
    holding.run(5.0)
    assert holding.state == "vented"
    assert holding.pressure["Ended"] == 1
    assert len(holding.hold_requests()) == 1
    assert holding.harness.snapshot().lease_holder == "none"


def test_the_lease_of_another_peer_is_a_reject_reason(plc):
    plc.harness.write_ok({"lease_s": 60.0}, ROBOT)
    plc.run(5.0, Hold=True)
    assert (plc.pressure["Rejected"], plc.reason, plc.pressure["Ended"]) == (1, "lease", 1)
    assert plc.hold_requests() == []
    written = len(plc.written)
    assert len(plc.run(1.0).written) == written


def test_a_cut_line_vents_by_the_lease_and_its_return_does_not_inflate(holding):
    holding.line_cut = True
    holding.run(4.0)
    assert holding.harness.snapshot().state == "tripped"
    holding.line_cut = False
    holding.run(3.0)
    assert holding.pressure["Ended"] == 1
    assert len(holding.hold_requests()) == 1


def test_a_lost_answer_before_inflation_vents_and_nothing_is_repeated(plc):
    plc.lost = {LEASE}
    plc.run(0.5, Hold=True)
    plc.lost = set()
    plc.run(2.0)
    assert plc.pressure["Ended"] == 1
    assert plc.hold_requests() == []
    assert plc.state == "vented"


def test_a_request_before_the_connection_does_not_inflate_later(plc):
    plc.line_cut = True
    plc.run(1.0, Hold=True)
    plc.line_cut = False
    plc.run(3.0)
    assert plc.hold_requests() == []
    plc.run(0.1, Hold=False)
    assert plc.run(2.0, Hold=True).pressure["Holding"] == 1


def test_old_values_let_the_lease_expire(holding):
    image = holding.read(0, 36)
    holding.read = lambda address, count: image if address == 0 else None
    holding.run(0.6)
    written = len(holding.written)
    holding.run(3.0)
    assert len(holding.written) == written
    assert holding.harness.snapshot().state == "tripped"


def test_hold_in_the_first_cycle_does_not_inflate():
    plc = Master(InstrumentHarness.zeroed()).run(3.0, Hold=True)
    assert plc.hold_requests() == []
    assert plc.pressure["Ended"] == 1


def test_a_reloaded_program_vents_and_waits_for_a_new_request(holding):
    holding.pressure = holding.writer = Block("PF_Pressure")
    holding.written = []
    holding.run(3.0)
    assert holding.hold_requests() == []
    assert holding.state == "vented"


EVENTS = {
    "hold is switched": lambda plc: plc.inputs.update(Hold=not plc.inputs.get("Hold", False)),
    "faults are cleared": lambda plc: plc.inputs.update(Run=not plc.inputs.get("Run", False)),
    "the line is cut or repaired": lambda plc: setattr(plc, "line_cut", not plc.line_cut),
    "another peer vents": lambda plc: plc.harness.write(VENT, OTHER),
    "the board trips": lambda plc: plc.harness.latched.add(4),
    "answers are lost": lambda plc: setattr(plc, "lost", set() if plc.lost else {MODE, LEASE, 544, 523}),
}
event_lists = st.lists(st.tuples(st.sampled_from(sorted(EVENTS)), st.floats(0.02, 1.5)), max_size=12)


@given(events=event_lists)
@settings(max_examples=12)
def test_any_events_cause_at_most_one_hold_request_per_switch_and_a_vent_always_works(events):
    plc = Master(InstrumentHarness.zeroed()).run(0.3)
    switched_on = 0
    for event, wait_s in events:
        EVENTS[event](plc)
        switched_on += event == "hold is switched" and plc.inputs["Hold"]
        plc.run(wait_s)
        assert len(plc.hold_requests()) <= switched_on
    plc.line_cut, plc.lost = False, set()
    plc.run(4.0, Hold=False, Run=False)
    assert plc.state in ("vented", "tripped")
    assert plc.harness.snapshot().lease_holder == "none"
