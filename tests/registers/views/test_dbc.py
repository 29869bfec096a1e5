"""The DBC read by somebody else's reader, strictly, and held against the frames that the node sends."""

import math
import re
from typing import get_type_hints

import cantools
import pytest
from hypothesis import given
from hypothesis import strategies as st

from instrument.snapshot import Snapshot
from registers.can.frames import FRAMES, encode
from registers.codes import CONDENSED, STATUS
from registers.map import REGISTERS
from registers.views import dbc

DBC = cantools.database.load_string(dbc.render(), "dbc", strict=True)
FIELDS = [(frame, field) for frame in FRAMES for field in frame.fields]
ENUMERATED = {register.quantity: register.values for register in REGISTERS if register.values}
CONDITIONS = sorted({bit.name for bits in (STATUS, CONDENSED) for bit in bits.bits})

each_field = pytest.mark.parametrize(
    ("frame", "field"), FIELDS, ids=[f"{frame.name}-{field.name}" for frame, field in FIELDS]
)
each_frame = pytest.mark.parametrize("frame", FRAMES, ids=lambda frame: frame.name)

floats = st.floats(-40.0, 70.0) | st.just(math.nan) | st.sampled_from([math.inf, -math.inf, 1e9, -1e9])


def _values_of(quantity, type_):
    if quantity in ENUMERATED:
        return st.sampled_from(sorted(ENUMERATED[quantity].codes))
    if quantity == "status":
        return st.frozensets(st.sampled_from(CONDITIONS))
    if quantity == "faults":
        return st.lists(st.integers(1, 40), max_size=3, unique=True).map(tuple)
    return floats if type_ is float else st.integers(0, 2**33)


snapshots = st.builds(
    Snapshot, **{name: _values_of(name, type_) for name, type_ in get_type_hints(Snapshot).items()}
)


@st.composite
def own_values(draw, frame):
    """Values of the fields that a frame does not take from a snapshot."""
    return {
        field.name: draw(
            st.sampled_from(sorted(field.values.codes))
            if field.values
            else st.integers(field.low or 0, field.largest if field.high is None else field.high)
        )
        for field in frame.fields
        if not field.quantity
    }


def _signals(frame):
    return {signal.name: signal for signal in DBC.get_message_by_name(frame.name).signals}


@each_frame
@given(data=st.data())
def test_every_frame_sent_decodes_to_the_snapshot_that_it_was_rendered_from(frame, data):
    snapshot, own = data.draw(snapshots), data.draw(own_values(frame))
    decoded = DBC.decode_message(frame.base_id + 5, encode(frame, snapshot, **own))
    for field in frame.fields:
        value = own[field.name] if field.name in own else getattr(snapshot, field.quantity)
        if field.bits:
            names = {bit.name for bit in field.bits.bits}
            assert {name for name in names if decoded[name]} == value & names
        elif field.values:
            assert decoded[field.name] == value
        elif not field.unit:
            code = value % (field.wire.highest + 1)
            assert decoded[field.name] == field.code_names.get(code, code)
        elif value != value and not frame.received:
            assert decoded[field.name] == ("not_available" if field.not_available else field.largest / 1e3)
        elif value == value:
            lowest, greatest = field.wire.lowest / field.scale, field.largest / field.scale
            assert float(decoded[field.name]) == pytest.approx(
                min(max(value, lowest), greatest), abs=0.5001 / field.scale
            )


@each_field
def test_a_span_leaves_out_the_code_of_no_value(frame, field):
    if field.not_available is None:
        return
    signal = _signals(frame)[field.name]
    assert signal.maximum < field.not_available / field.scale
    assert signal.unit == {"mN": "N", "Pa": "kPa", "µm": "mm"}[field.unit]
    if not frame.received:
        assert signal.choices[int(field.not_available)] == "not_available"
        assert signal.initial == "not_available"  # what a tool shows before the first frame


@each_field
def test_each_value_has_its_name_and_each_signal_its_comment(frame, field):
    signals = _signals(frame)
    if field.code_names:
        assert {code: str(name) for code, name in signals[field.name].choices.items()} == field.code_names
    for name in [bit.name for bit in field.bits.bits] if field.bits else [field.name]:
        assert signals[name].comment
        assert signals[name].byte_order == "little_endian"


@each_frame
def test_a_message_has_identifier_length_sender_and_cycle_time(frame):
    message = DBC.get_message_by_name(frame.name)
    assert (message.frame_id, message.length) == (frame.base_id + 5, frame.length)
    assert message.senders == (["Controller"] if frame.received else ["PneuForce"])
    assert (message.cycle_time or 0) == frame.period_s * 1e3
    assert message.comment


def test_a_reader_encodes_a_command_in_si_units_and_is_held_to_its_span():
    command = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 1.5, "reserved": 0}
    assert DBC.encode_message("Command", command) == bytes.fromhex("401f0101dc050000")
    with pytest.raises(cantools.database.EncodeError):
        DBC.encode_message("Command", command | {"setpoint": 12.5})


def test_another_node_id_moves_every_message():
    other = cantools.database.load_string(dbc.render(node_id=9), "dbc", strict=True)
    assert {m.frame_id - 9 for m in other.messages} == {frame.base_id for frame in FRAMES}


def test_every_character_is_one_that_all_readers_agree_on():
    assert dbc.render().isascii()


NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,31}")


def test_every_name_is_one_that_candb_takes():
    names = [node.name for node in DBC.nodes]
    for message in DBC.messages:
        names += [message.name, *(signal.name for signal in message.signals)]
        assert len({signal.name for signal in message.signals}) == len(message.signals)
    assert [name for name in names if not NAME.fullmatch(name)] == []


def test_each_attribute_is_declared_then_given_a_default_then_set():
    kinds = re.findall(r'^(BA_DEF_DEF_|BA_DEF_|BA_) .*?"(\w+)"', dbc.render(), re.MULTILINE)
    declared, defaults = (
        [name for kind, name in kinds if kind == wanted] for wanted in ("BA_DEF_", "BA_DEF_DEF_")
    )
    assert declared == defaults
    assert {name for _, name in kinds} == set(declared)
    order = ["BA_DEF_", "BA_DEF_DEF_", "BA_"]
    assert [order.index(kind) for kind, _ in kinds] == sorted(order.index(kind) for kind, _ in kinds)


def test_whoever_opens_it_reads_how_a_force_may_be_used():
    assert 'CM_ "Use a force only while force_valid is 1' in dbc.render()
    assert all(node.comment for node in DBC.nodes)
