"""The checkpoint: a coupling goes on from it as if nothing had been, and a foreign pickle runs nothing."""

import os
import pickle
import random
import sys

import pytest

from instrument.coupling import Coupling, NoTape
from instrument.tape.checkpoint import freeze, thaw
from instrument.tape.entry import TapeError
from instrument.tape.measured import pack
from tests.instrument.driving import HOLD_8, Drive


def pressed():
    drive = Drive.holding()
    drive.push_kpa = 1.5
    drive.run(0.5)
    return drive


@pytest.mark.parametrize("drive", [Drive.zeroed, Drive.holding, pressed])
def test_a_coupling_goes_on_from_its_checkpoint_bit_for_bit(drive):
    drive = drive()
    first = Coupling(drive.instrument)
    second = thaw(freeze(first))
    for number in range(600):
        drive.push_kpa = 1.0 + 0.5 * (number % 300 > 150)
        drive.feed()
        raw = drive.instrument.raw
        second.take(raw, drive.now_s)
        assert pack(raw, second.instrument.measurement) == pack(raw, drive.instrument.measurement)
    assert shown(second.instrument, drive) == shown(drive.instrument, drive)


def shown(instrument, drive):
    """A snapshot as text, for NaN is not equal to itself."""
    seen = instrument.snapshot(("modbus_tcp", "10.0.0.1"), drive.now_s)
    return repr(seen._replace(status=sorted(seen.status)))


def test_freezing_changes_nothing_and_keeps_the_tape():
    tape = NoTape()
    coupling = Coupling(Drive.holding().instrument, tape)
    before = freeze(coupling)
    assert freeze(coupling) == before
    assert coupling.tape is tape
    assert thaw(before).tape is not tape


def test_a_command_that_is_busy_is_still_answered():
    drive = Drive.holding()
    drive.latched.add(11)
    drive.feed()
    drive.run(0.1)
    again = thaw(freeze(Coupling(drive.instrument))).instrument
    assert again.tripped
    assert again.write(("modbus_tcp", "10.0.0.1"), HOLD_8, drive.now_s) == "fault_latched"


class Command:
    """What an enemy puts into a recording."""

    def __init__(self, call, *arguments):
        self.call, self.arguments = call, arguments

    def __reduce__(self):
        return self.call, self.arguments


@pytest.mark.parametrize(
    "evil",
    [
        Command(os.system, "touch /tmp/pneuforce-was-here"),
        Command(eval, "1/0"),
        Command(getattr, "x", "upper"),
        Command(__import__, "os"),
        Command(pickle.loads, b"N."),
    ],
)
def test_a_pickle_that_calls_anything_else_is_refused_before_it_does(evil, tmp_path):
    with pytest.raises(TapeError, match="nothing of its own"):
        thaw(pickle.dumps({"instrument": evil}))


@pytest.mark.parametrize(
    "greedy", [b"\x80\x05Nr\x00\xe1\xf5\x05.", b"Np100000000\n.", b"Nq\x07.", bytes(2_000_000)]
)
def test_a_checkpoint_that_would_take_all_memory_is_refused_before_it_does(greedy):
    with pytest.raises(TapeError, match="none of ours"):
        thaw(greedy)


def test_functions_and_names_behind_our_modules_are_refused():
    for name in ("logging.log", "math.isfinite", "annotations", "log", "situation_of"):
        text = f"cinstrument.core\n{name}\n(tR.".encode()
        with pytest.raises(TapeError, match="nothing of its own"):
            thaw(text)


@pytest.mark.parametrize("name", ["settings", "instrument.settingsofsomebody", "rig"])
def test_a_module_that_is_only_called_like_ours_is_not_even_imported(tmp_path, monkeypatch, name):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / f"{name}.py").write_text("class Settings: pass\n")
    with pytest.raises(TapeError, match="nothing of its own"):
        thaw(f"c{name}\nSettings\n.".encode())
    assert name not in sys.modules


def test_damaged_checkpoints_are_refused_in_a_sentence():
    whole = freeze(Coupling(Drive.holding().instrument))
    draw = random.Random(1)
    refused = 0
    for _ in range(500):
        damaged = bytearray(whole[: draw.randrange(1, len(whole))] if draw.random() < 0.3 else whole)
        damaged[draw.randrange(len(damaged))] ^= 1 << draw.randrange(8)
        try:
            thaw(bytes(damaged))
        except TapeError:
            refused += 1
    assert refused > 100
