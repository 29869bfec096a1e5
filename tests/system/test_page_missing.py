"""An instrument whose page cannot serve: nobody's reason not to measure."""

import contextlib
import socket
from contextlib import ExitStack
from urllib.request import urlopen

from registers.modbus.client import Plc
from tests.system.waiting import inflate, wait_for
from teststand.children import Child
from teststand.stack import free_port, toml


def test_an_instrument_whose_pages_port_is_taken_measures_says_why_and_serves_it_once_it_is_free(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken, ExitStack() as children:
        rig, port, modbus = str(tmp_path / "rig"), taken.getsockname()[1], free_port()
        sim = children.enter_context(Child("simulator", ["instrument", "sim", "--link", rig, "--no-hand"]))
        sim.ready()
        host = children.enter_context(Child("instrument", ["instrument", "run", "--config", "/dev/stdin"]))
        host.tell(
            toml(
                {
                    "rig": {"port": rig},
                    "modbus": {"port": modbus},
                    "events": {"file": ""},
                    "local": {"socket": str(tmp_path / "pneuforce.sock")},
                    "page": {"enabled": True, "port": port},
                }
            )
        )
        assert host.ready() == {"modbus": modbus, "page": None}
        with Plc.connect(port=modbus) as plc:
            inflate(plc, 6.0)
        why = (
            f" the page cannot listen on 127.0.0.1:{port}: it is in use by another program; "
            "change [page] port; it is tried again"
        )
        wait_for(lambda: list(host.said), lambda said: any(line.endswith(why) for line in said))
        taken.close()

        def answered():
            with contextlib.suppress(OSError), urlopen(f"http://127.0.0.1:{port}/", timeout=5.0) as answer:
                return answer.status

        wait_for(answered, lambda status: status == 200)
