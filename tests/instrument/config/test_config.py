"""Tests of the configuration: the example documents each key; an error names file, key and allowed values."""

import math
import tomllib
from typing import get_args

import pytest
from pydantic import SecretStr

from pneuforce.errors import ConfigurationError
from pneuforce.instrument import config
from pneuforce.instrument.config import Configuration, example, load, parse
from pneuforce.instrument.core.interlocks import HARD_LIMIT_KPA
from pneuforce.instrument.measurement.chain import Chain
from pneuforce.instrument.model.balloon import Balloon
from pneuforce.instrument.model.law import ForceLaw, MethodName
from pneuforce.instrument.model.method_uncertainty import without_force_reference
from pneuforce.registers.map import BY_NAME

KEYS = [
    (name, key, field)
    for name, section in Configuration.model_fields.items()
    for key, field in section.annotation.model_fields.items()
]
each_key = pytest.mark.parametrize(("section", "key", "field"), KEYS, ids=[f"{s}.{k}" for s, k, _ in KEYS])


def error_message(tables):
    with pytest.raises(ConfigurationError) as error:
        parse(tables, "my.toml")
    return str(error.value)


def test_a_missing_table_has_its_defaults():
    assert parse({}, "x") == Configuration()


def test_the_example_contains_every_key_with_its_default():
    tables = tomllib.loads(example())
    assert parse(tables, "x") == Configuration()
    assert {(s, k) for s, keys in tables.items() for k in keys} == {(s, k) for s, k, _ in KEYS}


@each_key
def test_the_example_has_meaning_and_limits_in_the_line_before_each_key(section, key, field):
    lines = example().split(f"[{section}]\n")[1].splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith(f"{key} = "))
    assert lines[at - 1].startswith(f"# {field.description}; ")
    assert not lines[at - 1].endswith("; ")


@each_key
def test_a_value_of_a_wrong_type_is_rejected_with_file_and_key(section, key, field):
    wrong = 5 if isinstance(field.default, str | bool) else "five"
    for value in (wrong, [5], *(() if isinstance(field.default, dict) else ({}, {"deep": 1}))):
        message = error_message({section: {key: value}})
        assert message.startswith((f"my.toml: {section}.{key} = ", f"my.toml: {section}.{key}.0 = "))
    if not isinstance(field.default, bool):
        shown = "…" if field.annotation is SecretStr else True
        assert f"{section}.{key} = {shown}" in error_message({section: {key: True}})


NUMBERS = [
    (s, k, f) for s, k, f in KEYS if isinstance(f.default, int | float) and not isinstance(f.default, bool)
]
each_number = pytest.mark.parametrize(
    ("section", "key", "field"), NUMBERS, ids=[f"{s}.{k}" for s, k, _ in NUMBERS]
)


@each_number
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, -(2**70), 2**70, -1, 1.5e9])
def test_a_number_out_of_range_is_rejected_with_the_range(section, key, field, value):
    message = error_message({section: {key: value}})
    assert message.startswith(f"my.toml: {section}.{key} = {value!r}: ")
    assert "; allowed: " in message
    assert message.count("\n") == 0


@each_number
def test_the_limits_of_each_range_are_accepted(section, key, field):
    schema = Configuration.model_fields[section].annotation.model_json_schema()["properties"][key]
    for value in schema.get("enum") or (schema["minimum"], schema["maximum"]):
        accepted = getattr(getattr(parse({section: {key: value}}, "x"), section), key)
        assert accepted == value


def test_an_unknown_key_is_rejected_with_the_known_keys():
    message = error_message({"rig": {"prot": "/dev/x"}})
    assert message == "my.toml: rig.prot: unknown key; known here: port, require_released_firmware"
    assert error_message({"rigg": {}}).startswith("my.toml: rigg: unknown key; known here: rig, balloon,")


@pytest.mark.parametrize("value", [5, "x", [1], True, None])
def test_a_section_that_is_not_a_table_is_rejected(value):
    message = error_message({"rig": value})
    assert message.startswith(f"my.toml: rig = {value!r}: ")
    assert "table" in message
    assert "[rig]" in message


def test_all_errors_are_reported_at_once():
    message = error_message({"rig": {"port": 5}, "modbus": {"unit": 0}, "nonsense": {}}).splitlines()
    assert len(message) == 3
    assert all(line.startswith("my.toml: ") for line in message)


def test_an_invalid_date_is_rejected():
    for date in (1, 20261301, 20260230, 20260100):
        assert "identity.calibration_date" in error_message({"identity": {"calibration_date": date}})
    assert parse({"identity": {"calibration_date": 20240229}}, "x").identity.calibration_date == 20240229


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7", "fe80::1%eth0", "rig.example"])
def test_a_host_on_the_network_requires_allow(host):
    message = error_message({"modbus": {"host": host}})
    assert message.startswith(f"my.toml: modbus.allow is not set: host {host} ")
    assert 'allow = ["192.168.1.0/24"]' in message
    assert parse({"modbus": {"host": host, "allow": ["fd00::/8"]}}, "x").modbus.allow == ["fd00::/8"]


@pytest.mark.parametrize("host", ["127.0.0.1", "127.1.2.3", "::1", "localhost"])
def test_loopback_does_not_require_allow(host):
    assert parse({"modbus": {"host": host}}, "x").modbus.allow == []


PAGE = {"host": "0.0.0.0", "allow": ["10.0.0.0/8"]}


def test_a_page_on_the_network_requires_a_certificate_or_an_explicit_exception():
    message = error_message({"web": PAGE})
    assert message.startswith("my.toml: web.allow_plain_http is not set: host 0.0.0.0 ")
    assert "certificate" in message
    assert parse({"web": PAGE | {"allow_plain_http": True}}, "x").web.allow_plain_http
    assert parse({"web": PAGE | {"certificate": "a.pem", "key": "a.key"}}, "x").web.certificate == "a.pem"
    assert parse({"web": {"enabled": True}}, "x").web.host == "127.0.0.1"


@pytest.mark.parametrize("entry", ["192.168.1.5/24", "192.168.1", "plc.example", "", "fd00::/129"])
def test_an_invalid_network_is_rejected_with_its_index(entry):
    message = error_message({"modbus": {"host": "0.0.0.0", "allow": ["10.0.0.0/8", entry]}})
    assert message.startswith(f"my.toml: modbus.allow.1 = {entry!r}: ")
    assert "\n" not in message


class TestFiles:
    """Tests of configuration files: incomplete, invalid and missing files."""

    def test_a_file_with_one_key_changes_that_key_only(self, tmp_path):
        path = tmp_path / "instrument.toml"
        path.write_text("[modbus]\nport = 1502\n")
        expected = Configuration().model_dump()
        expected["modbus"]["port"] = 1502
        assert load(path).model_dump() == expected

    def test_a_truncated_file_is_rejected_with_its_name_or_consists_of_complete_lines(self, tmp_path):
        path = tmp_path / "instrument.toml"
        text = '[rig]\nport = "/dev/rig"\n[modbus]\nport = 1502\nhost = "127.0.0.1"\n'
        rejected, messages = [], []
        for length in range(len(text)):
            path.write_text(text[:length])
            try:
                load(path)
            except ConfigurationError as error:
                rejected.append(text[:length])
                messages.append(str(error))
        assert all(sentence.startswith(f"{path}: ") for sentence in messages)
        assert any(half.endswith("[mod") for half in rejected)
        assert any(half.endswith('"127.0') for half in rejected)
        assert any(half.endswith("port =") for half in rejected)

    @pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"\x00" * 100, b"port = ", b"[rig\n", b"a=1\na=2"])
    def test_a_file_that_is_not_toml_is_rejected_with_its_name(self, tmp_path, content):
        path = tmp_path / "instrument.toml"
        path.write_bytes(content)
        with pytest.raises(ConfigurationError, match=r"instrument\.toml: "):
            load(path)

    @pytest.mark.parametrize("text", ["", "\n", "# instrument.toml: every key with its default.\n"])
    def test_a_file_without_a_table_is_rejected(self, tmp_path, text):
        path = tmp_path / "instrument.toml"
        path.write_text(text)
        with pytest.raises(ConfigurationError, match=r"toml: .* no table.*pneuforce config --example > "):
            load(path)

    def test_a_missing_file_is_reported_with_the_command_that_writes_an_example(self, tmp_path):
        with pytest.raises(ConfigurationError, match=r"no such file.*pneuforce config --example"):
            load(tmp_path / "absent.toml")

    def test_a_directory_is_rejected(self, tmp_path):
        with pytest.raises(ConfigurationError, match="cannot be read"):
            load(tmp_path)

    def test_a_path_through_a_file_is_rejected(self, tmp_path):
        (tmp_path / "file").touch()
        with pytest.raises(ConfigurationError, match="cannot be read"):
            load(tmp_path / "file" / "instrument.toml")


def flat(value):
    """Return all leaf values of nested dataclasses."""
    if hasattr(value, "__dataclass_fields__"):
        return [leaf for name in value.__dataclass_fields__ for leaf in flat(getattr(value, name))]
    return [value]


#: Valid values that differ from all defaults, for keys whose default + 0.5 is not valid.
OTHERS = {
    "poisson": 0.375,
    "method": "lulevich",
    "switch": "paper",
    "low": "smooth",
    "pressed_sides": 2,
    "grip": 0.0625,
    "grip_std": 0.0625,
    "filter_time_constant_s": 0.125,
    "tube_time_constant_s": 0.375,
    "rest_thickness_mm": 0.3125,
    "radius_quadratic_mm_per_kpa2": 0.0625,
    "ambient_kpa": 99.5,
    "contact_limit_kpa": 17.25,
}


def other_value(key, default):
    if isinstance(default, bool):
        return not default
    if key in OTHERS:
        return OTHERS[key]
    return 20260102 if isinstance(default, int) else default + 0.5


CORE_SECTIONS = ("balloon", "circuit", "measurement", "safety")


@pytest.mark.parametrize(
    ("section", "key", "field"),
    [k for k in KEYS if k[1] in ("serial_number", "calibration_date")]
    + [k for k in KEYS if k[0] in CORE_SECTIONS and k[1] != "calibration"],
)
def test_the_core_receives_every_key_of_its_sections(section, key, field):
    other = other_value(key, field.default)
    before, after = Configuration(), parse({section: {key: other}}, "x")
    assert other in flat(after.settings())
    assert flat(after.settings()).count(other) > flat(before.settings()).count(other)


@each_key
def test_every_key_changes_the_hash(section, key, field):
    schema = Configuration.model_fields[section].annotation.model_json_schema()["properties"][key]
    candidates = [*schema.get("enum", []), schema.get("minimum"), schema.get("maximum"), "localhost"]
    if isinstance(field.default, bool):
        candidates = [not field.default]
    if isinstance(field.default, list):
        candidates = [["192.168.1.0/24"]]
    if isinstance(field.default, dict):
        candidates = [{"operator": []}]
    if isinstance(field.default, SecretStr):
        candidates = ["correct-horse-battery"]
    if key == "broker":
        candidates = ["mqtt://localhost"]
    other = next(c for c in candidates if c is not None and c != field.default)
    hash_ = parse({section: {key: other}}, "x").hash
    assert hash_ != Configuration().hash
    assert 0 <= hash_ <= BY_NAME["configuration_hash"].wire.max_code


def test_the_same_values_have_the_same_hash():
    assert Configuration().hash == parse(tomllib.loads(example()), "x").hash


def test_the_limits_agree_with_those_of_registers_and_interlocks():
    safety = config.SafetySection.model_json_schema()["properties"]
    for name in ("force_limit", "force_limit_2", "alarm_hysteresis", "alarm_delay"):
        limit, key = BY_NAME[name], safety[BY_NAME[name].quantity]
        assert (key["minimum"] * limit.scale, key["maximum"] * limit.scale) == (limit.low, limit.high)
    assert safety["contact_limit_kpa"]["maximum"] == HARD_LIMIT_KPA
    assert set(config.MeasurementSection.model_json_schema()["properties"]["method"]["enum"]) == set(
        get_args(MethodName)
    )


@pytest.mark.parametrize("method", get_args(MethodName))
def test_the_chain_uses_the_model_uncertainty_of_the_configured_method(method, tmp_path):
    path = tmp_path / "instrument.toml"
    path.write_text(f'[measurement]\nmethod = "{method}"\n')
    chain = Chain(load(path).chain)
    assert chain.settings.model_uncertainty == without_force_reference(ForceLaw(method=method), Balloon())
    chain.remove_calibration()
    assert chain.settings.model_uncertainty == without_force_reference(ForceLaw(method=method), Balloon())


@pytest.mark.parametrize(
    ("can", "serial_number", "warned"),
    [
        ({"enabled": True, "mode": "canopen"}, 0, True),
        ({"enabled": True, "mode": "canopen"}, 1, False),
        ({"enabled": True, "mode": "raw"}, 0, False),
        ({"enabled": False, "mode": "canopen"}, 0, False),
    ],
)
def test_a_canopen_node_without_a_serial_number_is_warned_of(can, serial_number, warned):
    configuration = parse({"can": can, "identity": {"serial_number": serial_number}}, "my.toml")
    assert ("identity.serial_number is 0" in configuration.warning) is warned


@pytest.mark.parametrize(
    ("measurement", "named"),
    [
        ({"method": "membrane", "switch": "paper", "low": "smooth"}, ["switch", "low"]),
        ({"method": "membrane", "switch": "blend", "low": "line"}, []),  # the defaults
        ({"method": "membrane", "grip": 0.2, "grip_std": 0.1}, []),
        ({"grip": 0.2, "grip_std": 0.1}, ["grip", "grip_std"]),
        ({"switch": "paper", "low": "smooth"}, []),
    ],
)
def test_a_setting_that_the_force_model_does_not_use_is_warned_of(measurement, named):
    configuration = parse({"measurement": measurement}, "my.toml")
    assert len(configuration.unused_settings) == bool(named)
    assert [name for name in named if f"measurement.{name}" not in configuration.warning] == []


def test_the_requirement_of_a_released_firmware_reaches_the_instrument():
    assert not parse({}, "my.toml").settings().require_released_firmware
    strict = parse({"rig": {"require_released_firmware": True}}, "my.toml")
    assert strict.settings().require_released_firmware
