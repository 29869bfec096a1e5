"""Tests of flashing with a fake avrdude that only logs its arguments. No board is flashed."""

import json
import re

import pytest

from pneuforce.errors import ConfigurationError, PortBusy, RigError
from pneuforce.instrument.cli.rig import flash
from pneuforce.protocol.firmware_images import IMAGES
from pneuforce.sim.avr.toolchain import HEX, SKETCH
from pneuforce.support.serial_port import SerialPort

AVRDUDE = """#!/bin/sh
echo "$@" >> {log}
case "$*" in
*signature*) echo "{signature}" ;;
*) {writes} ;;
esac
"""


@pytest.fixture
def avrdude(tmp_path, monkeypatch):
    """Return a function that puts a fake avrdude on PATH and returns the log file of its arguments."""

    def create(signature="0x1e,0x95,0xf", writes="exit 0"):
        log, program = tmp_path / "arguments", tmp_path / "bin" / "avrdude"
        program.parent.mkdir()
        program.write_text(AVRDUDE.format(log=log, signature=signature, writes=writes))
        program.chmod(0o755)
        monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")
        log.touch()
        return log

    return create


def test_flashing_reads_the_signature_writes_the_firmware_and_waits_for_the_board(avrdude, cable, capsys):
    log, board = avrdude(), cable.plug()
    flash.run_flash(str(cable.path), dry_run=False)
    options = f"-q -p atmega328p -c arduino -P {cable.path} -b 115200"
    assert log.read_text().splitlines() == [
        f"{options} -U signature:r:-:h",
        f"{options} -D -U flash:w:{HEX}:i",
    ]
    assert f"firmware 1.2, image {IMAGES[0x102]:08X} answers" in capsys.readouterr().out
    assert board.state.name == "VENTED"


def test_a_board_that_answers_with_another_image_is_an_error(avrdude, cable):
    avrdude()
    cable.plug().image_crc = 0xDEADBEEF
    with pytest.raises(RigError, match=r"DEADBEEF.*not a released image.*flash again"):
        flash.run_flash(str(cable.path), dry_run=False)


def test_another_chip_is_rejected_and_nothing_is_written(avrdude, cable):
    log = avrdude(signature="0x1e,0x98,0x1")
    cable.plug()
    with pytest.raises(RigError, match=r"not an ATmega328P .*0x1e,0x98,0x1.*nothing was written"):
        flash.run_flash(str(cable.path), dry_run=False)
    assert "flash:w" not in log.read_text()


def test_a_port_in_use_is_rejected_before_avrdude_runs(avrdude, cable):
    log = avrdude()
    cable.plug()
    port = SerialPort(str(cable.path))
    with pytest.raises(PortBusy):
        flash.run_flash(str(cable.path), dry_run=False)
    port.close()
    assert log.read_text() == ""


def test_a_dry_run_prints_the_command_and_runs_nothing(avrdude, cable, capsys):
    log = avrdude()
    flash.run_flash("/dev/ttyACM9", dry_run=True)
    assert capsys.readouterr().out.splitlines() == [
        f"firmware 1.2, protocol 1, made from {SKETCH}",
        f"avrdude -q -p atmega328p -c arduino -P /dev/ttyACM9 -b 115200 -D -U flash:w:{HEX}:i",
    ]
    assert log.read_text() == ""


def test_the_error_of_avrdude_is_reported(avrdude, cable):
    avrdude(writes="echo 'programmer is not responding' >&2; exit 1")
    cable.plug()
    with pytest.raises(RigError, match=r"avrdude failed: programmer is not responding; .*reset button"):
        flash.run_flash(str(cable.path), dry_run=False)


@pytest.mark.parametrize(
    ("stderr", "reported"),
    [
        (
            "avrdude: stk500_recv(): programmer is not responding\\n"
            "avrdude error: unable to open port /dev/ttyACM0 for programmer arduino\\n\\n"
            "avrdude done.  Thank you.\\n",
            "avrdude error: unable to open port /dev/ttyACM0 for programmer arduino",
        ),
        (
            "avrdude: ser_open(): can't open device: No such device\\n\\navrdude done.  Thank you.\\n",
            "avrdude: ser_open(): can't open device: No such device",
        ),
        (
            "avrdude ERROR: cannot set signals\\navrdude OS error: Inappropriate ioctl\\navrdude done.\\n",
            "avrdude ERROR: cannot set signals",
        ),
        ("\\navrdude done.  Thank you.\\n", "no message"),
    ],
)
def test_the_error_line_of_avrdude_is_reported_and_not_its_last_line(avrdude, cable, stderr, reported):
    avrdude(writes=f'printf "{stderr}" >&2; exit 1')
    cable.plug()
    with pytest.raises(
        RigError, match=re.escape(f"avrdude failed: {reported}; check cable and board, then flash again")
    ):
        flash.run_flash(str(cable.path), dry_run=False)


def test_json_contains_the_command_and_the_answer_of_the_board(avrdude, cable, capsys):
    avrdude()
    cable.plug()
    flash.run_flash(str(cable.path), dry_run=False, as_json=True)
    result = json.loads(capsys.readouterr().out)
    assert result["answers"]["firmware"] == result["firmware"] == "1.2"
    assert result["command"][0] == "avrdude"


def test_a_missing_avrdude_is_reported_with_the_package_to_install(cable, monkeypatch, tmp_path):
    cable.plug()
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ConfigurationError, match="apt-get install avrdude"):
        flash.run_flash(str(cable.path), dry_run=False)


def test_a_rig_behind_the_network_is_not_flashed():
    with pytest.raises(ConfigurationError, match="not a port of this machine"):
        flash.run_flash("socket://10.0.0.1:4000", dry_run=False)
