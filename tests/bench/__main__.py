"""Benchmarks: `make bench` runs all of them, `python -m tests.bench NAME …` runs some.

Each benchmark compares its figure with a peer or with a target in the same run. With --brief, each benchmark
is so short that it shows only that it still works. The figures of a brief run mean nothing.
"""

import argparse

from tests.bench.avr import bench_avr
from tests.bench.can import bench_burst, bench_can
from tests.bench.command import bench_estimate
from tests.bench.counting import bench_counting
from tests.bench.endurance import bench_endurance
from tests.bench.force_control import bench_force_control
from tests.bench.https import bench_https
from tests.bench.instruments_on_one_host import bench_instruments_on_one_host
from tests.bench.keep_alive import bench_keep_alive
from tests.bench.latency import bench_latency
from tests.bench.modbus import bench_modbus
from tests.bench.modbus_security import bench_modbus_security
from tests.bench.model import bench_arrays, bench_chain
from tests.bench.mqtt import bench_mqtt
from tests.bench.peaks import bench_peaks
from tests.bench.quota import bench_quota
from tests.bench.rdt import bench_rdt
from tests.bench.rig import bench_rig
from tests.bench.touch import bench_touch

BENCHMARKS = {
    "arrays": bench_arrays,
    "chain": bench_chain,
    "peaks": bench_peaks,
    "counting": bench_counting,
    "rig": bench_rig,
    "board": bench_avr,
    "command": bench_estimate,
    "latency": bench_latency,
    "keep_alive": bench_keep_alive,
    "can": bench_can,
    "burst": bench_burst,
    "rdt": bench_rdt,
    "modbus": bench_modbus,
    "modbus_security": bench_modbus_security,
    "instruments": bench_instruments_on_one_host,
    "https": bench_https,
    "mqtt": bench_mqtt,
    "force_control": bench_force_control,
    "touch": bench_touch,
    "quota": bench_quota,
    "endurance": bench_endurance,
}


def main():
    parser = argparse.ArgumentParser(prog="python -m tests.bench", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(BENCHMARKS)}")
    parser.add_argument("--brief", action="store_true", help="only try whether the benchmarks work")
    arguments = parser.parse_args()
    for name in arguments.names or BENCHMARKS:
        if name not in BENCHMARKS:
            parser.error(f"{name} is unknown")
        BENCHMARKS[name](arguments.brief)


if __name__ == "__main__":
    main()
