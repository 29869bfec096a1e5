"""Flashing, with an avrdude that only writes down what it is asked: no board is flashed here."""

import json
import re

import pytest

from instrument.cli import flash
from instrument.errors import ConfigurationError, PortBusy, RigError
from instrument.rig.port import SerialPort
from sim.avr.toolchain import HEX, SKETCH
from tests.instrument.plugged import Cable

AVRDUDE = """#!/bin/sh
echo "$@" >> {log}
case "$*" in
*signature*) echo "{signature}" ;;
*) {writes} ;;
esac
"""


@pytest.fixture
def cable(tmp_path):
    cable = Cable(tmp_path / "rig")
    yield cable
    for board in cable.boards:
        board.end()


@pytest.fixture
def avrdude(tmp_path, monkeypatch):
    """Puts a fake on PATH; what it was asked is in the file that comes back."""

    def made(signature="0x1e,0x95,0xf", writes="exit 0"):
        log, program = tmp_path / "asked", tmp_path / "bin" / "avrdude"
        program.parent.mkdir()
        program.write_text(AVRDUDE.format(log=log, signature=signature, writes=writes))
        program.chmod(0o755)
        monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")
        log.touch()
        return log

    return made


def test_the_signature_is_read_the_firmware_written_and_the_boards_answer_awaited(avrdude, cable, capsys):
    log, board = avrdude(), cable.plug()
    flash.run_flash(str(cable.path), dry_run=False)
    where = f"-q -p atmega328p -c arduino -P {cable.path} -b 115200"
    assert log.read_text().splitlines() == [
        f"{where} -U signature:r:-:h",
        f"{where} -D -U flash:w:{HEX}:i",
    ]
    assert "firmware 1.0 answers" in capsys.readouterr().out
    assert board.state.name == "VENTED"


def test_another_chip_is_refused_and_nothing_is_written(avrdude, cable):
    log = avrdude(signature="0x1e,0x98,0x1")
    cable.plug()
    with pytest.raises(RigError, match=r"not an ATmega328P .*0x1e,0x98,0x1.*nothing was written"):
        flash.run_flash(str(cable.path), dry_run=False)
    assert "flash:w" not in log.read_text()


def test_a_port_in_use_is_refused_before_avrdude_runs(avrdude, cable):
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
        f"firmware 1.0, protocol 1, made from {SKETCH}",
        f"avrdude -q -p atmega328p -c arduino -P /dev/ttyACM9 -b 115200 -D -U flash:w:{HEX}:i",
    ]
    assert log.read_text() == ""


def test_what_avrdude_says_when_it_fails_is_told(avrdude, cable):
    avrdude(writes="echo 'programmer is not responding' >&2; exit 1")
    cable.plug()
    with pytest.raises(RigError, match=r"avrdude failed: programmer is not responding; .*reset button"):
        flash.run_flash(str(cable.path), dry_run=False)


@pytest.mark.parametrize(
    ("said", "quoted"),
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
        ("\\navrdude done.  Thank you.\\n", "it said nothing"),
    ],
)
def test_of_what_avrdude_says_the_error_is_told_not_the_farewell(avrdude, cable, said, quoted):
    avrdude(writes=f'printf "{said}" >&2; exit 1')
    cable.plug()
    with pytest.raises(RigError, match=re.escape(f"avrdude failed: {quoted}; with")):
        flash.run_flash(str(cable.path), dry_run=False)


def test_a_program_is_told_what_was_run_and_who_answered(avrdude, cable, capsys):
    avrdude()
    cable.plug()
    flash.run_flash(str(cable.path), dry_run=False, as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert told["answers"]["firmware"] == told["firmware"] == "1.0"
    assert told["command"][0] == "avrdude"


def test_without_avrdude_one_sentence_says_what_to_do(cable, monkeypatch, tmp_path):
    cable.plug()
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ConfigurationError, match="apt-get install avrdude"):
        flash.run_flash(str(cable.path), dry_run=False)


def test_a_rig_behind_the_network_is_not_flashed():
    with pytest.raises(ConfigurationError, match="not a port of this machine"):
        flash.run_flash("socket://10.0.0.1:4000", dry_run=False)
