"""Tests of the DBC file: cantools reads it in strict mode, and its values agree with the sent frames."""

import math
import re
from pathlib import Path
from typing import get_type_hints

import cantools
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pneuforce.instrument.core.snapshot import Snapshot
from pneuforce.registers.can.frames import FRAMES, encode
from pneuforce.registers.codes import CONDENSED, STATUS
from pneuforce.registers.map import REGISTERS
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.views import dbc

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
def frame_values(draw, frame):
    """Draw values of the fields that a frame does not take from a snapshot."""
    return {
        field.name: draw(
            st.sampled_from(sorted(field.values.codes))
            if field.values
            else st.integers(field.low or 0, field.max_value_code if field.high is None else field.high)
        )
        for field in frame.fields
        if not field.quantity
    }


def _signals(frame):
    return {signal.name: signal for signal in DBC.get_message_by_name(frame.name).signals}


@pytest.mark.parametrize("difference", [0, 1])
def test_the_function_of_the_guide_compares_the_map_hash_with_the_identity_frame(difference):
    guide = (Path(__file__).parents[3] / "docs/robot.md").read_text(encoding="utf-8")
    (function,) = re.findall(r"```python\n(def fits.*?)```", guide, re.DOTALL)
    names = {}
    exec(function, names)
    identity = (MAP_HASH ^ difference).to_bytes(4, "little") + bytes(4)
    assert names["fits"](DBC, identity) is (difference == 0)


@each_frame
@given(data=st.data())
def test_every_frame_decodes_to_the_snapshot_that_was_encoded(frame, data):
    snapshot, extra = data.draw(snapshots), data.draw(frame_values(frame))
    decoded = DBC.decode_message(frame.base_id + 5, encode(frame, snapshot, **extra))
    for field in frame.fields:
        value = extra[field.name] if field.name in extra else getattr(snapshot, field.quantity)
        if field.bits:
            names = {bit.name for bit in field.bits.bits}
            assert {name for name in names if decoded[name]} == value & names
        elif field.values:
            assert decoded[field.name] == value
        elif not field.unit:
            code = value % (field.wire.max_code + 1)
            assert decoded[field.name] == field.code_names.get(code, code)
        elif value != value and not frame.received:
            assert decoded[field.name] == (
                "not_available" if field.not_available else field.max_value_code / 1e3
            )
        elif value == value:
            smallest, largest = field.wire.min_code / field.scale, field.max_value_code / field.scale
            assert float(decoded[field.name]) == pytest.approx(
                min(max(value, smallest), largest), abs=0.5001 / field.scale
            )


@each_field
def test_a_range_excludes_the_not_available_code(frame, field):
    if field.not_available is None:
        return
    signal = _signals(frame)[field.name]
    assert signal.maximum < field.not_available / field.scale
    assert signal.unit == {"mN": "N", "Pa": "kPa", "µm": "mm"}[field.unit]
    if not frame.received:
        assert signal.choices[int(field.not_available)] == "not_available"
        assert signal.initial == "not_available"  # tools show this value before the first frame


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


def test_cantools_encodes_a_command_in_si_units_and_checks_its_range():
    command = {"setpoint": 8.0, "mode": "hold", "sequence": 1, "lease": 1.5, "proof_test": "allowed"}
    assert DBC.encode_message("Command", command) == bytes.fromhex("401f0101dc050000")
    with pytest.raises(cantools.database.EncodeError):
        DBC.encode_message("Command", command | {"setpoint": 12.5})


def test_another_node_id_changes_every_identifier():
    other = cantools.database.load_string(dbc.render(node_id=9), "dbc", strict=True)
    assert {m.frame_id - 9 for m in other.messages} == {frame.base_id for frame in FRAMES}


def test_the_text_is_ascii():
    assert dbc.render().isascii()


NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,31}")


def test_every_name_is_valid_in_candb():
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


def test_the_file_contains_the_rule_for_using_the_force():
    assert 'CM_ "Use the force only while force_valid is 1' in dbc.render()
    assert all(node.comment for node in DBC.nodes)


def test_the_guide_describes_the_value_of_cantools_for_a_force_that_is_not_available():
    data = bytes.fromhex("FF7F000000000000")
    force = DBC.decode_message("Force", data)["force"]
    assert force == "not_available"
    assert not isinstance(force, (int, float, str))
    with pytest.raises(TypeError):
        _ = force > 1.5
    assert DBC.decode_message("Force", data, decode_choices=False)["force"] == pytest.approx(32.767)
