"""Tables of TOML: whatever a file holds, it is a short sentence that names the file."""

import pytest

from instrument.config import load
from instrument.errors import ConfigurationError

DIGITS = "9" * 5000


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (f"a = {DIGITS}", "not TOML: a number of thousands of digits"),
        (f"[balloon]\nid = 0x{'f' * 20_000}", "a number of thousands of digits"),
        (f"[balloon]\nyoung_kpa = 0x{'f' * 20_000}", "a number of thousands of digits"),
        (f"[balloon]\nid = {'9' * 4000}", "balloon.id = 99999"),
        ("a = " + "[" * 100_000, "not TOML: brackets within brackets, too deep"),
        ("a = " + "{a = " * 100_000, "not TOML: brackets within brackets, too deep"),
        (f"[rig]\nport = {[1] * 5000}", "rig.port = [1, 1,"),
        ("balloon = 1", "balloon = 1: must be a table, [balloon]"),
    ],
)
def test_what_no_configuration_holds_is_a_short_sentence(tmp_path, content, said):
    path = tmp_path / "instrument.toml"
    path.write_text(content)
    with pytest.raises(ConfigurationError) as refused:
        load(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert said in str(refused.value)
    assert len(str(refused.value)) < len(str(path)) + 300
