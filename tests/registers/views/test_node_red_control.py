"""Tests of the hold, the vent and the commands of the Node-RED flow, in virtual time."""

import struct

import pytest

from pneuforce.registers.advice import FAULT_ADVICE, REJECT_REASON_ADVICE
from pneuforce.registers.codes import STATES
from pneuforce.registers.map import BY_NAME, COMMAND_KEY
from pneuforce.registers.views.node_red_tables import LEASE_MS, TICK_MS
from tests.peers.clients.client import NEEDS_NODE
from tests.registers.views.node_red_nodes import HELD

pytestmark = NEEDS_NODE
LEASE, MODE = BY_NAME["lease"].address, BY_NAME["mode"].address
BUSY = {"message": "Modbus exception 6: Slave device busy"}
TIMEOUT = {"message": "Timed out"}


class Plant:
    """Flow and instrument: passes readings and answers to the function nodes, and collects their requests."""

    def __init__(self, nodes):
        self._nodes = nodes
        self._counter = 0
        self.notes = []
        self.vents = 0
        self.open = []  #: writes that were not answered
        self.renewals_answered = True
        self.order = "ABCD"
        self.codes = {**HELD, "state": STATES.codes["vented"]}

    def send(self, topic, **properties):
        """Send a message to the node "Control", and return the words of each write by its address."""
        writes, vents, notes = self._nodes.send("Control", topic, **properties)
        self.open += writes
        self.vents += len(vents)
        self.notes += [note["payload"] for note in notes]
        return [written(write) for write in writes]

    def tick(self, **codes):
        """Let a cycle pass in which the instrument has these codes. Return the writes."""
        self.codes |= codes
        writes = self.send("tick")
        self._answer_renewals()
        self._counter += 1
        for reading in self._nodes.read({**self.codes, "sample_counter": self._counter}, self.order):
            writes += self.send("reading", payload=reading)
        return writes

    def _answer_renewals(self):
        if self.renewals_answered and self.open and self.open[0]["topic"].startswith("renew"):
            self.answer()

    def answer(self, error=None):
        """Answer the oldest open write. Return the writes that follow."""
        write = self.open.pop(0)
        return self.send(write["topic"], payload="" if error else 0, **({"error": error} if error else {}))

    def state(self, name, **codes):
        """Let two cycles pass with a state of the instrument. Return the writes."""
        return [*self.tick(state=STATES.codes[name], **codes), *self.tick()]

    def hold(self):
        """Hold the balloon."""
        self.state("vented")
        assert self.send("hold") == [(LEASE, [LEASE_MS])]
        assert self.answer() == [(MODE, [0])]
        assert self.answer() == []
        assert len(self.state("vented")) == 1
        assert self.answer() == []
        self.state("inflating")
        self.state("holding")
        assert "held" in self.notes[-1]


def written(message):
    """Return the address and the words of a write."""
    request = message["payload"]
    words = request["value"] if request["fc"] == 16 else [request["value"]]
    assert request["quantity"] == len(words)
    return request["address"], words


def float_words(value, order="ABCD"):
    high, low = struct.unpack(">HH", struct.pack(">f", value))
    return [high, low] if order == "ABCD" else [low, high]


@pytest.fixture
def plant(nodes):
    return Plant(nodes)


@pytest.mark.parametrize("order", ["ABCD", "CDAB"])
def test_a_hold_takes_the_lease_vents_waits_and_inflates(plant, order):
    plant.order = order
    plant.state("venting")
    assert plant.send("setpoint", payload=6.5) == plant.send("force_limit", payload="3") == []
    assert plant.send("hold") == [(LEASE, [LEASE_MS])]
    assert plant.answer() == [(MODE, [0])]
    assert plant.answer() == []
    writes = (
        plant.state("venting") + plant.state("vented", status=8 | 1 << 16) + plant.state("vented", status=8)
    )
    request = writes.pop()
    assert set(map(str, writes)) <= {str((LEASE, [LEASE_MS]))}  # renewals
    assert request == (512, [*float_words(6.5, order), *float_words(3.0, order), 1, LEASE_MS])


def test_the_lease_is_renewed_only_while_the_instrument_can_be_read(plant):
    plant.hold()
    writes = []
    for _ in range(3 * LEASE_MS // TICK_MS):
        writes += plant.tick()
    assert writes == [(LEASE, [LEASE_MS])] * 9
    plant.renewals_answered = False
    writes = []
    for _ in range(LEASE_MS // TICK_MS + 1):
        writes += plant.send("tick")
        if plant.open:
            assert plant.answer(TIMEOUT) == []
    assert len(writes) <= 3  # only in the first second without a reading
    assert plant.vents == 1
    assert plant.send("tick") == []


def test_a_new_setpoint_is_written_at_once_while_the_balloon_is_held(plant):
    plant.hold()
    assert plant.send("setpoint", payload=5.5) == [(512, float_words(5.5))]
    assert plant.answer() == []
    assert plant.send("force_limit", payload=2) == [(514, float_words(2.0))]


@pytest.mark.parametrize("value", [1.9, 12.1, "high", None, "NaN"])
def test_a_setpoint_outside_its_range_is_not_sent(plant, value):
    plant.hold()
    assert plant.send("setpoint", payload=value) == []
    assert "must be 2 to 12 kPa" in plant.notes[-1]


def test_a_vent_stops_the_steps_and_follows_a_write_that_is_under_way(plant):
    plant.state("vented")
    plant.send("hold")
    assert plant.send("vent") == []
    assert plant.vents == 0  # the node "Vent" has got the same command
    assert plant.answer() == []
    assert plant.vents == 1
    assert plant.state("vented") == []
    plant.send("hold")
    assert "not accepted the vent" in plant.notes[-1]
    plant.send("vent note", accepted=True, payload="")
    assert plant.send("hold") == [(LEASE, [LEASE_MS])]


@pytest.mark.parametrize("error", [None, BUSY, TIMEOUT])
def test_a_vent_after_the_request_to_inflate_is_repeated_after_its_answer(plant, error):
    plant.state("vented")
    plant.send("hold")
    plant.answer()
    plant.answer()
    assert len(plant.state("vented")) == 1
    plant.send("vent")
    assert plant.answer(error) == []
    assert plant.vents == 1


def test_a_rejected_hold_shows_the_reason_and_vents(plant):
    plant.state("vented")
    plant.send("hold")
    plant.answer()
    plant.answer()
    plant.state("vented")
    assert plant.answer(BUSY) == []
    plant.tick(reject_reason=3)  # was read before the rejection
    plant.tick(reject_reason=7)
    assert REJECT_REASON_ADVICE["not_zeroed"] in plant.notes[-1]
    assert plant.vents == 1


def test_a_lease_of_another_client_prevents_the_vent(plant):
    plant.state("holding")
    plant.send("hold")
    plant.answer(BUSY)
    plant.state("holding", reject_reason=3)
    plant.tick()
    assert REJECT_REASON_ADVICE["lease"] in plant.notes[-1]
    assert plant.vents == 0


@pytest.mark.parametrize("answered", [False, True])
def test_the_request_to_inflate_is_never_repeated(plant, answered):
    plant.state("vented")
    plant.send("hold")
    plant.answer()
    plant.answer()
    plant.state("vented")
    if answered:
        plant.answer(TIMEOUT)
    writes = [write for _ in range(40) for write in plant.tick()]
    assert writes == []
    assert plant.vents == 1


@pytest.mark.parametrize("state", ["venting", "vented", "boot"])
def test_a_hold_that_another_client_ended_is_not_begun_again(plant, state):
    plant.hold()
    assert plant.state(state) == []
    assert plant.vents == 1
    assert "has ended" in plant.notes[-1]
    assert [write for _ in range(40) for write in plant.tick()] == []


def test_the_request_to_inflate_waits_for_the_answer_to_a_renewal(plant):
    plant.state("vented")
    plant.send("hold")
    plant.answer()
    plant.answer()
    plant.renewals_answered = False
    while not plant.open:
        plant.tick(state=STATES.codes["venting"])
    assert plant.state("vented") == []
    assert plant.answer() == []
    assert [address for address, _ in plant.tick()] == [512]


def test_a_new_setpoint_without_an_answer_is_sent_again(plant):
    plant.hold()
    plant.send("setpoint", payload=5.5)
    assert plant.answer(TIMEOUT) == []
    assert plant.tick() == [(512, float_words(5.5))]


def test_the_end_of_a_hold_during_a_renewal_vents_again_after_its_answer(plant):
    plant.hold()
    plant.renewals_answered = False
    while not plant.open:
        plant.tick()
    plant.state("venting")
    assert plant.vents == 1
    assert plant.answer() == []
    assert plant.vents == 2
    assert [write for _ in range(40) for write in plant.tick()] == []


def test_a_trip_shows_the_remedy_and_prevents_a_hold_until_the_faults_are_cleared(plant):
    plant.hold()
    plant.state("tripped", first_out_fault=11, status=1 << 27)
    assert FAULT_ADVICE[11].do in plant.notes[-1]
    plant.send("vent note", accepted=True, payload="")
    assert plant.send("hold") == []
    assert plant.send("clear") == [(520, [COMMAND_KEY, 2, 0, 0])]
    assert plant.answer() == []
    plant.state("tripped", answer_sequence=0, answer_state=1)
    plant.tick(answer_state=3, answer_result=5)
    assert REJECT_REASON_ADVICE["cause_persists"] in plant.notes[-1]
    assert plant.send("clear") == [(520, [COMMAND_KEY, 2, 0, 1])]
    plant.answer()
    plant.state("vented", answer_sequence=1, answer_state=2, answer_result=0, first_out_fault=0, status=8)
    assert plant.notes[-1] == "The faults are cleared."
    assert plant.send("hold") == [(LEASE, [LEASE_MS])]


def test_no_hold_begins_without_a_reading_of_this_register_map(plant):
    assert plant.send("hold") == []
    plant.state("vented", map_hash=1)
    assert plant.send("hold") == plant.send("clear") == []
    assert "register map" in plant.notes[-2]


def test_a_vent_is_repeated_until_it_is_accepted_and_then_ends_the_lease(nodes):
    ((vent,), _, _) = nodes.send("Vent", "vent")
    assert written(vent) == (MODE, [0])
    _, (note,), _ = nodes.send("Vent", vent["topic"], payload="", error=TIMEOUT)
    assert not note["accepted"]
    repeated = [message for _ in range(3) for message in nodes.send("Vent", "tick")[0]]
    assert list(map(written, repeated)) == [(MODE, [0])]
    assert nodes.send("Vent", vent["topic"], payload=0) == [[], [], []]  # answer to the first request
    ((lease,), _, _) = nodes.send("Vent", repeated[0]["topic"], payload=0)
    assert written(lease) == (LEASE, [0])
    _, (note,), _ = nodes.send("Vent", lease["topic"], payload="", error=BUSY)
    assert note["accepted"]
    assert [nodes.send("Vent", "tick") for _ in range(10)] == [[[], [], []]] * 10
