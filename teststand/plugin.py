"""The pytest plugin: an instrument on a simulated rig for each test that asks for `pneuforce_rig`.

Every pytest beside an installed pneuforce loads this file: it imports what it needs when it is used.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from sim.proxy import SerialProxy, TcpProxy
    from teststand.rig import LiveRig
    from teststand.stack import Stack

MARKER = (
    "pneuforce(*, scenario=None, seed=1, instrument={}): a scenario for the simulator (name or TOML file; "
    "without one the hand rests), the seed of all noise, tables of the instrument.toml"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """The arguments of the marker."""

    scenario: str | None = None
    seed: int = 1
    instrument: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def of_the_rig(self) -> list[str]:
        """Arguments of `pneuforce sim`."""
        what = ["--no-hand"] if self.scenario is None else ["--scenario", str(self.scenario)]
        return [*what, "--seed", str(self.seed)]


def pytest_configure(config: pytest.Config) -> None:
    """Make the marker known."""
    config.addinivalue_line("markers", MARKER)


@pytest.fixture
def _pneuforce_stack(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Stack]:
    from teststand.children import ChildFailed
    from teststand.stack import start

    wish = wish_of(request)
    line_seed = wish.seed if "pneuforce_serial_proxy" in request.fixturenames else None
    with ExitStack() as children:
        try:
            stack = start(children, tmp_path / "rig", wish.of_the_rig(), wish.instrument, line_seed=line_seed)
        except ChildFailed as error:
            told = str(error).replace("/dev/stdin", "instrument={…} of the marker pneuforce")
            raise pytest.fail.Exception(told, pytrace=False) from None
        yield stack


@pytest.fixture
def pneuforce_rig(request: pytest.FixtureRequest, _pneuforce_stack: Stack) -> LiveRig:
    """A running instrument on a simulated rig, as just switched on."""
    from teststand.rig import LiveRig

    return LiveRig(_pneuforce_stack, wish_of(request).instrument.get("modbus", {}).get("unit", 1))


@pytest.fixture
def pneuforce_tcp_proxy(request: pytest.FixtureRequest, pneuforce_rig: LiveRig) -> Iterator[TcpProxy]:
    """A line to the Modbus server: clients connect to its `port`, its `noise` is what disturbs them."""
    from sim.proxy import TcpProxy

    with TcpProxy(("127.0.0.1", pneuforce_rig.modbus_port), seed=wish_of(request).seed) as proxy:
        yield proxy


@pytest.fixture
def pneuforce_serial_proxy(_pneuforce_stack: Stack) -> SerialProxy:
    """The line between rig and instrument; its `noise` is what disturbs it."""
    assert _pneuforce_stack.line is not None, "ask for pneuforce_serial_proxy as an argument of the test"
    return _pneuforce_stack.line


def wish_of(request: pytest.FixtureRequest) -> Wish:
    """What the test's marker asks for, the marker of a class or module where it has none of its own."""
    marker = request.node.get_closest_marker("pneuforce")
    if marker is None:
        return Wish()
    unknown = [*map(repr, marker.args), *(key for key in marker.kwargs if key not in Wish.__slots__)]
    if unknown:
        told = f"the marker pneuforce does not take {', '.join(unknown)}; it is {MARKER}"
        raise pytest.fail.Exception(told, pytrace=False)
    return Wish(**marker.kwargs)
