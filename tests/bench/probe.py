"""Host process that measures its own latency: `python -m tests.bench.probe instrument.toml`.

A latency is the time from the arrival of a sample to the return of the call that sends its CAN Force frame,
or its RDT records to all clients. At its end, the process prints one JSON line: latencies [ms], and the
numbers of used and lost samples.
"""

import json
import sys
import time
from pathlib import Path

from pneuforce.instrument.config import load
from pneuforce.instrument.service.buses.can_server import CanServer
from pneuforce.instrument.service.host.host import Host
from pneuforce.instrument.service.serve import ServiceFiles, serve
from pneuforce.registers.can.bus import CanBus
from pneuforce.registers.can.frames import DEFAULT_NODE_ID, FORCE
from pneuforce.registers.rdt.server import RdtServer

FORCE_ID = FORCE.base_id + DEFAULT_NODE_ID
WARM_UP = 500  #: number of latencies at the start that are not reported


class Probe:
    """Recorder of the times at which a sample arrives and its CAN frame is sent."""

    def __init__(self):
        self.read_s = {}
        self.latencies_ms = []
        self.rdt_latencies_ms = []
        self.hosts = []

    def install(self):
        send, on_frames, start = CanBus.send, CanServer._send, Host.run
        node_sample, rdt_sample = CanServer.on_sample, RdtServer.on_sample
        arrived = []

        def timed_sample(face, now_s):
            arrived[:] = [now_s]
            node_sample(face, now_s)
            arrived.clear()

        def timed_rdt_sample(server, now_s):
            rdt_sample(server, now_s)
            if server.streams:
                self.rdt_latencies_ms.append((time.monotonic() - now_s) * 1e3)

        def noted_send(face, frames, now_s):
            for frame in frames:
                if frame.id == FORCE_ID and arrived:
                    self.read_s[frame.data[-1]] = arrived[0]
            on_frames(face, frames, now_s)

        def timed_send(bus, frame):
            send(bus, frame)
            if frame.id == FORCE_ID:
                self.latencies_ms.append((time.monotonic() - self.read_s[frame.data[-1]]) * 1e3)

        def noted_run(host, stop):
            self.hosts.append(host)
            return start(host, stop)

        CanServer.on_sample, CanServer._send = timed_sample, noted_send
        CanBus.send, Host.run = timed_send, noted_run
        RdtServer.on_sample = timed_rdt_sample

    def report(self):
        (host,) = self.hosts
        return {
            "latencies_ms": [round(value, 4) for value in self.latencies_ms[WARM_UP:]],
            "rdt_latencies_ms": [round(value, 4) for value in self.rdt_latencies_ms],
            "samples": host.instrument.sample_counter,
            "lost": host.link.lost_frames,
            "cpu_s": time.process_time(),
        }


if __name__ == "__main__":
    probe = Probe()
    probe.install()
    file = Path(sys.argv[1])
    serve(load(file), ServiceFiles(events=file.with_name("events.sqlite")))
    print(json.dumps(probe.report()), flush=True)
