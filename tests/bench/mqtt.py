"""Benchmark of MQTT: `python -m tests.bench mqtt [--brief]`.

One process contains 200 publishers: the code of the MQTT process, each with its own connection, session and
store. A synthetic stream replaces the instruments: 20 snapshots per second each, with a contact every 10 s.
Mosquitto runs on the same computer, and another process counts the messages. Then the broker is killed for
some seconds.
"""

import asyncio
import math
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil
from aiomqtt import Client, MqttError

from pneuforce.instrument.stream.entry import json_safe
from pneuforce.mqtt.__main__ import ignore_closed_sockets
from pneuforce.mqtt.change_filter import ChangeFilter
from pneuforce.mqtt.outbox import Outbox
from pneuforce.mqtt.publisher import Publisher, PublisherSettings
from pneuforce.mqtt.schema import PayloadMessage
from pneuforce.mqtt.store import DeliveryStore
from pneuforce.registers.sparkplug import values_of
from tests.mqtt.site import Broker
from tests.web.entries import real_snapshot

PUBLISHERS, BRIEF_PUBLISHERS = 200, 5
SECONDS, BRIEF_SECONDS = 60.0, 2.0
SNAPSHOT_S, CONTACT_S, DAY_S = 0.05, 10.0, 86_400.0
NOISE_N = NOISE_KPA = 0.02
DEADBANDS = {"force_deadband_n": 0.01, "pressure_deadband_kpa": 0.02}
HEADER = {"version": "0.1.0"}
SNAPSHOT = real_snapshot()[1]


def reading_at(time_s, number, noise):
    """Return the reading of a synthetic instrument: 2 s of contact in each period."""
    phase_s = (time_s + number * 0.7) % CONTACT_S
    force_n = max(0.0, math.sin(phase_s * math.pi / 2)) if phase_s < 2 else 0.0
    changes = {
        "force_n": force_n + noise.gauss(0, NOISE_N) if force_n else 0.0,
        "pressure_kpa": 8.0 + force_n + noise.gauss(0, NOISE_KPA),
        "contact_counter": int((time_s + number * 0.7) // CONTACT_S),
        "status": ["force_valid", "holding", *(["in_contact"] if force_n else [])],
    }
    return {"header": HEADER, "snapshot": json_safe(SNAPSHOT | changes)}


async def _publish(port, count, folder, rounds):
    """Run publishers until cancelled. Write one byte to `rounds` for each snapshot of all publishers."""
    asyncio.get_running_loop().set_exception_handler(ignore_closed_sockets)
    publishers = []
    for number in range(count):
        store = f"{folder}/{number}.sqlite"
        names = ("bench", f"node{number}", "sensor")
        publishers.append(
            Publisher(PublisherSettings("127.0.0.1", port, False, *names, store=store, **DEADBANDS))
        )
    tasks = [asyncio.create_task(publisher.run()) for publisher in publishers]
    noise = random.Random(1)
    begun_s = time.monotonic()
    while not any(task.done() for task in tasks):
        rounds.write(b"x")
        await asyncio.sleep(SNAPSHOT_S)
        now_s = time.monotonic()
        for number, publisher in enumerate(publishers):
            publisher.on_reading(reading_at(now_s - begun_s, number, noise), now_s)


class Counts:
    """Messages and metrics that a client of the broker received."""

    def __init__(self):
        self.messages = self.bytes = self.historical = 0
        self.born, self.last_s = set(), 0.0

    async def receive(self, port):
        while True:
            try:
                async with Client("127.0.0.1", port) as client:
                    await client.subscribe("spBv1.0/#")
                    async for message in client.messages:
                        self._count(message)
            except MqttError:
                await asyncio.sleep(0.05)

    def _count(self, message):
        self.messages += 1
        self.bytes += len(message.payload)
        kind, node = message.topic.value.split("/")[2:4]
        if kind == "DBIRTH":
            self.born.add(node)
            self.last_s = time.monotonic()
        elif kind == "DDATA" and len(message.payload) > 400:
            metrics = PayloadMessage.FromString(message.payload).metrics
            if metrics[0].is_historical:
                self.historical += 1
                self.last_s = time.monotonic()


async def _measure(broker, publishers, counter, count, seconds):
    counts = Counts()
    receiving = asyncio.create_task(counts.receive(broker.port))
    await _all_born(counts, count)
    await asyncio.sleep(min(seconds, 5.0))
    processes = {"broker": psutil.Process(broker.pid), "publishers": publishers}
    before_s = {name: sum(process.cpu_times()[:2]) for name, process in processes.items()}
    messages, size, begun_s = counts.messages, counts.bytes, time.monotonic()
    rounds = counter.stat().st_size
    await asyncio.sleep(seconds)
    passed_s = time.monotonic() - begun_s
    rate, bytes_per_s = (counts.messages - messages) / passed_s, (counts.bytes - size) / passed_s
    snapshot_hz = (counter.stat().st_size - rounds) / passed_s
    print(
        f"{count} publishers, each with {snapshot_hz:.1f} snapshots/s: {rate:.0f} messages/s, "
        f"{bytes_per_s / 1e3:.0f} kB/s of payload"
    )
    for name, process in processes.items():
        share = (sum(process.cpu_times()[:2]) - before_s[name]) / passed_s
        print(f"  {name}: {share:.1%} of a core, {process.memory_info().rss / 1e6:.0f} MB")
    await _restart(broker, counts, count, seconds)
    receiving.cancel()


async def _restart(broker, counts, count, seconds):
    """Kill the broker for `seconds`, and print how long the publishers need to deliver everything."""
    broker.kill()
    counts.born.clear()
    counts.historical = 0
    await asyncio.sleep(seconds / 2)
    broker.start()
    begun_s = time.monotonic()
    await _all_born(counts, count)
    born_s = time.monotonic() - begun_s
    while time.monotonic() - counts.last_s < 3.0:
        await asyncio.sleep(0.1)
    print(
        f"broker killed for {seconds / 2:.0f} s: all {count} reborn {born_s:.1f} s after its restart, all "
        f"stored values delivered after {counts.last_s - begun_s:.1f} s in {counts.historical} messages"
    )


async def _all_born(counts, count):
    async with asyncio.timeout(90):
        while len(counts.born) < count:
            await asyncio.sleep(0.05)


def _print_store(folder, seconds):
    """Print the size of the stored values of 24 h, or less if `seconds` are fewer."""
    path = Path(folder) / "day.sqlite"
    store = DeliveryStore(str(path), 1e9, 1e9, print)
    outbox = Outbox(ChangeFilter(1.0, {"N": 0.01, "kPa": 0.02, "mm": 0.02}), store)
    noise, begun_s = random.Random(1), time.perf_counter()
    for step in range(int(seconds)):
        outbox.on_values(values_of(reading_at(float(step), 0, noise)), float(step), step * 1000)
    spent_s = time.perf_counter() - begun_s
    store.close()
    size = path.stat().st_size
    print(
        f"store: {store.count} records of {seconds / 3600:g} h are {size / 1e6:.1f} MB; "
        f"{spent_s / seconds * 1e6:.0f} µs for each"
    )


def bench_mqtt(brief=False):
    """Print the load of many publishers, the recovery after a restart of the broker, and the size of 24 h."""
    count, seconds = (BRIEF_PUBLISHERS, BRIEF_SECONDS) if brief else (PUBLISHERS, SECONDS)
    with tempfile.TemporaryDirectory() as folder:
        _print_store(folder, DAY_S / 100 if brief else DAY_S)
        broker = Broker(folder, "allow_anonymous true")
        words = [sys.executable, "-m", "tests.bench.mqtt", str(broker.port), str(count), folder]
        publishers = psutil.Popen(words, stderr=subprocess.DEVNULL)
        try:
            asyncio.run(_measure(broker, publishers, Path(folder) / "rounds", count, seconds))
        finally:
            publishers.kill()
            publishers.wait()
            broker.kill()
    print(f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


if __name__ == "__main__":
    with (Path(sys.argv[3]) / "rounds").open("wb", buffering=0) as rounds_file:
        asyncio.run(_publish(int(sys.argv[1]), int(sys.argv[2]), sys.argv[3], rounds_file))
