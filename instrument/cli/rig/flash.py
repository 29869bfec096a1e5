"""`pneuforce flash`: write the firmware to an Arduino UNO, and print the version that the board reports."""

from __future__ import annotations

import shlex

from pneuforce.instrument.cli.terminal.output import print_done
from pneuforce.instrument.commissioning.firmware_upload import upload, upload_command
from pneuforce.protocol.firmware_version import format_version
from pneuforce.protocol.frames import PROTOCOL_VERSION
from pneuforce.sim.avr.toolchain import HEX, SKETCH
from pneuforce.sim.board.board import FIRMWARE_REVISION

#: Result of a dry run.
NOTHING = "nothing was written, because of --dry-run"


def run_flash(port: str, dry_run: bool, as_json: bool = False) -> None:
    """Flash the board at `port`, and print the firmware version that the board reports.

    With `dry_run`, the avrdude command is printed but not run. Raises ConfigurationError, RigError.
    """
    command = upload_command(port, HEX)
    plan = {
        "firmware": format_version(FIRMWARE_REVISION),
        "protocol": PROTOCOL_VERSION,
        "sketch": str(SKETCH),
    }
    if not as_json:
        print("firmware {firmware}, protocol {protocol}, made from {sketch}".format(**plan))
        print(shlex.join(command), flush=True)
    answer = None
    if not dry_run:
        hello, reported = upload(port, HEX)
        answer = {
            "firmware": format_version(hello.firmware),
            "image": f"{reported.image_crc:08X}",
            "serial": hello.serial,
        }
    if as_json or answer:
        done = (
            "firmware {firmware}, image {image} answers, board {serial}".format(**answer)
            if answer
            else NOTHING
        )
        print_done(done, as_json, **plan, command=command, answers=answer)
