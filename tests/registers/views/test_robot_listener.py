"""Tests of the C++ listener in the robot guide: decoding, and forces too old to be used."""

import math
import os
import random
import re
import subprocess
import tempfile

import pytest

from pneuforce.registers.can.frames import ANSWER, COMMAND, FORCE, RESULTS, STATE, STATUS_FRAME, decode
from pneuforce.registers.codes import STATES
from tests.registers.views.cpp_listener import EXAMPLES, compiled
from tests.registers.views.listener_cases import ENDS_OF_A_HOLD, REJECTIONS, UNUSABLE, force_frame
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
        return subprocess.run(command, stdin=file, capture_output=True, text=True, timeout=600, check=False)


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
        texts["force"] = texts["force"] if usable else "nan"
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
        "(1.0) can0 185#000000000000800101\n",  # too long
        "(1.0) can0 00000185#0000000000008001\n",  # extended identifier with 29 bits
        "(1.0) can0 185#R\n",
        "(1.0) can0 186#0000000000008001\n",  # identifier of another node
        "185#0000000000008001\n",
        "\n",
    ],
)
def test_other_frames_give_no_force(program, line):
    assert [line for line in run_listener(program, [line]) if "valid=1" in line or "speed=3" in line] == []


GUIDE = (EXAMPLES.parent / "robot.md").read_text(encoding="utf-8")


@needs("g++")
def test_the_program_prints_the_line_of_the_guide(program):
    [line] = re.findall(r"^\| C\+\+ \| `(.*)` \|$", GUIDE, re.MULTILINE)
    assert line in run_listener(program, [candump(10.0, 0x185, force_frame(1))])


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
def test_without_frames_there_is_no_force_and_the_program_says_so(program):
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen([program, "-"], **pipes, text=True) as process:
        process.stdin.write(candump(10.0, 0x185, force_frame(1)))
        process.stdin.flush()
        lines = iter(process.stdout.readline, "")
        assert any("speed=2.000" in line for line in lines)
        assert "speed=-5.000" in next(lines)
        assert re.match(r"No frames since \d{3,} ms", process.stderr.readline())
        process.stdin.write(candump(11.0, 0x185, force_frame(2)))
        process.stdin.flush()
        assert "again" in process.stderr.readline()
        process.stdin.close()


@needs("g++")
@UNUSABLE
def test_the_program_backs_off_without_a_valid_force_and_above_the_limit(program, frame):
    assert speeds(program, [(10.0, force_frame(1)), (10.01, frame)]) == [2.0, -5.0]


def status_frame(state):
    return bytes((0, 0, 0, 0, STATES.codes[state], 0, 0, 0))


def answer(sequence, result=0, t_s=1.0):
    return candump(t_s + sequence / 100, 0x485, bytes((sequence, result, 0, 0)))


#: Answers to lease, vent and hold. After the Answer to the vent, the balloon is vented.
ACCEPTED = [answer(1), answer(2), candump(1.025, 0x385, status_frame("venting")), answer(3)]
#: Number of these frames before the Answer to the Command with a sequence number.
BEFORE_ANSWER = {1: 0, 2: 1, 3: 3, 4: 4}


def commands(lines):
    """Return mode, setpoint, lease, sequence and permission of proof tests of each printed Command."""
    sent = [re.search("can0 205#(.*)", line)[1] for line in lines if line.startswith("(")]
    decoded = (decode(COMMAND, bytes.fromhex(data)) for data in sent)
    return [
        tuple(c[name] for name in ("mode", "setpoint", "lease", "sequence", "proof_test")) for c in decoded
    ]


@needs("g++")
@pytest.mark.parametrize("proof_test", ["allowed", "forbidden"])
def test_the_commands_of_the_program_are_complete_and_in_range(program, proof_test):
    frames = [candump(0.99, 0x185, force_frame(1)), *ACCEPTED]
    lines = run_listener(program, frames, "8.0", *["no-proof-tests"] * (proof_test == "forbidden"))
    assert commands(lines) == [
        ("lease", 0.0, 1.0, 1, proof_test),
        ("vent", 0.0, 1.0, 2, proof_test),
        ("hold", 8.0, 1.0, 3, proof_test),
        ("lease", 0.0, 1.0, 4, proof_test),
        ("vent", 0.0, 0.0, 5, "allowed"),
    ]


@needs("g++")
@REJECTIONS
def test_a_rejected_command_ends_the_program_and_vents_only_with_the_lease(program, sequence, result, last):
    first = candump(0.99, 0x185, force_frame(1))
    rejected, later = answer(sequence, RESULTS.codes[result], 2.0), answer(sequence, t_s=3.0)
    frames = [first, *ACCEPTED[: BEFORE_ANSWER[sequence]], rejected, later]
    done = run_with_file(program, frames, "8.0")
    code = RESULTS.codes[result]
    assert done.stderr == f"The Command was rejected with result {code}. See the results in docs/robot.md\n"
    assert done.returncode == 1
    mode, _, lease_s, *_ = commands(done.stdout.splitlines())[-1]
    assert mode == last
    assert (lease_s == 0.0) == (last == "vent")


@needs("g++")
def test_without_an_answer_to_the_lease_the_program_ends_the_lease_and_does_not_vent(program):
    lines = run_listener(program, [candump(0.99, 0x185, force_frame(1))], "8.0")
    assert [command[:3] for command in commands(lines)] == [("lease", 0.0, 1.0), ("lease", 0.0, 0.0)]


@needs("g++")
def test_the_program_ends_in_order_when_the_reader_of_its_output_has_ended(program):
    reader, writer = os.pipe()
    os.close(reader)
    with open(writer, "w") as output:
        frames = "".join(ACCEPTED).encode()
        done = subprocess.run(
            [program, "-", "8.0"],
            input=frames,
            stdout=output,
            stderr=subprocess.PIPE,
            timeout=600,
            check=False,
        )
    assert (done.returncode, done.stderr) == (0, b"")  # a signal would prevent the vent


@needs("g++")
def test_the_hold_waits_until_the_balloon_that_was_held_before_is_vented(program):
    """A Status just after the Answer to the vent can still show the old balloon."""
    old = candump(1.022, 0x385, status_frame("holding"))
    seen = [
        candump(2.0 + n / 100, 0x385, status_frame(state))
        for n, state in enumerate(("venting", "vented", "inflating", "settling", "holding"))
    ]
    first = candump(0.99, 0x185, force_frame(1))
    lines = run_listener(program, [first, *ACCEPTED[:2], old, *ACCEPTED[2:], *seen], "8.0")
    assert [mode for mode, *_ in commands(lines)][:4] == ["lease", "vent", "hold", "lease"]


@needs("g++")
@ENDS_OF_A_HOLD
def test_the_program_ends_when_the_balloon_is_vented(program, states):
    seen = [(2.0 + n / 100, 0x385, status_frame(state)) for n, state in enumerate(states)]
    later = [(3.0 + n / 10, 0x385, status_frame(states[-1])) for n in range(20)]
    done = run_with_file(program, ACCEPTED + [candump(*line) for line in seen + later], "8.0")
    assert f"The hold has ended: the state is {states[-1]}: " in done.stderr
    assert ("names the fault" in done.stderr) == (states[-1] == "tripped")
    assert done.returncode == 1
    assert done.stdout.count("Status ") == len(states) + 1
    assert commands(done.stdout.splitlines())[-1][0] == "vent"


@needs("g++")
@pytest.mark.parametrize("setpoint", ["nan", "1.9", "12.1", "text", "8,5", "8.5 kPa", ""])
def test_the_program_rejects_a_setpoint_outside_the_range(program, setpoint):
    done = run_with_file(program, [], setpoint)
    assert done.returncode == 2
    assert re.fullmatch(f'The setpoint "{setpoint}" is not a number from 2 to 12 kPa\\..*\n', done.stderr)
    assert not done.stdout


@needs("g++")
def test_after_a_pause_the_program_uses_only_the_last_waiting_force(program):
    """In a pipe, the lines are the frames of a running instrument."""
    frames = [force_frame(n % 256, force_mn=3000 if n == 399 else 1000) for n in range(400)]
    lines = [candump(10.0 + n / 100, 0x185, data) for n, data in enumerate(frames)]
    done = subprocess.run(
        [program, "-"], input="".join(lines), capture_output=True, text=True, timeout=600, check=True
    )
    assert done.stdout.count("Force ") == 400
    used = re.findall("speed=(.*?) ", done.stdout)
    assert "1.000" not in used
    assert "-3.000" in used
