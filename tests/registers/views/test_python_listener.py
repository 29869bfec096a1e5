"""Tests of the Python listener in the robot guide: old forces, the end of a hold, and failures of the bus."""

import importlib.util
import os
import re
import subprocess
import sys

import can
import pytest

from pneuforce.registers.can.frames import COMMAND, decode
from pneuforce.teststand.stack import free_port
from tests.registers.views.cpp_listener import EXAMPLES
from tests.registers.views.listener_cases import ENDS_OF_A_HOLD, REJECTIONS, UNUSABLE, force_frame


@pytest.fixture(scope="module")
def in_python():
    spec = importlib.util.spec_from_file_location("robot_listener", EXAMPLES / "robot_listener.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class StoppedAfter:
    """Flag that becomes true after it was tested some times."""

    def __init__(self, tests):
        self._tests = tests

    def __bool__(self):
        self._tests -= 1
        return self._tests < 0


def test_the_program_prints_the_line_of_the_guide(in_python, capsys):
    guide = (EXAMPLES.parent / "robot.md").read_text(encoding="utf-8")
    [line] = re.findall(r"^\| Python \| `(.*)` \|$", guide, re.MULTILINE)
    with can.Bus("guide", "virtual") as robot, can.Bus("guide", "virtual") as node:
        node.send(can.Message(arbitration_id=0x185, data=force_frame(1), is_extended_id=False))
        in_python.run(robot, None, StoppedAfter(1))
    assert line in capsys.readouterr().out.splitlines()


def test_each_line_names_a_simulation(in_python, capsys):
    with can.Bus("simulation", "virtual") as robot, can.Bus("simulation", "virtual") as node:
        data = force_frame(1, status=0xC2)
        node.send(can.Message(arbitration_id=0x185, data=data, is_extended_id=False))
        in_python.run(robot, None, StoppedAfter(1))
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2
    assert all(line.endswith(" lost, simulated") for line in lines)


def test_after_a_pause_only_the_last_waiting_force_is_used(in_python, capsys):
    with can.Bus("pause", "virtual") as robot, can.Bus("pause", "virtual") as node:
        for counter in range(1, 200):
            data = force_frame(counter, force_mn=3000 if counter == 199 else 1000)
            node.send(can.Message(arbitration_id=0x185, data=data, is_extended_id=False))
        in_python.run(robot, None, StoppedAfter(1))
    printed = capsys.readouterr().out
    assert "force 3.000 N" in printed
    assert printed.endswith(": -5.000 mm/s, 0 lost\n")
    assert "force 1.000 N" not in printed


def test_old_frames_are_invalid_and_lost_frames_are_counted(in_python):
    force_input = in_python.ForceInput()
    assert not force_input.force(0.0).valid
    for t_s, counter in ((10.0, 254), (10.01, 1), (10.2, 1)):
        force_input.take(in_python.FORCE.decode(force_frame(counter)), t_s)
    assert force_input.lost == 2
    assert force_input.force(10.1) == (0.5, True)
    assert not force_input.force(10.2).valid
    assert not force_input.force(9.9).valid  # the clock was set back
    assert in_python.speed_mm_per_s(force_input, 10.2) == in_python.BACK_OFF_MM_PER_S


def test_after_a_fast_fall_of_the_force_the_program_does_not_move_forward(in_python):
    force_input, speeds = in_python.ForceInput(), []
    for counter, force_mn in enumerate((1400, 1350, 1200, 500, 0, 0)):
        now_s = 10.0 + counter * 0.01
        force_input.take(in_python.FORCE.decode(force_frame(counter, force_mn=force_mn)), now_s)
        speeds.append(in_python.speed_mm_per_s(force_input, now_s))
    assert speeds == pytest.approx([0.2, 0.3, 0.0, 0.0, 0.0, 0.0])
    for counter in range(6, 250):  # the reference falls by 1 N/s
        force_input.take(in_python.FORCE.decode(force_frame(counter, force_mn=0)), 10.0 + counter * 0.01)
    assert in_python.speed_mm_per_s(force_input, 12.49) == pytest.approx(3.0)


@UNUSABLE
def test_the_program_backs_off_without_a_valid_force_and_above_the_limit(in_python, frame):
    force_input = in_python.ForceInput()
    force_input.take(in_python.FORCE.decode(frame), 10.0)
    assert in_python.speed_mm_per_s(force_input, 10.0) == in_python.BACK_OFF_MM_PER_S


ACCEPTED = [{"sequence": sequence, "result": "accepted"} for sequence in (1, 2, 3)]  # lease, vent, hold


def accept(inflation, answers):
    """Handle these Answers. After the Answer to the vent, the balloon is vented."""
    for answer in answers:
        assert not inflation.failure
        inflation.take(answer)
        if answer["sequence"] == 2:
            inflation.take_state("venting")


def inflation_from_1(in_python, *arguments):
    """Return an Inflation whose first sequence number is 1."""
    inflation = in_python.Inflation(8.0, *arguments)
    inflation._sequence = 1
    return inflation


def sent(frame):
    """Return mode, setpoint, lease, sequence and permission of proof tests of a Command."""
    command = decode(COMMAND, bytes(frame.data))
    return tuple(command[name] for name in ("mode", "setpoint", "lease", "sequence", "proof_test"))


@pytest.mark.parametrize("proof_test", ["allowed", "forbidden"])
def test_the_commands_take_the_lease_vent_hold_and_renew_the_lease(in_python, proof_test):
    inflation = inflation_from_1(in_python, proof_test)
    expected = [("lease", 0.0), ("vent", 0.0), ("hold", 8.0), ("lease", 0.0)]
    for sequence, (mode, setpoint_kpa) in enumerate(expected, 1):
        command = sent(inflation.due(10.0))
        assert command == (mode, pytest.approx(setpoint_kpa), 1.0, sequence, proof_test)
        assert inflation.due(10.05) is None
        accept(inflation, [{"sequence": sequence, "result": "accepted"}])
    assert sent(inflation.due(10.4)) == command
    assert sent(inflation.vent_and_release()) == ("vent", 0.0, 0.0, 5, "allowed")


@REJECTIONS
def test_a_rejected_command_ends_the_hold_and_vents_only_with_the_lease(in_python, sequence, result, last):
    inflation = inflation_from_1(in_python)
    accept(inflation, [*ACCEPTED[: sequence - 1], {"sequence": sequence, "result": result}])
    assert result in inflation.failure
    final = inflation.vent_and_release()
    assert (sent(final)[0] if final else "lease") == last


def test_without_an_answer_to_the_lease_only_the_lease_is_ended(in_python):
    assert sent(inflation_from_1(in_python).vent_and_release())[:3] == ("lease", 0.0, 0.0)


@ENDS_OF_A_HOLD
def test_the_program_ends_when_the_balloon_is_vented(in_python, states):
    inflation = inflation_from_1(in_python)
    inflation.take_state("tripped")  # before the hold is accepted, the Answer names the reason
    accept(inflation, ACCEPTED)
    for state in states:
        assert not inflation.failure
        inflation.take_state(state)
    assert f"the state is {states[-1]}" in inflation.failure


def test_the_hold_waits_until_the_balloon_that_was_held_before_is_vented(in_python):
    """A Status just after the Answer to the vent can still show the old balloon."""
    inflation = inflation_from_1(in_python)
    inflation.take_state("holding")
    accept(inflation, ACCEPTED[:1])
    inflation.take(ACCEPTED[1])
    inflation.take_state("holding")
    assert sent(inflation.due(10.0))[0] == "vent"
    for state in ("venting", "vented"):
        inflation.take_state(state)
    assert sent(inflation.due(10.1))[0] == "hold"
    inflation.take(ACCEPTED[2])
    for state in ("vented", "inflating", "settling", "holding"):
        inflation.take_state(state)
    assert not inflation.failure


@pytest.mark.parametrize(
    "frame",
    [
        can.Message(arbitration_id=0x185, data=bytes(4), is_extended_id=False),
        can.Message(arbitration_id=0x185, data=force_frame(1), is_extended_id=True),
        can.Message(arbitration_id=0x185, dlc=8, is_remote_frame=True, is_extended_id=False),
    ],
)
def test_other_frames_give_no_force(in_python, frame):
    force_input = in_python.ForceInput()
    assert not in_python.take(frame, force_input, None)
    assert not force_input.force(0.0).valid


def run_python(*arguments):
    command = [sys.executable, EXAMPLES / "robot_listener.py", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--interface", "socketcand", "--port", str(free_port())],
        ["--interface", "unknown"],
        ["--channel", "can99"],
    ],
)
def test_a_bus_that_cannot_be_opened_gives_one_sentence(arguments):
    done = run_python(*arguments)
    assert done.returncode == 1
    assert re.fullmatch("The CAN bus failed: .*\\. Check the instrument, and .*\n", done.stderr)


def run_with_output(in_python, monkeypatch, output):
    """Run the program with a hold on a virtual bus. Return its exit value and the last Command."""
    with output, can.Bus("output", "virtual") as node:
        monkeypatch.setattr(in_python, "open_bus", lambda _: can.Bus("output", "virtual"))
        monkeypatch.setattr(in_python.signal, "signal", lambda *_: None)
        monkeypatch.setattr("sys.argv", ["robot_listener.py", "--setpoint", "8.0"])
        monkeypatch.setattr("sys.stdout", output)
        with pytest.raises(SystemExit) as ended:
            in_python.main()
        monkeypatch.undo()
        commands = []
        while (frame := node.recv(0.0)) is not None:
            commands.append(in_python.COMMAND.decode(frame.data))
    return ended.value.code, commands[-1]


def closed_pipe():
    reader, writer = os.pipe()
    os.close(reader)
    return open(writer, "w")


def full_disk():
    return open("/dev/full", "w")


@pytest.mark.parametrize(
    ("open_output", "code"),
    [(closed_pipe, 1), (full_disk, "The output failed: No space left on device")],
)
def test_an_error_of_the_output_is_no_error_of_the_bus_and_ends_the_lease(
    in_python, monkeypatch, capfd, open_output, code
):
    exit_value, last_command = run_with_output(in_python, monkeypatch, open_output())
    assert exit_value == code
    assert (last_command["mode"], last_command["lease"]) == ("lease", 0.0)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("setpoint", ["nan", "1.9", "12.1", "text"])
def test_a_setpoint_outside_the_range_is_rejected(setpoint):
    done = run_python("--setpoint", setpoint)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_a_closed_hub_gives_one_sentence(in_python, monkeypatch):
    monkeypatch.setattr(in_python, "SILENCE_S", 0.1)
    with can.Bus("silent", "virtual") as robot, pytest.raises(OSError, match="no frame of the instrument"):
        in_python.run(robot, None, [])
