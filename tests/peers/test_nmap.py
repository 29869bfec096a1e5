"""Test that the Modbus scan of nmap finds and identifies the instrument."""

import re
import subprocess
from importlib.metadata import version

from tests.tools import needs

pytestmark = needs("nmap")


def test_nmap_finds_exactly_one_unit_and_identifies_it(instrument):
    # "+" runs the script for a port other than 502. The script sends function 17, which is not supported. The
    # exception in the answer nevertheless shows that the unit exists.
    script = ["--script", "+modbus-discover", "--script-args", "modbus-discover.aggressive=true"]
    command = ["nmap", "-Pn", "-p", str(instrument.port), *script, "127.0.0.1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert f"{instrument.port}/tcp open  modbus" in done.stdout
    units = dict(re.findall(r"sid 0x(\w+): *\n\|_? +error: (.*)", done.stdout))
    assert units.pop("1") == "ILLEGAL FUNCTION"
    assert set(units.values()) == {"GATEWAY TARGET DEVICE FAILED TO RESPOND"}
    assert len(units) == 245
    assert re.findall("Device identification: (.*)", done.stdout) == [
        f"pneuforce PF-1 {version('pneuforce')}"
    ]
