"""The configuration: documented by itself, and wrong files refused with file, key and span."""

import math
import tomllib

import pytest
from pydantic import SecretStr

from instrument import config
from instrument.chain import Chain
from instrument.config import Configuration, example, load, parse
from instrument.errors import ConfigurationError
from instrument.interlocks import HARD_LIMIT_KPA
from instrument.model import METHODS
from instrument.model.uncertainty import ModelErrors
from registers.map import BY_NAME

KEYS = [
    (name, key, field)
    for name, section in Configuration.model_fields.items()
    for key, field in section.annotation.model_fields.items()
]
each_key = pytest.mark.parametrize(("section", "key", "field"), KEYS, ids=[f"{s}.{k}" for s, k, _ in KEYS])


def refused(tables):
    with pytest.raises(ConfigurationError) as told:
        parse(tables, "my.toml")
    return str(told.value)


def test_what_no_table_gives_is_at_its_default():
    assert parse({}, "x") == Configuration()


def test_the_example_is_exactly_the_defaults_and_names_every_key():
    tables = tomllib.loads(example())
    assert parse(tables, "x") == Configuration()
    assert {(s, k) for s, keys in tables.items() for k in keys} == {(s, k) for s, k, _ in KEYS}


@each_key
def test_the_example_tells_meaning_and_span_of_each_key_in_the_line_before_it(section, key, field):
    lines = example().split(f"[{section}]\n")[1].splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith(f"{key} = "))
    assert lines[at - 1].startswith(f"# {field.description}; ")
    assert not lines[at - 1].endswith("; ")


@each_key
def test_a_value_of_a_wrong_kind_is_refused_with_file_and_key(section, key, field):
    wrong = 5 if isinstance(field.default, str | bool) else "five"
    for value in (wrong, [5], {}, {"deep": 1}):
        said = refused({section: {key: value}})
        assert said.startswith((f"my.toml: {section}.{key} = ", f"my.toml: {section}.{key}.0 = "))
    if not isinstance(field.default, bool):
        assert f"{section}.{key} = True" in refused({section: {key: True}})


NUMBERS = [
    (s, k, f) for s, k, f in KEYS if isinstance(f.default, int | float) and not isinstance(f.default, bool)
]
each_number = pytest.mark.parametrize(
    ("section", "key", "field"), NUMBERS, ids=[f"{s}.{k}" for s, k, _ in NUMBERS]
)


@each_number
@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, -(2**70), 2**70, -1, 1.5e9])
def test_a_number_out_of_its_span_is_refused_with_the_span(section, key, field, value):
    said = refused({section: {key: value}})
    assert said.startswith(f"my.toml: {section}.{key} = {value!r}: ")
    assert "; allowed: " in said
    assert said.count("\n") == 0


@each_number
def test_the_ends_of_each_span_are_accepted(section, key, field):
    schema = Configuration.model_fields[section].annotation.model_json_schema()["properties"][key]
    for value in schema.get("enum") or (schema["minimum"], schema["maximum"]):
        accepted = getattr(getattr(parse({section: {key: value}}, "x"), section), key)
        assert accepted == value


def test_an_unknown_key_is_refused_with_those_that_are_known():
    said = refused({"rig": {"prot": "/dev/x"}})
    assert said == "my.toml: rig.prot: unknown key; known here: port"
    assert refused({"rigg": {}}).startswith("my.toml: rigg: unknown key; known here: rig, balloon,")


@pytest.mark.parametrize("value", [5, "x", [1], True, None])
def test_a_section_that_is_no_table_is_refused(value):
    assert refused({"rig": value}) == f"my.toml: rig = {value!r}: must be a table, [rig]"


def test_all_that_is_wrong_is_told_at_once():
    said = refused({"rig": {"port": 5}, "modbus": {"unit": 0}, "nonsense": {}}).splitlines()
    assert len(said) == 3
    assert all(line.startswith("my.toml: ") for line in said)


def test_a_date_that_is_none_is_refused():
    for date in (1, 20261301, 20260230, 20260100):
        assert "identity.calibration_date" in refused({"identity": {"calibration_date": date}})
    assert parse({"identity": {"calibration_date": 20240229}}, "x").identity.calibration_date == 20240229


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.7", "fe80::1%eth0", "rig.example"])
def test_who_may_connect_from_the_network_must_be_said(host):
    said = refused({"modbus": {"host": host}})
    assert said.startswith(f"my.toml: modbus.allow = []: host {host} is reached from the network")
    assert 'allow = ["192.168.1.0/24"]' in said
    assert parse({"modbus": {"host": host, "allow": ["fd00::/8"]}}, "x").modbus.allow == ["fd00::/8"]


@pytest.mark.parametrize("host", ["127.0.0.1", "127.1.2.3", "::1", "localhost"])
def test_on_loopback_nothing_needs_to_be_said(host):
    assert parse({"modbus": {"host": host}}, "x").modbus.allow == []


@pytest.mark.parametrize("entry", ["192.168.1.5/24", "192.168.1", "plc.example", "", "fd00::/129"])
def test_what_is_no_network_is_refused_by_its_place_in_the_list(entry):
    said = refused({"modbus": {"host": "0.0.0.0", "allow": ["10.0.0.0/8", entry]}})
    assert said.startswith(f"my.toml: modbus.allow.1 = {entry!r}: ")
    assert "\n" not in said


class TestFiles:
    """What may lie at the path."""

    def test_a_file_with_one_key_changes_that_key_only(self, tmp_path):
        path = tmp_path / "instrument.toml"
        path.write_text("[modbus]\nport = 1502\n")
        expected = Configuration().model_dump()
        expected["modbus"]["port"] = 1502
        assert load(path).model_dump() == expected

    def test_every_half_of_a_file_is_refused_by_name_or_is_whole_lines(self, tmp_path):
        path = tmp_path / "instrument.toml"
        text = '[rig]\nport = "/dev/rig"\n[modbus]\nport = 1502\nhost = "127.0.0.1"\n'
        outcomes, told = [], []
        for length in range(len(text)):
            path.write_text(text[:length])
            try:
                load(path)
            except ConfigurationError as error:
                outcomes.append(text[:length])
                told.append(str(error))
        assert all(sentence.startswith(f"{path}: ") for sentence in told)
        assert any(half.endswith("[mod") for half in outcomes)
        assert any(half.endswith('"127.0') for half in outcomes)
        assert any(half.endswith("port =") for half in outcomes)

    @pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"\x00" * 100, b"port = ", b"[rig\n", b"a=1\na=2"])
    def test_what_is_no_toml_is_refused_by_name(self, tmp_path, content):
        path = tmp_path / "instrument.toml"
        path.write_bytes(content)
        with pytest.raises(ConfigurationError, match=r"instrument\.toml: "):
            load(path)

    @pytest.mark.parametrize("text", ["", "\n", "# instrument.toml: every key with its default.\n"])
    def test_a_file_without_a_table_is_not_taken_for_the_defaults(self, tmp_path, text):
        path = tmp_path / "instrument.toml"
        path.write_text(text)
        with pytest.raises(ConfigurationError, match=r"toml: no table in it.*pneuforce config --example > "):
            load(path)

    def test_a_missing_file_is_told_with_the_command_that_writes_one(self, tmp_path):
        with pytest.raises(ConfigurationError, match=r"no such file.*pneuforce config --example"):
            load(tmp_path / "absent.toml")

    def test_a_directory_is_refused(self, tmp_path):
        with pytest.raises(ConfigurationError, match="cannot be read"):
            load(tmp_path)

    def test_a_path_through_a_file_is_refused(self, tmp_path):
        (tmp_path / "file").touch()
        with pytest.raises(ConfigurationError, match="cannot be read"):
            load(tmp_path / "file" / "instrument.toml")


def flat(value):
    """All leaves of nested dataclasses."""
    if hasattr(value, "__dataclass_fields__"):
        return [leaf for name in value.__dataclass_fields__ for leaf in flat(getattr(value, name))]
    return [value]


#: Values within the span and unlike any default, where "the default and a half" will not do.
OTHERS = {
    "poisson": 0.375,
    "method": "lulevich",
    "switch": "paper",
    "low": "smooth",
    "filter_s": 0.125,
    "tube_s": 0.375,
    "rest_thickness_mm": 0.3125,
    "radius_quadratic_mm_per_kpa2": 0.0625,
    "ambient_kpa": 99.5,
    "contact_limit_kpa": 17.25,
}


def other_value(key, default):
    if isinstance(default, bool):
        return not default
    if isinstance(default, int):
        return 20260102
    return OTHERS[key] if key in OTHERS else default + 0.5


CORE_SECTIONS = ("balloon", "circuit", "measurement", "safety")


@pytest.mark.parametrize(
    ("section", "key", "field"),
    [k for k in KEYS if k[1] in ("serial_number", "calibration_date")]
    + [k for k in KEYS if k[0] in CORE_SECTIONS and k[1] != "calibration"],
)
def test_the_core_gets_every_key_that_concerns_it(section, key, field):
    other = other_value(key, field.default)
    before, after = Configuration(), parse({section: {key: other}}, "x")
    assert other in flat(after.settings())
    assert flat(after.settings()).count(other) > flat(before.settings()).count(other)


@each_key
def test_every_key_changes_the_hash_and_what_a_register_shows_of_it(section, key, field):
    schema = Configuration.model_fields[section].annotation.model_json_schema()["properties"][key]
    candidates = [*schema.get("enum", []), schema.get("minimum"), schema.get("maximum"), "localhost"]
    if isinstance(field.default, bool):
        candidates = [not field.default]
    if isinstance(field.default, list):
        candidates = [["192.168.1.0/24"]]
    if isinstance(field.default, SecretStr):
        candidates = ["correct-horse-battery"]
    other = next(c for c in candidates if c is not None and c != field.default)
    hash_ = parse({section: {key: other}}, "x").hash
    assert hash_ != Configuration().hash
    assert 0 <= hash_ <= BY_NAME["configuration_hash"].wire.highest


def test_the_same_values_have_the_same_hash_in_every_process():
    assert Configuration().hash == parse(tomllib.loads(example()), "x").hash


def test_the_spans_agree_with_what_they_configure():
    limit = BY_NAME["force_limit"]
    safety = config.Safety.model_json_schema()["properties"]
    assert (safety["force_limit_n"]["minimum"], safety["force_limit_n"]["maximum"]) == (limit.low, limit.high)
    assert safety["contact_limit_kpa"]["maximum"] == HARD_LIMIT_KPA
    assert set(config.MeasurementSection.model_json_schema()["properties"]["method"]["enum"]) == set(METHODS)


@pytest.mark.parametrize("method", METHODS)
def test_the_chain_states_the_error_of_the_method_that_it_was_configured_to(method, tmp_path):
    path = tmp_path / "instrument.toml"
    path.write_text(f'[measurement]\nmethod = "{method}"\n')
    chain = Chain(load(path).chain)
    assert chain.settings.model == ModelErrors.of(method)
    chain.uncalibrate()
    assert chain.settings.model == ModelErrors.of(method)
