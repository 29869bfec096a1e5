"""Tests of the C++ and Python listeners in the robot guide: decoding, and forces too old to be used."""

import importlib.util
import math
import random
import re
import subprocess
import sys
import tempfile

import can
import pytest

from pneuforce.registers.can.frames import ANSWER, COMMAND, FORCE, STATE, STATUS_FRAME, decode
from pneuforce.registers.codes import STATES
from pneuforce.teststand.stack import free_port
from tests.registers.views.cpp_listener import EXAMPLES, compiled
from tests.tools import needs

NODE_ID = 5
SENT = {FORCE.base_id + NODE_ID: FORCE, 0x285: STATE, 0x385: STATUS_FRAME, 0x485: ANSWER}
EDGES = (0x0000, 0x0001, 0x7FFE, 0x7FFF, 0x8000, 0xFFFE, 0xFFFF)


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    return compiled(tmp_path_factory.mktemp("listener"))


def run_with_file(program, lines, *arguments):
    """Run the listener with a recorded file of candump lines."""
    with tempfile.TemporaryFile("w+") as file:
        file.writelines(lines)
        file.seek(0)
        command = [program, "-", *arguments]
        return subprocess.run(command, stdin=file, capture_output=True, text=True, timeout=30, check=False)


def run_listener(program, lines, *arguments):
    done = run_with_file(program, lines, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def candump(t_s, can_id, data):
    return f"({t_s:.6f}) can0 {can_id:03X}#{data.hex().upper()}\n"


def random_frames(count):
    """Yield random frames. Half of their words are edge values, at which a decoder is most likely to fail."""
    draw = random.Random(1)
    for _ in range(count):
        can_id = draw.choice(list(SENT))
        words = [draw.choice(EDGES) if draw.random() < 0.5 else draw.randrange(0x10000) for _ in range(4)]
        yield can_id, b"".join(word.to_bytes(2, "little") for word in words)[: SENT[can_id].length]


def parse_line(line):
    name, *pairs = line.split(" ")
    return name, dict(pair.split("=") for pair in pairs)


def expected_line(frame, data):
    """Return the name and the texts that the listener must print for a frame."""
    codes, values = frame.codes(data), decode(frame, data)
    texts = {
        field.name: f"{values[field.name]:.3f}" if field.unit else str(codes[field.name])
        for field in frame.fields
    }
    if frame is FORCE:
        usable = not math.isnan(values["force"]) and "force_valid" in values["condensed_status"]
        texts["valid"] = str(int(usable))
    return frame.name, texts


@needs("g++")
def test_the_program_decodes_each_frame_as_the_instrument_does(program):
    frames = list(random_frames(4000))
    lines = run_listener(program, [candump(n, can_id, data) for n, (can_id, data) in enumerate(frames)])
    decoded = [parse_line(line.replace("-nan", "nan")) for line in lines if not line.startswith("Loop")]
    assert decoded == [expected_line(SENT[can_id], data) for can_id, data in frames]


@needs("g++")
@pytest.mark.parametrize(
    "line",
    [
        "(1.0) can0 185#00000000000080\n",  # too short
        "(1.0) can0 00000185#0000000000008001\n",  # extended identifier with 29 bits
        "(1.0) can0 185#R\n",
        "(1.0) can0 186#0000000000008001\n",  # identifier of another node
        "185#0000000000008001\n",
        "\n",
    ],
)
def test_other_frames_give_no_force(program, line):
    assert [line for line in run_listener(program, [line]) if "valid=1" in line or "speed=3" in line] == []


def force_frame(counter, status=0x82, force_mn=500):
    return force_mn.to_bytes(2, "little") + bytes(4) + bytes((status, counter))


def test_each_listener_prints_the_line_of_the_guide(program, in_python, capsys):
    guide = (EXAMPLES.parent / "robot.md").read_text(encoding="utf-8")
    listed = dict(re.findall(r"^\| (C\+\+|Python) \| `(.*)` \|$", guide, re.MULTILINE))
    assert listed["C++"] in run_listener(program, [candump(10.0, 0x185, force_frame(1))])
    with can.Bus("guide", "virtual") as robot, can.Bus("guide", "virtual") as node:
        node.send(can.Message(arbitration_id=0x185, data=force_frame(1), is_extended_id=False))
        in_python.run(robot, None, StoppedAfter(1))
    assert listed["Python"] in capsys.readouterr().out.splitlines()


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


class StoppedAfter:
    """Flag that becomes true after it was tested some times."""

    def __init__(self, tests):
        self._tests = tests

    def __bool__(self):
        self._tests -= 1
        return self._tests < 0


def speeds(program, frames):
    lines = run_listener(program, [candump(t_s, 0x185, data) for t_s, data in frames])
    return [float(re.search("speed=(.*?) ", line)[1]) for line in lines if line.startswith("Loop")]


@needs("g++")
def test_a_repeated_frame_does_not_keep_the_force_valid(program):
    frames = [
        (10.0, force_frame(1)),
        (10.05, force_frame(1)),
        (10.15, force_frame(1)),
        (10.2, force_frame(2)),
    ]
    assert speeds(program, frames) == [2.0, -5.0, 2.0, -5.0]


@needs("g++")
def test_without_frames_there_is_no_force(program):
    with subprocess.Popen(
        [program, "-"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        process.stdin.write(candump(10.0, 0x185, force_frame(1)))
        process.stdin.flush()
        lines = iter(process.stdout.readline, "")
        assert any("speed=2.000" in line for line in lines)
        assert "speed=-5.000" in next(lines)
        process.stdin.close()


UNUSABLE = pytest.mark.parametrize(
    "frame",
    [
        force_frame(2, status=0x02),  # the force is a number, but its valid bit is 0
        force_frame(2, force_mn=0x7FFF),  # the valid bit is 1, but the force is not available
        force_frame(2, status=0x92),  # the force is above its limit
    ],
)


@needs("g++")
@UNUSABLE
def test_the_program_backs_off_without_a_valid_force_and_above_the_limit(program, frame):
    assert speeds(program, [(10.0, force_frame(1)), (10.01, frame)]) == [2.0, -5.0]


@needs("g++")
def test_the_commands_of_the_program_are_complete_and_in_range(program):
    answers = [(10.0, bytes((1, 0, 0, 0))), (10.01, bytes((2, 0, 0, 0)))]
    frames = [candump(9.99, 0x185, force_frame(1))] + [candump(t_s, 0x485, data) for t_s, data in answers]
    lines = run_listener(program, frames, "8.0")
    sent = [re.search("can0 205#(.*)", line)[1] for line in lines if line.startswith("(")]
    commands = [decode(COMMAND, bytes.fromhex(data)) for data in sent]
    assert [(c["mode"], c["setpoint"], c["lease"], c["sequence"]) for c in commands] == [
        ("vent", 8.0, 1.0, 1),
        ("hold", 8.0, 1.0, 2),
        ("vent", 0.0, 0.0, 3),
    ]


def is_vent_command(line):
    return decode(COMMAND, bytes.fromhex(line.rpartition("#")[2]))["mode"] == "vent"


@needs("g++")
def test_a_rejected_command_ends_the_program(program):
    answers = [candump(1.0, 0x485, bytes((1, 18, 0, 0))), candump(1.1, 0x485, bytes((1, 0, 0, 0)))]
    done = run_with_file(program, answers, "8.0")
    assert done.stderr == "The Command was rejected with result 18. See the results in docs/robot.md\n"
    assert done.returncode == 1
    assert is_vent_command(done.stdout.splitlines()[-1])


def status_frame(state):
    return bytes((0, 0, 0, 0, STATES.codes[state], 0, 0, 0))


ENDS_OF_A_HOLD = pytest.mark.parametrize(
    "states", [("tripped",), ("vented", "inflating", "holding", "venting"), ("holding", "tripped")]
)


@needs("g++")
@ENDS_OF_A_HOLD
def test_the_program_ends_when_the_balloon_is_vented(program, states):
    accepted = [(1.0, 0x485, bytes((1, 0, 0, 0))), (1.1, 0x485, bytes((2, 0, 0, 0)))]
    seen = [(2.0 + n / 100, 0x385, status_frame(state)) for n, state in enumerate(states)]
    later = [(3.0 + n / 10, 0x385, status_frame(states[-1])) for n in range(20)]
    done = run_with_file(program, [candump(*line) for line in accepted + seen + later], "8.0")
    code = STATES.codes[states[-1]]
    assert f"The hold has ended: the state is {code}: " in done.stderr
    assert ("names the fault" in done.stderr) == (states[-1] == "tripped")
    assert done.returncode == 1
    assert done.stdout.count("Status ") == len(states)
    assert is_vent_command(done.stdout.splitlines()[-1])


@needs("g++")
@pytest.mark.parametrize("setpoint", ["nan", "1.9", "12.1", "text"])
def test_the_program_rejects_a_setpoint_outside_the_range(program, setpoint):
    done = run_with_file(program, [], setpoint)
    assert done.returncode == 2
    assert "2 to 12 kPa" in done.stderr


@needs("g++")
def test_after_a_pause_the_program_uses_only_the_last_waiting_force(program):
    """In a pipe, the lines are the frames of a running instrument."""
    frames = [force_frame(n % 256, force_mn=3000 if n == 399 else 1000) for n in range(400)]
    lines = [candump(10.0 + n / 100, 0x185, data) for n, data in enumerate(frames)]
    done = subprocess.run(
        [program, "-"], input="".join(lines), capture_output=True, text=True, timeout=30, check=True
    )
    assert done.stdout.count("Force ") == 400
    used = re.findall("speed=(.*?) ", done.stdout)
    assert "1.000" not in used
    assert "-3.000" in used


@pytest.fixture(scope="module")
def in_python():
    spec = importlib.util.spec_from_file_location("robot_listener", EXAMPLES / "robot_listener.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_in_python_old_frames_are_invalid_and_lost_frames_are_counted(in_python):
    force_input = in_python.ForceInput()
    assert not force_input.force(0.0).valid
    for t_s, counter in ((10.0, 254), (10.01, 1), (10.2, 1)):
        force_input.take(in_python.FORCE.decode(force_frame(counter)), t_s)
    assert force_input.lost == 2
    assert force_input.force(10.1) == (0.5, True)
    assert not force_input.force(10.2).valid
    assert in_python.speed_mm_per_s(force_input, 10.2) == in_python.BACK_OFF_MM_PER_S


@UNUSABLE
def test_in_python_the_program_backs_off_without_a_valid_force_and_above_the_limit(in_python, frame):
    force_input = in_python.ForceInput()
    force_input.take(in_python.FORCE.decode(frame), 10.0)
    assert in_python.speed_mm_per_s(force_input, 10.0) == in_python.BACK_OFF_MM_PER_S


ACCEPTED = ({"sequence": 1, "result": "accepted"}, {"sequence": 2, "result": "accepted"})


@ENDS_OF_A_HOLD
def test_in_python_the_program_ends_when_the_balloon_is_vented(in_python, states):
    inflation = in_python.Inflation(8.0)
    inflation._sequence = 1
    inflation.take_state("tripped")  # before the hold is accepted, the Answer names the reason
    for answer in ACCEPTED:
        inflation.take(answer)
    for state in states:
        assert not inflation.failure
        inflation.take_state(state)
    assert f"the state is {states[-1]}" in inflation.failure


@pytest.mark.parametrize(
    "frame",
    [
        can.Message(arbitration_id=0x185, data=bytes(4), is_extended_id=False),
        can.Message(arbitration_id=0x185, data=force_frame(1), is_extended_id=True),
        can.Message(arbitration_id=0x185, dlc=8, is_remote_frame=True, is_extended_id=False),
    ],
)
def test_in_python_other_frames_give_no_force(in_python, frame):
    force_input = in_python.ForceInput()
    assert not in_python.take(frame, force_input, None)
    assert not force_input.force(0.0).valid


def run_python(*arguments):
    command = [sys.executable, EXAMPLES / "robot_listener.py", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--interface", "socketcand", "--port", str(free_port())],
        ["--interface", "unknown"],
        ["--channel", "can99"],
    ],
)
def test_in_python_a_bus_that_cannot_be_opened_gives_one_sentence(arguments):
    done = run_python(*arguments)
    assert done.returncode == 1
    assert re.fullmatch("The CAN bus failed: .*\\. Check the instrument, and .*\n", done.stderr)


@pytest.mark.parametrize("setpoint", ["nan", "1.9", "12.1", "text"])
def test_in_python_a_setpoint_outside_the_range_is_rejected(setpoint):
    done = run_python("--setpoint", setpoint)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_in_python_a_closed_hub_gives_one_sentence(in_python, monkeypatch):
    monkeypatch.setattr(in_python, "SILENCE_S", 0.1)
    with can.Bus("silent", "virtual") as robot, pytest.raises(OSError, match="no frame of the instrument"):
        in_python.run(robot, None, [])
