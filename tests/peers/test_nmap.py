"""nmap's scan for Modbus devices finds the instrument and learns who it is."""

import re
import subprocess
from importlib.metadata import version

from tests.tools import needs

pytestmark = needs("nmap")


def test_nmap_finds_the_one_unit_and_who_it_is(instrument):
    # "+" for a port that is not 502; function 17, with which it knocks, is not served: an answer all the same
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
