"""Tests of commands as a user types them: output, exit codes and error messages."""

import csv
import json
import os
import re
import select
import signal
import socket
import subprocess
import sys
import time
import tomllib
from contextlib import ExitStack, contextmanager, suppress
from importlib.metadata import version

import pytest

from pneuforce.client.address import connect
from pneuforce.client.measurement import State
from pneuforce.errors import ConnectionFailed, HoldEnded, VentNotConfirmed
from pneuforce.instrument.cli.operate.status import show_status
from pneuforce.instrument.cli.operate.vent import vent_and_confirm
from pneuforce.instrument.cli.terminal.command_words import in_command_words
from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
from pneuforce.registers.advice import FAULT_ADVICE
from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.views import VIEWS
from pneuforce.sim.server.client import SimulatorClient
from pneuforce.teststand.child_process import ChildProcessFailed
from pneuforce.teststand.stack import start
from tests.command_runner import pneuforce
from tests.instrument.cli.test_closed_output import run_without_reader
from tests.source_tree import ROOT
from tests.system.waiting import start_inflation, wait_for


def estimate(*arguments):
    answered = pneuforce("estimate", *arguments, "--json")
    answer = json.loads(answered.stdout)
    assert answered.returncode == (0 if answer["valid"] else 1), answered.stderr
    assert not answered.stderr
    return answer


def test_estimate_gives_the_force_and_the_shape_of_a_contact():
    answer = estimate("--dpi", "8.0", "--dpf", "9.2")
    assert answer["force_n"] == pytest.approx(1.5203, abs=1e-3)
    assert answer["indentation_mm"] == pytest.approx(3.2327, abs=1e-3)
    assert answer["radius_mm"] == pytest.approx(8.2423, abs=1e-4)
    assert answer["radius_final_mm"] == pytest.approx(8.8146, abs=1e-3)
    assert answer["contact_radius_mm"] == pytest.approx(7.2527, abs=1e-3)
    assert (answer["method"], answer["valid"], answer["reasons"]) == ("energetic", True, [])


def test_estimate_gives_the_energies_of_equations_4_to_7():
    answer = estimate("--dpi", "8.0", "--dpf", "10.0")
    names = ("stretching_energy_mj", "bending_energy_mj", "compression_energy_mj")
    assert [answer[name] for name in names] == pytest.approx([2.203, 0.0819, 2.428], abs=1e-3)
    other = estimate("--dpi", "8.0", "--dpf", "10.0", "--method", "lulevich")
    assert not other.keys() & set(names)


def test_the_older_methods_are_available_for_comparison():
    forces = [
        estimate("--dpi", "10", "--dpf", "11.5", "--method", m)["force_n"]
        for m in ("shanahan", "energetic", "lulevich")
    ]
    assert forces == sorted(forces)


def test_the_method_membrane_uses_the_grip_and_the_calibration(tmp_path):
    pressures = ("--dpi", "8", "--dpf", "9.2", "--method", "membrane")
    slides, middle, sticks = (estimate(*pressures, "--grip", grip) for grip in ("0", "0.5", "1"))
    assert middle["force_n"] == pytest.approx((slides["force_n"] + sticks["force_n"]) / 2)
    assert sticks["force_n"] > 1.1 * slides["force_n"]
    assert estimate(*pressures)["force_std_n"] > estimate(*pressures, "--grip-std", "0")["force_std_n"]
    file = str(tmp_path / "calibration.toml")
    weight = ("--mass-g", "120", "--before-kpa", "8", "--after-kpa", "9.1", "--out", file)
    assert "calibrate radius" in pneuforce("calibrate", "grip", *weight).stderr
    radii = str(ROOT / "docs/examples/radius.csv")
    assert pneuforce("calibrate", "radius", radii, "--out", file).returncode == 0
    assert pneuforce("calibrate", "grip", *weight).returncode == 0
    calibrated = estimate(*pressures, "--calibration", file)
    assert calibrated["grip"] not in (0.5, None)
    assert calibrated["force_std_n"] < middle["force_std_n"]
    assert "grip" not in estimate("--dpi", "8", "--dpf", "9.2")
    unstated = ("--dpi", "8", "--dpf", "9.2", "--calibration", file)
    refused = pneuforce("estimate", *unstated)
    assert (refused.returncode, "membrane" in refused.stderr) == (2, True)
    assert "grip" not in estimate(*unstated, "--method", "energetic")
    config = tmp_path / "instrument.toml"
    config.write_text('[measurement]\ncalibration = "calibration.toml"\n')
    assert "grip" in pneuforce("config", "--check", str(config)).stdout
    config.write_text('[measurement]\ncalibration = "calibration.toml"\nmethod = "membrane"\n')
    assert "grip" not in pneuforce("config", "--check", str(config)).stdout


def test_outside_the_validated_pressures_the_answer_is_invalid_with_a_reason():
    answer = estimate("--dpi", "3", "--dpf", "4")
    assert answer["valid"] is False
    assert answer["force_n"] is answer["force_std_n"] is answer["indentation_mm"] is None
    assert answer["compression_energy_mj"] is None
    assert "outside the validated" in answer["reasons"][0]


@pytest.mark.parametrize("command", ["estimate", "uncertainty"])
def test_the_text_shows_no_number_for_a_force_that_is_not_valid(command):
    answered = pneuforce(command, "--dpi", "3", "--dpf", "4")
    assert answered.returncode == 1
    for output in (answered.stdout, answered.stderr):
        assert "4.95–11.45 kPa" in output
    assert not re.search(r"\d N\b", answered.stdout)


def test_below_half_a_kilopascal_the_answer_is_interpolated_with_a_note():
    low, end = estimate("--dpi", "8", "--dpf", "8.25"), estimate("--dpi", "8", "--dpf", "8.5")
    assert low["force_n"] == pytest.approx(end["force_n"] / 2)
    assert "interpolated" in low["reasons"][0]
    assert end["reasons"] == []


def test_a_value_that_does_not_exist_is_null():
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
def test_pressures_without_a_contact_are_rejected_in_one_sentence(dpi, dpf):
    refused = pneuforce("estimate", "--dpi", dpi, "--dpf", dpf)
    assert refused.returncode == 2
    assert refused.stdout == ""
    assert "Traceback" not in refused.stderr
    if dpi != "eight":
        assert len(refused.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("form", VIEWS)
def test_map_prints_the_committed_document(form):
    assert pneuforce("map", "--format", form).stdout == VIEWS[form].render()


@pytest.mark.parametrize("form", ["dbc", "csv", "eds", "h"])
def test_map_prints_the_document_of_a_node_or_rejects_the_node_id(form):
    done = pneuforce("map", "--format", form, "--node-id", "9")
    if render := VIEWS[form].render_node:
        assert done.stdout == render(9) != VIEWS[form].render()
    else:
        assert (done.returncode, done.stdout) == (2, "")
        assert f"--node-id has no effect on the format {form}" in done.stderr


def test_the_example_configuration_is_accepted(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text(pneuforce("config", "--example").stdout)
    tomllib.loads(file.read_text())
    good, hash_line = pneuforce("config", "--check", str(file)).stdout.splitlines()
    assert good == f"{file}: good"
    assert re.fullmatch("configuration hash [0-9a-f]{8}", hash_line)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[modbus]\nport = 70000\n", "modbus.port = 70000: "),
        ("[modbus]\nprot = 1\n", "modbus.prot: unknown key"),
        ("[can]\nnode_id = '5'\n", "can.node_id = '5'"),
        ("[can\n", "not TOML"),
    ],
)
@pytest.mark.parametrize("command", [("run", "--config"), ("config", "--check")])
def test_an_invalid_configuration_is_rejected_with_file_key_and_limits(tmp_path, command, text, message):
    file = tmp_path / "instrument.toml"
    file.write_text(text)
    refused = pneuforce(*command, str(file))
    assert refused.returncode == 78
    assert refused.stderr.startswith(f"pneuforce: {file}: ")
    assert message in refused.stderr


def test_run_without_a_rig_reports_the_missing_port(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text(f'[rig]\nport = "{tmp_path}/nothing"\n')
    refused = pneuforce("run", "--config", str(file))
    assert refused.returncode == 69
    assert "there is no such port" in refused.stderr


@pytest.mark.parametrize("bus", ["modbus", "can"])
def test_watching_without_an_instrument_is_reported_in_one_sentence(bus):
    refused = pneuforce("watch", bus, "--port", "1", "--seconds", "1")
    assert refused.returncode == 69
    assert "is an instrument running there?" in refused.stderr
    assert len(refused.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("bus", ["modbus", "can"])
def test_watching_as_json_prints_a_line_for_each_reading(shared_stack, bus):
    port = shared_stack.modbus_port if bus == "modbus" else shared_stack.can_port
    seconds = "0.7" if bus == "modbus" else "2.5"  # a node listens for 1.2 s before it sends
    seen = pneuforce("watch", bus, "--port", str(port), "--seconds", seconds, "--json")
    assert seen.returncode == 0, seen.stderr
    lines = [json.loads(line) for line in seen.stdout.splitlines()]
    if bus == "modbus":
        assert lines[-1]["force"] is None
        assert lines[-1]["state"] == "vented"
    else:
        assert {"Force", "State", "Status"} <= {line["frame"] for line in lines}


@pytest.mark.parametrize("words", [("watch", "modbus"), ("watch", "can"), ("canlog",)])
def test_a_command_on_a_bus_ends_when_the_reader_of_its_output_has_ended(shared_stack, words):
    port = shared_stack.modbus_port if "modbus" in words else shared_stack.can_port
    code, stderr = run_without_reader(*words, "--port", port)
    assert (code, "Traceback" in stderr) == (ExitCode.IO_ERROR, False)


def test_a_control_port_in_use_is_reported_with_its_option(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        refused = pneuforce("sim", "run", "--link", tmp_path / "rig", "--control-port", port)
    why = f"--control-port {port} is in use by another program"
    assert refused.stderr == f"pneuforce: the simulator cannot start: {why}\n"


def test_a_modbus_port_in_use_is_reported_with_its_key(shared_stack, tmp_path):
    taken = {"modbus": {"port": shared_stack.modbus_port}}
    why = r"another program uses port \d+; end this program, or change \[modbus\] port"
    with ExitStack() as children, pytest.raises(ChildProcessFailed, match=why):
        start(children, tmp_path / "rig", ["--no-hand"], taken)


@pytest.mark.parametrize("modbus", ["enabled = false", "port = 5999"])
def test_sigterm_ends_a_host_process_during_the_handshake(tmp_path, modbus):
    """A shell script starts a background job with SIGINT ignored, and the job then keeps ignoring SIGINT."""
    board, port = os.openpty()
    file = tmp_path / "instrument.toml"
    file.write_text(f'[rig]\nport = "{os.ttyname(port)}"\n[modbus]\n{modbus}\n')
    host = subprocess.Popen(
        [sys.executable, "-m", "pneuforce", "run", "--config", str(file)],
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN),
    )
    assert select.select([board], [], [], 60)[0], "the host process sends no Identify"
    assert len(os.read(board, 24)) == 24
    host.send_signal(signal.SIGINT)
    with pytest.raises(subprocess.TimeoutExpired):
        host.wait(0.2)
    host.terminate()
    _, stderr = host.communicate(timeout=60)
    assert (host.returncode, "Traceback" in stderr) == (0, False)


@pytest.mark.parametrize(
    "module", ["typer", "pneuforce.instrument.cli.rig.commands", "pneuforce.instrument.config", "pydantic"]
)
def test_ctrl_c_during_an_import_exits_without_a_traceback(module):
    program = (
        "import os, signal, sys\n"
        "class CtrlC:\n"
        "    def find_spec(name, path=None, target=None):\n"
        f"        if name == {module!r}: os.kill(os.getpid(), signal.SIGINT)\n"
        "sys.meta_path.insert(0, CtrlC)\n"
        "sys.argv = ['pneuforce', 'config', '--example']\n"
        "from pneuforce.instrument.cli import main\n"
        "main()\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_the_version_is_printed():
    assert pneuforce("--version").stdout == f"pneuforce {version('pneuforce')}\n"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("modbus --baud 9600", "--baud is for watch modbus --device, not for watch modbus"),
        ("modbus --node-id 7", "--node-id is for watch can, not for watch modbus"),
        ("modbus --device /dev/ttyUSB0 --port 5020", "--port is for watch modbus and watch can, not for"),
        ("can --unit 2", "--unit is for watch modbus and watch modbus --device, not for watch can"),
        ("modbus --device /dev/ttyUSB77", "/dev/ttyUSB77 cannot be opened: no such file or directory"),
    ],
)
def test_options_that_do_not_go_together_are_rejected_in_one_sentence(words, message):
    refused = pneuforce("watch", *words.split(), "--seconds", "0.1")
    assert (refused.returncode, refused.stdout) == (69 if "ttyUSB77" in message else 2, "")
    assert refused.stderr.startswith(f"pneuforce: {message}")
    assert len(refused.stderr.splitlines()) == 1


@pytest.mark.parametrize("bus", ["modbus", "can"])
def test_an_invalid_tcp_port_is_rejected_with_the_limit(bus):
    refused = pneuforce("watch", bus, "--port", "99999")
    assert refused.returncode == 2
    assert "65535" in refused.stderr


def test_the_check_of_a_configuration_can_be_printed_as_json(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text("[modbus]\nport = 70000\n")
    refused = pneuforce("config", "--check", file, "--json")
    assert (refused.returncode, refused.stderr) == (78, "")
    result = json.loads(refused.stdout)
    assert (result["ok"], result["code"]) == (False, "configuration")
    assert "modbus.port = 70000" in result["message"]
    file.write_text("[modbus]\nport = 5021\n")
    result = json.loads(pneuforce("config", "--check", file, "--json").stdout)
    assert (result["ok"], result["message"]) == (True, f"{file}: good")
    signatures = {"configuration": "unsigned", "calibration": "no file"}
    expected = {"file": str(file), "warning": None, "notes": [], "signatures": signatures}
    assert re.fullmatch("[0-9a-f]{8}", result.pop("configuration_hash"))
    assert {name: result[name] for name in expected} == expected


def test_wrong_values_and_missing_files_are_reported_at_once(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text(
        '[modbus]\nport = 70000\n[rig]\nprot = "x"\n[bogus]\na = 1\n[measurement]\ncalibration = "no.toml"\n'
        '[events]\nfile = 5\n[web]\nenabled = true\nhost = "0.0.0.0"\n'
        'certificate = "no.pem"\nkey = "no.key"\n'
    )
    refused = pneuforce("config", "--check", file)
    keys = re.findall(rf"^(?:pneuforce: )?{file}: ([\w.]+)", refused.stderr, re.MULTILINE)
    wrong = {"modbus.port", "rig.prot", "bogus", "events.file", "web.allow"}
    assert (refused.returncode, wrong - set(keys)) == (78, set())
    assert {"measurement.calibration"} <= set(keys)
    assert len(keys) == len(set(keys))
    file.write_text(file.read_text().replace('host = "0.0.0.0"\n', ""))
    refused = pneuforce("config", "--check", file).stderr
    assert all(name in refused for name in ("web.certificate", "web.key", "no.toml", "modbus.port"))


def test_a_configuration_without_a_bus_gives_a_warning(tmp_path):
    file = tmp_path / "instrument.toml"
    file.write_text(f'[rig]\nport = "{tmp_path}/nothing"\n[modbus]\nenabled = false\n')
    assert "good, but no bus is enabled" in pneuforce("config", "--check", file).stdout
    assert "no bus is enabled" in pneuforce("run", "--config", file).stderr


def test_a_full_output_is_reported_in_one_sentence():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "pneuforce", "estimate", "--dpi", "8", "--dpf", "9"],
            stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False,
        )  # fmt: skip
    assert done.returncode == 74
    why = "No space left on device: free space on the disk, or write to another disk"
    assert done.stderr == f"pneuforce: the output cannot be written: {why}\n"


def test_a_log_without_a_reader_does_not_block_the_program():
    unread, stderr = os.pipe()
    program = (
        "import logging, os, sys; os.set_blocking(2, True)\n"
        "from pneuforce.instrument.service.stderr_log import log_to_stderr\n"
        "import pneuforce.instrument.service.stderr_log as logs\n"
        "logs.INFORMATION = logs.LogLimit(10**9, 1000)\n"
        "with log_to_stderr():\n"
        "    for n in range(20_000): logging.info('line %d %s', n, 'x' * 80)\n"
        "    print('done', flush=True)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=stderr, text=True
    ) as process:
        try:
            assert process.wait(60) == 0
        finally:
            process.kill()
        assert process.stdout.read() == "done\n"
    os.close(unread)
    os.close(stderr)


def test_a_flood_of_log_lines_is_limited_and_counted():
    program = (
        "import logging, time\n"
        "from pneuforce.instrument.service.stderr_log import log_to_stderr\n"
        "with log_to_stderr():\n"
        "    for n in range(1000): logging.info('line %d', n)\n"
        "    time.sleep(1.1)\n"
        "    logging.info('last')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    lines = done.stderr.splitlines()
    assert 20 <= len(lines) <= 41
    assert re.fullmatch(r"\d\d:\d\d:\d\d line 0", lines[0])
    assert "last (" in lines[-1]
    assert re.search(r"last \(\d+ lines ", lines[-1])


def test_watching_modbus_shows_each_register_in_its_own_unit(shared_stack):
    seen = pneuforce("watch", "modbus", "--port", str(shared_stack.modbus_port), "--seconds", "0.2").stdout
    for line in seen.splitlines():
        assert re.search(r"sample_age +\d+ ms", line)
        assert re.search(r"pressure +-?\d\.\d{3} kPa", line)


# ---- operation of a running instrument


@pytest.fixture
def operate(shared_stack):
    """Return a function that runs a command at the shared instrument. At the end, the rig is vented."""

    def run(*words):
        return pneuforce(*words, "--port", shared_stack.modbus_port, timeout_s=60)

    yield run
    with shared_stack.plc() as plc:
        plc.vent()
        plc.write("lease", 0.0)
        plc.run_command("clear_faults")


def printed_json(done):
    return json.loads(done.stdout)


@contextmanager
def holding(stack, *words):
    """Run `pneuforce hold` in the background."""
    command = [sys.executable, "-m", "pneuforce", "hold", *words, "--port", str(stack.modbus_port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def test_the_status_of_a_vented_rig_as_json_is_null_without_a_value(operate):
    shown = wait_for(
        lambda: printed_json(operate("status", "--json")),
        lambda s: s["state"] == "vented" and "not_zeroed" not in s["status"],
    )
    for key in ("first_out_fault", "force_n", "force_std_n", "setpoint_kpa", "radius_mm", "lease"):
        assert shown[key] is None, key
    assert "function_check" in shown["no_force_because"]
    assert shown["no_force_remedy"]
    assert shown["versions"]["map_hash"] == f"{MAP_HASH:08x}"
    text = operate("status").stdout
    assert re.search(
        r"^force +not available: .*: pneuforce hold [0-9.]+ \(with the same options for the address\)$",
        text,
        re.MULTILINE,
    )
    assert re.search("^fault +none$", text, re.MULTILINE)


def test_a_hold_is_shown_changed_pressed_and_ended_by_a_vent(shared_stack, operate):
    control = shared_stack.control.getpeername()[1]
    with holding(shared_stack, "2.0", "--json") as process:
        assert json.loads(process.stdout.readline())["pressure_kpa"] == pytest.approx(2.0, abs=0.3)
        assert printed_json(operate("status", "--json"))["lease"]["holder"] == "modbus_tcp"
        assert operate("set", "2.1").returncode == ExitCode.DONE
        second = operate("hold", "3.0", "--json")
        assert (second.returncode, printed_json(second)["code"]) == (ExitCode.REJECTED, "rejected")
        assert shared_stack.plc().read()["setpoint"] == pytest.approx(2.1)
        assert pneuforce("press", "0.2", "--control", control).returncode == ExitCode.DONE
        wait_for(SimulatorClient(control).truth, lambda truth: truth["applied_n"] == 0.2)
        table = pneuforce("sim", "truth", "--seconds", "0.3", "--every", "10", "--control", control).stdout
        rows = list(csv.DictReader(table.splitlines()))
        assert {row["applied_n"] for row in rows} == {"0.2"}
        assert {int(row["sample"]) % 10 for row in rows} == {0}
        assert pneuforce("sim", "press", "--release", "--control", control).returncode == ExitCode.DONE
        silenced = printed_json(pneuforce("sim", "hand", "off", "--control", control, "--json"))
        assert (silenced["code"], silenced["hand"]) == ("done", False)
        unconfirmed = operate("vent", "--timeout", "0", "--json")
        assert unconfirmed.returncode == ExitCode.VENT_NOT_CONFIRMED
        assert printed_json(unconfirmed)["code"] == "vent_not_confirmed"
        assert operate("vent").returncode == ExitCode.DONE
        stdout, stderr = process.communicate(timeout=60)
        last = json.loads(stdout.splitlines()[-1])
        assert (process.returncode, last["code"], stderr) == (ExitCode.HOLD_ENDED, "hold_ended", "")
    registers = shared_stack.plc().read()
    assert (registers["state"], registers["lease_holder"]) == ("vented", "none")


def test_ctrl_c_ends_a_hold_with_a_confirmed_vent(shared_stack, operate):
    with holding(shared_stack, "5.0") as process:
        process.stderr.readline()  # the rig is vented, then the inflation begins
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=60)
    assert (process.returncode, "Traceback" in stderr) == (ExitCode.DONE, False)
    assert "Vented" in stdout
    assert shared_stack.plc().read()["lease_holder"] == "none"


def test_a_hold_that_a_stopped_instrument_has_ended_reports_the_fault_and_the_confirmed_vent(
    shared_stack, operate
):
    with holding(shared_stack, "2.0", "--json") as process:
        process.stdout.readline()
        shared_stack.host.send(signal.SIGSTOP)
        time.sleep(4.0)  # two requests (1 s each) fail, and the vent after them succeeds
        shared_stack.host.send(signal.SIGCONT)
        result = json.loads(process.communicate(timeout=60)[0].splitlines()[-1])
    assert (process.returncode, result["code"]) == (ExitCode.HOLD_ENDED, "hold_ended")
    assert result["fault"]["name"] in ("link_lost", "host_silent", "lease_expired")
    for part in ("did not answer for a time", "Vented: the sensor reads", "has tripped"):
        assert part in result["message"]
    assert wait_for(lambda: operate("clear").returncode, lambda code: code == ExitCode.DONE) == ExitCode.DONE


def test_a_hold_that_trips_or_is_rejected_names_the_reason_and_the_fault_and_its_remedy(
    shared_stack, operate
):
    words = ("2.0", "--json", "--lease", "60")  # the command renews this lease every 20 s
    with holding(shared_stack, *words) as process, shared_stack.plc() as plc:
        process.stdout.readline()  # the balloon is held
        plc.write("lease", 0.2)
        tripped = json.loads(process.communicate(timeout=60)[0].splitlines()[-1])
    assert (process.returncode, tripped["code"]) == (ExitCode.HOLD_ENDED, "hold_ended")
    remedy = in_command_words(FAULT_ADVICE[32].do)
    assert (tripped["reason"], tripped["remedy"]) == ("tripped", remedy)
    rejected = operate("hold", "2.0", "--json")
    assert rejected.returncode == ExitCode.REJECTED
    result = printed_json(rejected)
    assert (result["code"], result["reason"]) == ("rejected", "fault_latched")
    assert remedy in result["remedy"]
    assert tripped["fault"] == result["fault"]
    assert (result["fault"]["code"], result["fault"]["name"]) == (32, "lease_expired")
    status = printed_json(operate("status", "--json"))
    fault = status["first_out_fault"]
    assert (fault["name"], fault["remedy"]) == ("lease_expired", remedy)
    assert status["latched_faults"] == ["lease_expired"]
    assert printed_json(operate("clear", "--json"))["cleared"] == ["lease_expired"]
    assert printed_json(operate("clear", "--json"))["cleared"] == []
    wait_for(lambda: operate("zero").returncode, lambda code: code == ExitCode.DONE)  # needs vented samples
    assert operate("release").returncode == ExitCode.DONE
    assert printed_json(operate("new-balloon", "7", "--json"))["balloon_id"] == 7
    assert shared_stack.plc().read_all()["balloon_id"] == 7


def test_a_balloon_without_a_lease_is_taken_over_only_on_request(shared_stack, operate):
    with shared_stack.plc() as plc:
        start_inflation(plc, 2.0)
        assert operate("hold", "2.5").returncode == ExitCode.REJECTED
        assert plc.read()["mode"] == "hold"
    assert operate("hold", "2.5", "--take-over", "--seconds", "0").returncode == ExitCode.DONE


def test_while_a_robot_has_the_lease_each_rejection_says_what_was_done(shared_stack, operate):
    url = f"can://socketcand/can0?host=127.0.0.1&port={shared_stack.can_port}"
    with connect(url) as robot, suppress(HoldEnded), robot.hold(2.0):
        second = printed_json(operate("hold", "2.5", "--json"))
        assert "--take-over" not in second["message"]
        assert "a client of can" in second["message"]
        assert printed_json(operate("zero", "--json"))["message"].startswith("zero_pressure was rejected")
        assert robot.read().state is State.HOLDING
        released = printed_json(operate("release", "--json"))
        assert (released["code"], released["reason"]) == ("rejected", "lease")
        assert "client of can" in released["message"]
        assert released["message"].startswith("Vented")
    wait_for(shared_stack.plc().read, lambda registers: registers["state"] == "vented")


def test_the_force_limit_is_written(shared_stack, operate):
    assert printed_json(operate("limit", "4.5", "--json"))["force_limit_n"] == 4.5
    assert shared_stack.plc().read_all()["force_limit"] == 4.5
    assert operate("limit", "0").returncode == ExitCode.USAGE
    assert operate("limit", "5").returncode == ExitCode.DONE


def test_a_setpoint_without_a_force_gives_a_warning(operate):
    done = operate("set", "4.9", "--json")
    assert "4.95 to 11.45 kPa" in printed_json(done)["warning"]
    assert (done.returncode, done.stderr) == (ExitCode.DONE, "")
    assert "4.95 to 11.45 kPa" in operate("set", "11.5").stderr
    assert printed_json(operate("set", "6", "--json"))["warning"] is None


def test_a_vent_is_sent_to_an_instrument_of_another_version(shared_stack, monkeypatch):
    with shared_stack.plc() as plc:
        start_inflation(plc, 2.0)
        monkeypatch.setattr("pneuforce.client.modbus_connection.MAP_HASH", 99)
        with pytest.raises(VentNotConfirmed, match="the vent was sent"):
            vent_and_confirm(f"tcp://127.0.0.1:{shared_stack.modbus_port}", 5.0, as_json=True)
        wait_for(plc.read, lambda registers: registers["state"] == "vented")


def test_the_status_of_an_instrument_with_another_register_map_contains_a_warning(
    shared_stack, operate, monkeypatch, capsys
):
    assert printed_json(operate("status", "--json"))["warning"] is None
    url = f"tcp://127.0.0.1:{shared_stack.modbus_port}"
    monkeypatch.setattr("pneuforce.client.modbus_connection.MAP_HASH", 0xFACADE)
    monkeypatch.setattr("pneuforce.instrument.cli.operate.status.MAP_HASH", 0xFACADE)
    with pytest.raises(ConnectionFailed, match=f"hash {MAP_HASH:08x}.*program .00facade"):
        connect(url)
    show_status(url, as_json=True)
    shown = json.loads(capsys.readouterr().out)
    assert f"{MAP_HASH:08x}" in shown["warning"]
    assert "00facade" in shown["warning"]
    assert shown["pressure_kpa"] is not None
    show_status(url, as_json=False)
    assert capsys.readouterr().out.startswith("warning ")


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (("status", "--port", "1"), ExitCode.UNAVAILABLE),
        (("hold", "nan", "--port", "1"), ExitCode.USAGE),
        (("set", "12.5", "--port", "1"), ExitCode.USAGE),
        (("status", "--device", "/dev/ttyUSB77"), ExitCode.UNAVAILABLE),
        (("status", "--device", "/dev/ttyUSB77", "--port", "5020"), ExitCode.USAGE),
        (("status", "--baud", "9600"), ExitCode.USAGE),
        (("press", "--control", "1"), ExitCode.USAGE),
        (("press", "1", "--release", "--control", "1"), ExitCode.USAGE),
        (("press", "1", "--control", "1"), ExitCode.UNAVAILABLE),
    ],
)
def test_a_command_that_cannot_be_sent_has_its_code(words, code):
    done = pneuforce(*words)
    assert (done.returncode, "Traceback" in done.stderr) == (code, False), done.stderr
