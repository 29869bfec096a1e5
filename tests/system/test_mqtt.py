"""System test of MQTT: a host application vents the complete instrument, and the event log names MQTT."""

import json
from contextlib import ExitStack, closing

from pneuforce.registers.map_hash import MAP_HASH
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.teststand.stack import start
from tests.command_runner import pneuforce
from tests.mqtt.site import Broker, HostApplication, values_in
from tests.peers.clients.client import NEEDS_NODE
from tests.system.waiting import inflate, wait_for
from tests.tools import needs

VENT = [{"name": "Vent", "type": "Boolean", "value": True}]


@NEEDS_NODE
@needs("mosquitto", "/usr/sbin/mosquitto")
def test_a_host_application_vents_the_instrument(tmp_path):
    broker = Broker(tmp_path, "allow_anonymous true")
    settings = {"enabled": True, "broker": f"mqtt://127.0.0.1:{broker.port}", "edge_node": "node"}
    tables = {"mqtt": settings | {"store": str(tmp_path / "mqtt.sqlite")}}
    with ExitStack() as children, closing(HostApplication(broker.port)) as host:
        children.callback(broker.kill)
        stack = start(children, tmp_path / "rig", ["--no-hand"], tables)
        birth = values_in(host.next("DBIRTH"))
        with ModbusClient.connect(port=stack.modbus_port) as plc:
            inflate(plc, 5.0)
            holding = host.next("DDATA", condition=lambda m: values_in(m).get("state") == "holding")
            host.publish("spBv1.0/pneuforce/NCMD/node", metrics=VENT)
            assert values_in(host.next("NDATA")) == {"Vent Result": "accepted"}
            wait_for(plc.read, lambda values: "vented" in values["status"])
            assert birth["map_hash"] == MAP_HASH
        assert values_in(holding)["force_valid"] is True
        host.next("DDATA", condition=lambda m: values_in(m).get("force_valid") is False)
        stack.host.stop()
        host.next("NDEATH")
    shown = pneuforce("log", "show", "--file", tmp_path / "events.sqlite", "--json", "--last", "0")
    writes = [json.loads(line) for line in shown.stdout.splitlines()]
    assert "mqtt 127.0.0.1" in {each.get("who") for each in writes}
