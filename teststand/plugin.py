"""Pytest plugin: an instrument on a simulated rig for each test with the argument `pneuforce_rig`.

Every pytest in an environment with pneuforce loads this module. Therefore the module imports most other
modules only when a fixture is used.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from pneuforce.sim.line.proxy import SerialProxy, TcpProxy
    from pneuforce.teststand.rig import LiveRig
    from pneuforce.teststand.stack import Stack

MARKER = (
    "pneuforce(*, scenario=None, seed=1, instrument={}): scenario of the simulator (a name or a TOML file; "
    "by default the hand plays no scenario), seed of all noise, tables of the instrument.toml"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class MarkerArguments:
    """Arguments of the marker `pneuforce`."""

    scenario: str | None = None
    seed: int = 1
    instrument: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def simulator_arguments(self) -> list[str]:
        """Return the arguments of `pneuforce sim run`."""
        from pneuforce.teststand.running import simulator_arguments

        return simulator_arguments(self.scenario, self.seed)


#: Processes of a running test, for the report of a failure.
STACK = pytest.StashKey["Stack"]()


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker."""
    config.addinivalue_line("markers", MARKER)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Add the lines that the instrument and the simulator have printed to the report of a failed test.

    The section belongs to the representation of the error, because a JUnit file contains only this.
    """
    report = yield
    add_section = getattr(report.longrepr, "addsection", None)  # a text has no sections
    if report.failed and STACK in item.stash and add_section is not None:
        add_section("pneuforce instrument", item.stash[STACK].printed())
    return report


@pytest.fixture
def _pneuforce_stack(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Stack]:
    from pneuforce.teststand.child_process import ChildProcessFailed
    from pneuforce.teststand.stack import start

    arguments = marker_arguments(request)
    line_seed = arguments.seed if "pneuforce_serial_proxy" in request.fixturenames else None
    with ExitStack() as children:
        try:
            stack = start(
                children,
                tmp_path / "rig",
                arguments.simulator_arguments(),
                arguments.instrument,
                line_seed=line_seed,
            )
        except ChildProcessFailed as error:
            message = str(error).replace("/dev/stdin", "instrument={…} of the marker pneuforce")
            raise pytest.fail.Exception(message, pytrace=False) from None
        request.node.stash[STACK] = stack
        yield stack
        try:
            stack.check_at_end()
        except ChildProcessFailed as error:
            raise pytest.fail.Exception(f"during the test, {error}", pytrace=False) from None


@pytest.fixture
def pneuforce_rig(request: pytest.FixtureRequest, _pneuforce_stack: Stack) -> LiveRig:
    """Return an instrument on a simulated rig. Both have just been started for this test."""
    from pneuforce.teststand.rig import LiveRig

    return LiveRig(_pneuforce_stack, marker_arguments(request).instrument.get("modbus", {}).get("unit", 1))


@pytest.fixture
def pneuforce_tcp_proxy(request: pytest.FixtureRequest, pneuforce_rig: LiveRig) -> Iterator[TcpProxy]:
    """Return a proxy for the Modbus server. Clients connect to its `port`. Its `noise` disturbs the data."""
    from pneuforce.sim.line.proxy import TcpProxy

    with TcpProxy(("127.0.0.1", pneuforce_rig.modbus_port), seed=marker_arguments(request).seed) as proxy:
        yield proxy


@pytest.fixture
def pneuforce_serial_proxy(_pneuforce_stack: Stack) -> SerialProxy:
    """Return the proxy on the serial line between rig and instrument. Its `noise` disturbs the data."""
    assert _pneuforce_stack.line is not None, "use pneuforce_serial_proxy as an argument of the test"
    return _pneuforce_stack.line


def marker_arguments(request: pytest.FixtureRequest) -> MarkerArguments:
    """Return the arguments of the closest marker: of the test, of its class or of its module."""
    from pneuforce.errors import ConfigurationError
    from pneuforce.teststand.running import instrument_tables

    marker = request.node.get_closest_marker("pneuforce")
    if marker is None:
        return MarkerArguments()
    unknown = [
        *map(repr, marker.args),
        *(key for key in marker.kwargs if key not in MarkerArguments.__slots__),
    ]
    if unknown:
        message = f"unknown argument of the marker pneuforce: {', '.join(unknown)}; use {MARKER}"
        raise pytest.fail.Exception(message, pytrace=False)
    arguments = MarkerArguments(**marker.kwargs)
    try:
        instrument_tables(arguments.instrument)
    except ConfigurationError as error:
        raise pytest.fail.Exception(f"marker pneuforce: {error}", pytrace=False) from None
    return arguments
