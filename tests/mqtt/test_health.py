"""State of the MQTT connection for the metrics: from the heartbeats of the process."""

import asyncio

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.processes.mqtt_process import MqttProcess, health

HEARTBEAT = {"certificate_days": None, "connected": True, "stored": 7, "lost": 2}


def new_process(tmp_path):
    settings = {"enabled": True, "broker": "mqtt://127.0.0.1:1"}
    configuration = Configuration.model_validate({"mqtt": settings})
    return MqttProcess(configuration, tmp_path / "none.sock", {})


def test_a_disabled_mqtt_has_no_state():
    assert health(None) is None


def test_the_process_reports_that_the_broker_is_not_connected(tmp_path):
    async def run():
        process = new_process(tmp_path)
        process.on_heartbeat(HEARTBEAT)
        process.begin()
        async with asyncio.timeout(20.0):
            while process.connected:  # until the first heartbeat of the process
                await asyncio.sleep(0.05)
        await process.close()
        return health(process)

    assert asyncio.run(run()) == HEARTBEAT | {"connected": False, "stored": 0, "lost": 0}


def test_an_ended_process_is_not_connected_and_keeps_its_counters(tmp_path):
    process = new_process(tmp_path)
    process.on_heartbeat(HEARTBEAT)
    assert health(process) == HEARTBEAT
    process.on_end()
    assert health(process) == HEARTBEAT | {"connected": False}
