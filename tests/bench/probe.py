"""The host process with stop-watches at both ends: `python -m tests.bench.probe instrument.toml`.

Prints one JSON line when it is asked to end: latencies [ms] from the read that completed a rig frame to the
return of the call that sent its CAN Force frame, samples used and lost.
"""

import json
import sys
import time
from pathlib import Path

from instrument.cli import serve
from instrument.cli.can_face import CanFace
from instrument.config import load
from instrument.host import Host
from registers.can.bus import Bus
from registers.can.frames import DEFAULT_NODE_ID, FORCE

FORCE_ID = FORCE.base_id + DEFAULT_NODE_ID
WARM_UP = 500  #: samples that are not counted


class Probe:
    """Wraps the two ends of the way of a sample."""

    def __init__(self):
        self.read_s = {}
        self.latencies_ms = []
        self.hosts = []

    def install(self):
        send, on_frames, start = Bus.send, CanFace._send, Host.run
        node_sample = CanFace.on_sample
        arrived = []

        def timed_sample(face, now_s):
            arrived[:] = [now_s]
            node_sample(face, now_s)
            arrived.clear()

        def noted_send(face, frames):
            for frame in frames:
                if frame.id == FORCE_ID and arrived:
                    self.read_s[frame.data[-1]] = arrived[0]
            on_frames(face, frames)

        def timed_send(bus, frame):
            send(bus, frame)
            if frame.id == FORCE_ID:
                self.latencies_ms.append((time.monotonic() - self.read_s[frame.data[-1]]) * 1e3)

        def noted_run(host, stop):
            self.hosts.append(host)
            return start(host, stop)

        CanFace.on_sample, CanFace._send, Bus.send, Host.run = timed_sample, noted_send, timed_send, noted_run

    def report(self):
        (host,) = self.hosts
        return {
            "latencies_ms": [round(value, 4) for value in self.latencies_ms[WARM_UP:]],
            "samples": host.instrument.sample_counter,
            "lost": host.link.lost_frames,
            "cpu_s": time.process_time(),
        }


if __name__ == "__main__":
    probe = Probe()
    probe.install()
    file = Path(sys.argv[1])
    serve.serve(load(file), file.with_name("events.sqlite"))
    print(json.dumps(probe.report()), flush=True)
