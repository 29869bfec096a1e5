"""Delay and loss of CAN Force frames at 500 Hz: `python -m tests.bench.can [SECONDS]`.

The complete instrument runs on the simulated rig while 32 Modbus clients poll. A relay on the serial cable
records when the last byte of each sample goes to the instrument. A listener process on the hub records when
each frame arrives. At the end, the relay stops. The last sample and the last frame with a value then form a
pair. All earlier pairs are found by counting back from this pair.
"""

import json
import os
import select
import shutil
import subprocess
import sys
import time
from contextlib import ExitStack, closing
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

from pneuforce.protocol.frames import FrameDecoder, Sample
from pneuforce.registers.can.bus import CanAddress, CanBus, TxBufferFullError
from pneuforce.registers.can.frames import DEFAULT_NODE_ID, FORCE
from pneuforce.registers.can.wire import CanFrame
from pneuforce.registers.modbus.client import ModbusClient
from pneuforce.sim.line.pty_link import PtyLink
from pneuforce.support.serial_port import SerialPort
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import free_port, toml
from tests.bench.modbus import built, load
from tests.system.waiting import inflate

POLLERS, POLL_HZ, SECONDS, RATE_HZ = 32, 20, 20, 500
HUB = ["pneuforce.registers.can.hub", "--port", "0"]
INTERVAL_MS, DELAY_MS = 4, 5  #: targets for the 99th percentile of interval and delay
WARM_S = 2.0
BURST = 10_000
FORCE_ID = FORCE.base_id + DEFAULT_NODE_ID


def at(port):
    return CanAddress(interface="socketcand", port=port)


def asked_to_end():
    return bool(select.select([sys.stdin], [], [], 0)[0])


def relay(link):
    """Relay bytes between a host and the simulator at `link` until stdin closes. Print the sample times."""
    samples_s, decoder = [], FrameDecoder.for_board_frames()
    with closing(SerialPort(link)) as board, closing(PtyLink()) as host:
        print(json.dumps({"port": host.port}), flush=True)
        while not asked_to_end():
            readable, _, _ = select.select([board, host], [], [], 0.01)
            if board in readable:
                data = board.read()
                samples = [f for f in decoder.feed(data) if isinstance(f.message, Sample)]
                samples_s += [time.monotonic()] * len(samples)
                host.write(data)
            if host in readable:
                board.write(host.read())
        time.sleep(0.5)  # the relay has stopped; the host sends its last frames
        print(json.dumps(samples_s), flush=True)


def listen(port):
    """Record time, counter and availability of the pressure for each Force frame, until stdin closes."""
    frames = []
    with closing(CanBus(at(int(port)))) as bus:
        print(json.dumps({}), flush=True)
        while not asked_to_end():
            heard = bus.receive()
            if heard and heard[1].id == FORCE_ID:
                codes = FORCE.codes(heard[1].data)
                there = codes["pressure"] != FORCE.fields[1].not_available
                frames.append((time.monotonic(), codes["counter"], there))
    print(json.dumps(frames), flush=True)


def sleep():
    """Sleep repeatedly for the period of the frames. Record the delay of each wake-up [ms]."""
    late_ms, due_s = [], time.monotonic()
    print(json.dumps({}), flush=True)
    while not asked_to_end():
        due_s = max(due_s, time.monotonic()) + 1 / RATE_HZ
        time.sleep(max(0.0, due_s - time.monotonic()))
        late_ms.append((time.monotonic() - due_s) * 1e3)
    print(json.dumps(late_ms), flush=True)


def spread(values_ms):
    values_ms = sorted(values_ms)
    p99 = values_ms[int(0.99 * len(values_ms))]
    return f"p50 {values_ms[len(values_ms) // 2]:.2f} ms, p99 {p99:.2f} ms", f"worst {values_ms[-1]:.1f} ms"


class Part:
    """Process of this benchmark that prints one line of JSON when it is ready, and one at its end."""

    def __init__(self, stack, *words):
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.bench.can", *map(str, words)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        stack.callback(self._process.kill)
        self.began = json.loads(self._process.stdout.readline())

    def end(self):
        return json.loads(self._process.communicate("end\n")[0])


def poll(folder, port, seconds):
    """Run the Modbus clients for some seconds. Return the programming language of the clients."""
    if shutil.which("pkg-config") and not subprocess.call(["pkg-config", "--exists", "libmodbus"]):
        load(built(folder, "load"), port, POLLERS, seconds, (POLL_HZ,))
        return "C"
    words = [sys.executable, "-m", "tests.bench.pollers", *map(str, (port, POLLERS, POLL_HZ, seconds))]
    subprocess.run(words, check=True, capture_output=True)
    return "Python"


def bench_can(brief=False, seconds=SECONDS):
    """Print the lost frames, the intervals, and the delays from the last byte of a sample to its frame."""
    seconds = 2.5 if brief else seconds
    with TemporaryDirectory() as folder, ExitStack() as stack:
        link, modbus = Path(folder) / "rig", free_port()
        simulator = ["pneuforce", "sim", "run", "--link", str(link)]
        stack.enter_context(ChildProcess("simulator", simulator)).ready()
        hub = stack.enter_context(ChildProcess("hub", HUB)).ready()["port"]
        cable = Part(stack, "--relay", link)
        can = {"enabled": True, "interface": "socketcand", "port": hub, "force_rate_hz": RATE_HZ}
        tables = {"rig": cable.began, "modbus": {"port": modbus}, "can": can}
        file = Path(folder) / "instrument.toml"
        file.write_text(toml(tables))
        stack.enter_context(ChildProcess("host", ["pneuforce", "run", "--config", str(file)])).ready()
        with ModbusClient.connect(port=modbus) as plc:
            inflate(plc, 8.0)
        listener, sleeper = Part(stack, "--listen", hub), Part(stack, "--sleep")
        begun_s = time.monotonic()
        pollers = poll(folder, modbus, seconds)
        ended_s = time.monotonic()
        late_ms = sleeper.end()
        samples_s, frames = cable.end(), listener.end()
    _print_force(samples_s, frames, (begun_s + WARM_S, ended_s), pollers, late_ms)


def _print_force(samples_s, frames, window, pollers, late_ms):
    while frames and not frames[-1][2]:
        frames.pop()  # a frame without a value, sent after the relay stopped
    paired = list(zip(reversed(samples_s), reversed(frames), strict=False))
    inside = [(t_s, frame) for t_s, frame in paired[::-1] if window[0] <= frame[0] <= window[1]]
    came_s, counters = [frame[0] for _, frame in inside], [frame[1] for _, frame in inside]
    steps = [(b - a) & 0xFF for a, b in pairwise(counters)]
    lost = sum(step - 1 for step in steps if step)
    middle, worst = spread([(b - a) * 1e3 for a, b in pairwise(came_s)])
    print(
        f"Force frames at {RATE_HZ} Hz, received by another process, {POLLERS} Modbus clients in {pollers} "
        f"at {POLL_HZ} Hz, {len(inside)} frames in {window[1] - window[0]:.0f} s: lost {lost}, repeated "
        f"{steps.count(0)} (target 0); interval {middle} (target {INTERVAL_MS}), {worst}"
    )
    middle, worst = spread([(frame[0] - t_s) * 1e3 for t_s, frame in inside])
    early = sum(frame[0] < t_s for t_s, frame in inside)
    print(
        f"last byte of a sample → frame received: {middle} (target {DELAY_MS}), {worst}; "
        f"{early} frames earlier than their sample (0 if all pairs are correct)"
    )
    middle, worst = spread(late_ms)
    print(
        f"for comparison, delay of the wake-up of a process that only sleeps: {middle}, {worst}; "
        f"load of the machine {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
    )


def bench_burst(brief=False):
    """Send 10 000 frames through the hub without pause. Print the number of frames that arrive."""
    with ExitStack() as stack:
        port = stack.enter_context(ChildProcess("hub", HUB)).ready()["port"]
        listener = Part(stack, "--count", port)
        sender = stack.enter_context(closing(CanBus(at(port))))
        begun_s, full = time.monotonic(), 0
        for n in range(BURST):
            frame = CanFrame(FORCE_ID, n.to_bytes(8, "little"))
            while not _sent(sender, frame):
                full += 1
        sent_s = time.monotonic() - begun_s
        heard = listener.end()
    print(
        f"{BURST} frames through the hub without pause: {BURST - heard['in_order']} lost or out of order "
        f"(target 0); sent in {sent_s:.2f} s, received in {heard['last_s'] - begun_s:.2f} s, "
        f"transmit buffer full {full} times"
    )


def _sent(bus, frame):
    try:
        bus.send(frame)
    except TxBufferFullError:
        return False
    return True


def count(port):
    """Print the number of frames that arrive in order, and the time of the last frame."""
    in_order, last_s = 0, 0.0
    with closing(CanBus(at(int(port)))) as bus:
        print(json.dumps({}), flush=True)
        while (heard := bus.receive()) or not asked_to_end():
            if heard:
                in_order += heard[1].data == in_order.to_bytes(8, "little")
                last_s = time.monotonic()
    print(json.dumps({"in_order": in_order, "last_s": last_s}))


if __name__ == "__main__":
    parts = {"--relay": relay, "--listen": listen, "--count": count, "--sleep": sleep}
    if sys.argv[1:2] and sys.argv[1] in parts:
        parts[sys.argv[1]](*sys.argv[2:])
    else:
        bench_can(False, *(int(argument) for argument in sys.argv[1:]))
        bench_burst()
