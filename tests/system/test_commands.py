"""The commands as typed: their answers, exit codes and sentences."""

import json
import os
import re
import select
import socket
import subprocess
import sys
import tomllib
from contextlib import ExitStack
from importlib.metadata import version

import pytest

from registers.views import VIEWS
from tests.typed import pneuforce
from teststand.children import ChildFailed
from teststand.stack import start


def estimate(*arguments):
    answered = pneuforce("estimate", *arguments, "--json")
    assert answered.returncode == 0, answered.stderr
    return json.loads(answered.stdout)


def test_estimate_gives_the_force_and_the_shape_of_a_contact():
    answer = estimate("--dpi", "8.0", "--dpf", "9.2")
    assert answer["force_n"] == pytest.approx(1.5203, abs=1e-3)
    assert answer["indentation_mm"] == pytest.approx(3.2327, abs=1e-3)
    assert answer["radius_mm"] == pytest.approx(8.2423, abs=1e-4)
    assert answer["radius_final_mm"] == pytest.approx(8.8146, abs=1e-3)
    assert answer["contact_radius_mm"] == pytest.approx(7.2527, abs=1e-3)
    assert (answer["method"], answer["valid"], answer["reasons"]) == ("energetic", True, [])


def test_the_older_methods_are_there_for_comparison():
    forces = [
        estimate("--dpi", "10", "--dpf", "11.5", "--method", m)["force_n"]
        for m in ("shanahan", "energetic", "lulevich")
    ]
    assert forces == sorted(forces)


def test_outside_the_validated_pressures_the_answer_is_not_valid_and_says_why():
    answer = estimate("--dpi", "3", "--dpf", "4")
    assert answer["valid"] is False
    assert "outside the validated" in answer["reasons"][0]


def test_below_half_a_kilopascal_the_answer_is_interpolated_and_says_so():
    low, end = estimate("--dpi", "8", "--dpf", "8.25"), estimate("--dpi", "8", "--dpf", "8.5")
    assert low["force_n"] == pytest.approx(end["force_n"] / 2)
    assert "interpolated" in low["reasons"][0]
    assert end["reasons"] == []


def test_what_does_not_exist_is_null():
    answer = estimate("--dpi", "8", "--dpf", "49")
    assert answer["valid"] is False
    assert answer["force_n"] is answer["indentation_mm"] is answer["force_std_n"] is None
    assert answer["radius_mm"] > 8


@pytest.mark.parametrize(
    ("dpi", "dpf"),
    [
        ("nan", "9"),
        ("8", "inf"),
        ("0", "1"),
        ("-1", "1"),
        ("8", "8"),
        ("8", "7"),
        ("8", "50.1"),
        ("eight", "9"),
    ],
)
def test_pressures_that_make_no_contact_are_refused_in_one_sentence(dpi, dpf):
    refused = pneuforce("estimate", "--dpi", dpi, "--dpf", dpf)
    assert refused.returncode == 2
    assert refused.stdout == ""
    assert "Traceback" not in refused.stderr
    if dpi != "eight":
        assert len(refused.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("form", VIEWS)
def test_map_prints_the_committed_document(form):
    assert pneuforce("map", "--format", form).stdout == VIEWS[form].render()


def test_the_example_configuration_is_accepted(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text(pneuforce("config", "--example").stdout)
    tomllib.loads(file.read_text())
    assert pneuforce("config", "--check", str(file)).stdout == f"{file}: good\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[modbus]\nport = 70000\n", "modbus.port = 70000: input should be less than or equal to 65535"),
        ("[modbus]\nprot = 1\n", "modbus.prot: unknown key"),
        ("[can]\nnode_id = '5'\n", "can.node_id = '5'"),
        ("[can\n", "not TOML"),
    ],
)
@pytest.mark.parametrize("command", [("run", "--config"), ("config", "--check")])
def test_a_wrong_configuration_is_refused_with_file_key_and_span(tmp_path, command, text, said):
    file = tmp_path / "instrument.toml"
    file.write_text(text)
    refused = pneuforce(*command, str(file))
    assert refused.returncode == 2
    assert refused.stderr.startswith(f"pneuforce: {file}: ")
    assert said in refused.stderr


def test_run_without_a_rig_says_what_to_do(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text(f'[rig]\nport = "{tmp_path}/nothing"\n')
    refused = pneuforce("run", "--config", str(file))
    assert refused.returncode == 2
    assert "there is no such port" in refused.stderr


@pytest.mark.parametrize("bus", ["modbus", "can"])
def test_watching_nothing_is_a_sentence(bus):
    refused = pneuforce("watch", bus, "--port", "1", "--seconds", "1")
    assert refused.returncode == 2
    assert "is an instrument running there?" in refused.stderr
    assert len(refused.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("bus", ["modbus", "can"])
def test_watching_as_json_gives_a_line_for_each_look(lasting_stack, bus):
    port = lasting_stack.modbus_port if bus == "modbus" else lasting_stack.can_port
    seconds = "0.7" if bus == "modbus" else "2.5"  # a node listens for 1.2 s before it sends
    seen = pneuforce("watch", bus, "--port", str(port), "--seconds", seconds, "--json")
    assert seen.returncode == 0, seen.stderr
    lines = [json.loads(line) for line in seen.stdout.splitlines()]
    if bus == "modbus":
        assert lines[-1]["force"] is None
        assert lines[-1]["state"] == "vented"
    else:
        assert {"Force", "State", "Status"} <= {line["frame"] for line in lines}


def test_a_simulator_whose_control_port_is_taken_names_the_option(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        refused = pneuforce("sim", "--link", tmp_path / "rig", "--control-port", port)
    why = f"--control-port {port} is in use by another program"
    assert refused.stderr == f"pneuforce: the simulator cannot start: {why}\n"


def test_an_instrument_whose_modbus_port_is_taken_names_the_key(lasting_stack, tmp_path):
    taken = {"modbus": {"port": lasting_stack.modbus_port}}
    why = r"it is in use; end the other instrument, or change \[modbus\] port"
    with ExitStack() as children, pytest.raises(ChildFailed, match=why):
        start(children, tmp_path / "rig", ["--no-hand"], taken)


@pytest.mark.parametrize("modbus", ["enabled = false", "port = 5999"])
def test_sigterm_ends_a_host_that_still_greets_a_silent_port(tmp_path, modbus):
    board, port = os.openpty()
    file = tmp_path / "instrument.toml"
    file.write_text(f'[rig]\nport = "{os.ttyname(port)}"\n[modbus]\n{modbus}\n')
    host = subprocess.Popen(
        [sys.executable, "-m", "instrument", "run", "--config", str(file)], stderr=subprocess.PIPE, text=True
    )
    assert select.select([board], [], [], 10)[0], "it does not greet"
    assert len(os.read(board, 24)) == 24
    host.terminate()
    _, said = host.communicate(timeout=3)
    assert (host.returncode, "Traceback" in said) == (0, False)


@pytest.mark.parametrize("module", ["typer", "instrument.cli.rig_commands", "instrument.config", "pydantic"])
def test_ctrl_c_while_it_is_being_loaded_ends_quietly(module):
    typed = (
        "import os, signal, sys\n"
        "class CtrlC:\n"
        "    def find_spec(name, path=None, target=None):\n"
        f"        if name == {module!r}: os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, CtrlC)\n"
        "sys.argv = ['pneuforce', 'config', '--example']\n"
        "from instrument.cli import main\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", typed], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_the_version_is_told():
    assert pneuforce("--version").stdout == f"pneuforce {version('pneuforce')}\n"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("modbus --baud 9600", "--baud is for watch modbus --device, not for watch modbus"),
        ("modbus --node-id 7", "--node-id is for watch can, not for watch modbus"),
        ("modbus --device /dev/ttyUSB0 --port 5020", "--port is for watch modbus and watch can, not for"),
        ("can --unit 2", "--unit is for watch modbus and watch modbus --device, not for watch can"),
        ("modbus --device /dev/ttyUSB77", "/dev/ttyUSB77 cannot be opened: no such file or directory"),
    ],
)
def test_what_cannot_be_watched_so_is_a_sentence(words, said):
    refused = pneuforce("watch", *words.split(), "--seconds", "0.1")
    assert (refused.returncode, refused.stdout) == (2, "")
    assert refused.stderr.startswith(f"pneuforce: {said}")
    assert len(refused.stderr.splitlines()) == 1


@pytest.mark.parametrize("bus", ["modbus", "can"])
def test_a_port_that_no_computer_has_is_refused_with_its_span(bus):
    refused = pneuforce("watch", bus, "--port", "99999")
    assert refused.returncode == 2
    assert "65535" in refused.stderr


def test_the_check_of_a_configuration_is_told_to_a_program(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text("[modbus]\nport = 70000\n")
    refused = pneuforce("config", "--check", file, "--json")
    assert (refused.returncode, refused.stderr) == (2, "")
    told = json.loads(refused.stdout)
    assert told["good"] is False
    assert "modbus.port = 70000" in told["why"]
    file.write_text("[modbus]\nport = 5021\n")
    told = json.loads(pneuforce("config", "--check", file, "--json").stdout)
    assert told == {"file": str(file), "good": True, "doubt": None}


def test_an_instrument_without_a_bus_is_doubted(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text(f'[rig]\nport = "{tmp_path}/nothing"\n[modbus]\nenabled = false\n')
    assert "good, but no bus is enabled" in pneuforce("config", "--check", file).stdout
    assert "no bus is enabled" in pneuforce("run", "--config", file).stderr


def test_no_room_for_the_answer_is_a_sentence():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "instrument", "estimate", "--dpi", "8", "--dpf", "9"],
            stdout=full, stderr=subprocess.PIPE, text=True, timeout=30, check=False,
        )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr == "pneuforce: the output cannot be written: No space left on device\n"


def test_a_log_that_nobody_reads_holds_up_nothing():
    unread, stderr = os.pipe()
    talk = (
        "import logging, os, sys; os.set_blocking(2, True)\n"
        "from instrument.cli.logs import log_to_stderr\n"
        "import instrument.cli.logs as logs\n"
        "logs.MOST_PER_S = 10**9\n"
        "with log_to_stderr():\n"
        "    for n in range(20_000): logging.info('line %d %s', n, 'x' * 80)\n"
        "    print('done', flush=True)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", talk], stdout=subprocess.PIPE, stderr=stderr, text=True
    ) as said:
        try:
            assert said.wait(10) == 0
        finally:
            said.kill()
        assert said.stdout.read() == "done\n"
    os.close(unread)
    os.close(stderr)


def test_a_flood_of_log_lines_is_cut_and_counted():
    talk = (
        "import logging, time\n"
        "from instrument.cli.logs import log_to_stderr\n"
        "with log_to_stderr():\n"
        "    for n in range(1000): logging.info('line %d', n)\n"
        "    time.sleep(1.1)\n"
        "    logging.info('last')\n"
    )
    said = subprocess.run([sys.executable, "-c", talk], capture_output=True, text=True, check=True).stderr
    lines = said.splitlines()
    assert 20 <= len(lines) <= 41
    assert re.fullmatch(r"\d\d:\d\d:\d\d line 0", lines[0])
    assert "last (" in lines[-1]
    assert "lines held back before" in lines[-1]


def test_watching_modbus_shows_each_register_in_its_own_unit(lasting_stack):
    seen = pneuforce("watch", "modbus", "--port", str(lasting_stack.modbus_port), "--seconds", "0.2").stdout
    assert re.search(r"sample_age \d+ ms", seen)
    assert re.search(r"lease 0 ms", seen)
    assert re.search(r"pressure -?\d\.\d{3} kPa", seen)
