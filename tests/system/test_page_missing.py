"""Test of an instrument whose web page cannot be served: the instrument measures nevertheless."""

import contextlib
import socket
from contextlib import ExitStack
from urllib.request import urlopen

from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, toml
from tests.system.waiting import inflate, wait_for


def test_with_the_web_port_in_use_the_instrument_measures_and_serves_the_page_later(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as taken, ExitStack() as children:
        rig, port, modbus = str(tmp_path / "rig"), taken.getsockname()[1], free_port()
        simulator = children.enter_context(
            ChildProcess("simulator", ["pneuforce", "sim", "run", "--link", rig, "--no-hand"])
        )
        simulator.ready()
        host = children.enter_context(
            ChildProcess("instrument", ["pneuforce", "run", "--config", "/dev/stdin"])
        )
        host.write_stdin(
            toml(
                {
                    "rig": {"port": rig},
                    "modbus": {"port": modbus},
                    "events": {"file": ""},
                    "local": {"socket": str(tmp_path / "pneuforce.sock")},
                    "web": {"enabled": True, "port": port},
                }
            )
        )
        assert host.ready() == {"modbus": modbus, "web": None}
        with ModbusClient.connect(port=modbus) as plc:
            inflate(plc, 6.0)
        wait_for(lambda: " ".join(host.stderr_lines), lambda text: f"127.0.0.1:{port}" in text)
        assert "[web] port" in " ".join(host.stderr_lines)
        taken.close()

        def answered():
            with contextlib.suppress(OSError), urlopen(f"http://127.0.0.1:{port}/", timeout=5.0) as answer:
                return answer.status

        wait_for(answered, lambda status: status == 200)
