"""Public names of the Python package and their signatures. A change here needs a line in CHANGELOG.md."""

import inspect
import re
import subprocess
import sys
from importlib.metadata import version

import pytest

import pneuforce
from pneuforce.client.reference_page import PATH
from pneuforce.registers import map_hash
from tests.source_tree import ROOT

CHANGELOG = ROOT / "CHANGELOG.md"
PAGE = (ROOT / PATH).read_text(encoding="utf-8")
FORCE = (
    "(dpi_kpa, dpf_kpa, *, method=None, calibration=None, switch=None, low=None, grip=None, "
    "grip_std=None, pressed_sides=None, contact_s=5.0, extrapolate=False)"
)
HOLD = "(setpoint_kpa, *, lease_s=2.0, timeout_s=20.0, proof_tests=True)"
SENSOR = {
    "clear": "()",
    "close": "()",
    "details": "()",
    "hold": HOLD,
    "new_balloon": "(balloon_id)",
    "read": "()",
    "release": "()",
    "set_force_limit": "(force_limit_n)",
    "set_setpoint": "(setpoint_kpa)",
    "stream": "(timeout_s=1.0)",
    "vent": "()",
    "wait_until_vented": "(timeout_s=10.0)",
    "zero": "()",
}
FUNCTIONS = {
    "connect": "(url)",
    "force": FORCE,
    "aio.connect": "(url)",
    "testing.simulated_rig": "(scenario=None, *, seed=1, instrument=None)",
}
METHODS = {
    "ForceSensor": SENSOR,
    "Hold": {"cancel": "()", "end": "()"},
    "Recording": {"get": None, "items": None, "keys": None, "values": None}
    | {"to_pandas": "()", "to_polars": "()"},
    "aio.AsyncForceSensor": SENSOR,
    "aio.AsyncHold": {},
    "testing.LiveRig": {
        "inflate": "(setpoint_kpa)",
        "inject_fault": "(name, **arguments)",
        "kill_instrument": "()",
        "pause_instrument": "()",
        "press": "(force_n, wait=True)",
        "read": "()",
        "release": "(wait=True)",
        "remove_fault": "(name)",
        "start_contact": "(kind='tap', **contact)",
        "start_instrument": "()",
        "truth": "()",
        "vent": "()",
        "wait_for": "(condition, timeout_s=10.0, *, allow_trip=False)",
        "write": "(name, value)",
    },
}
ATTRIBUTES = {
    "Measurement": {
        "age_s",
        "balloon_empty",
        "explanation",
        "force_n",
        "force_or_nan",
        "force_std_n",
        "force_std_or_nan",
        "pressure_kpa",
        "radius_mm",
        "reasons",
        "remedy",
        "sample_counter",
        "setpoint_kpa",
        "state",
        "status",
        "status_or_none",
        "valid",
    },
    "Details": {
        "active_fault_count",
        "balloon_id",
        "calibration_date",
        "configuration_hash",
        "configuration_signature",
        "calibration_signature",
        "firmware_image",
        "firmware_origin",
        "firmware_version",
        "first_out_fault",
        "force_limit_n",
        "inflation_count",
        "latched_faults",
        "lease_holder",
        "lease_left_s",
        "maintenance_causes",
        "map_hash",
        "map_version",
        "method",
        "serial_number",
        "setpoint_requested_kpa",
    },
    "LatchedFault": {"cause", "code", "count", "index", "name", "remedy"},
    "ForceEstimate": {"count", "force_n", "force_std_n", "index"},
}
CLIENT_ERROR = "ClientError"
ERRORS = {
    "AlreadyHeld": "UsageError",
    "ClientError": "PneuforceError",
    "ConfigurationError": "PneuforceError",
    "ConnectionFailed": CLIENT_ERROR,
    "ConnectionLost": "ConnectionFailed",
    "HoldEnded": CLIENT_ERROR,
    "InvalidForce": CLIENT_ERROR,
    "PneuforceError": "Exception",
    "ReadOnlySensor": "UsageError",
    "Rejected": CLIENT_ERROR,
    "SensorClosed": "UsageError",
    "Tripped": "HoldEnded",
    "UsageError": CLIENT_ERROR,
    "VentFailed": "VentNotConfirmed",
    "VentNotConfirmed": CLIENT_ERROR,
}
CONSTANTS = {"MAP_HASH"}
ENUMERATIONS = {"State", "Status"}  # test_measurement.py compares their members with the register map
SUBMODULES = {
    "aio": {"AsyncForceSensor", "AsyncHold", "connect"},
    "testing": {
        "BalloonNotHeld",
        "ChildProcessFailed",
        "ConfigurationError",
        "LineNoise",
        "LiveRig",
        "ModbusClientError",
        "RigTripped",
        "SerialProxy",
        "SimulatorNotResponding",
        "SimulatorRequestError",
        "TcpProxy",
        "VentFailed",
        "WaitTimeout",
        "WriteRejectedError",
        "simulated_rig",
    },
}


def public(name):
    value = pneuforce
    for part in name.split("."):
        value = getattr(value, part)
    return value


def signature(function):
    """Return the signature without `self` and without annotations."""
    parameters = [
        each.replace(annotation=inspect.Parameter.empty)
        for each in inspect.signature(function).parameters.values()
        if each.name != "self"
    ]
    return str(inspect.Signature(parameters))


def members(value):
    return {name: member for name, member in inspect.getmembers(value) if not name.startswith("_")}


def test_the_public_names_are_listed():
    top = {name for name in (*FUNCTIONS, *METHODS, *ATTRIBUTES) if "." not in name}
    assert set(pneuforce.__all__) == top | set(ERRORS) | CONSTANTS | ENUMERATIONS | set(SUBMODULES)
    assert {name: set(public(name).__all__) for name in SUBMODULES} == SUBMODULES
    assert sorted(dir(pneuforce)) == sorted([*pneuforce.__all__, "__version__"])


def test_the_functions_are_listed():
    assert {name: signature(public(name)) for name in FUNCTIONS} == FUNCTIONS


def test_the_methods_are_listed():
    found = {
        name: {
            each: signature(member) if f"{each}" in vars(public(name)) else None
            for each, member in members(public(name)).items()
            if inspect.isfunction(member)
        }
        for name in METHODS
    }
    assert found == METHODS


def test_the_attributes_are_listed():
    assert {name: set(members(public(name))) for name in ATTRIBUTES} == ATTRIBUTES


@pytest.mark.parametrize("name", ATTRIBUTES)
def test_the_reference_page_describes_each_attribute_with_its_type(name):
    section = PAGE.partition(f"### pneuforce.{name}\n")[2].partition("\n### ")[0]
    rows = re.findall(r"^\| `(\w+)` \| `[^`]+` \| [^|]+ \|$", section, re.MULTILINE)
    assert set(rows) == ATTRIBUTES[name] - set(members(tuple))


def test_the_reference_page_shows_a_context_manager_as_the_result_of_simulated_rig():
    section = PAGE.partition("### pneuforce.testing.simulated_rig\n")[2].partition("\n### ")[0]
    assert ") -> AbstractContextManager[LiveRig]\n" in section


def test_the_exceptions_are_listed():
    assert {name: public(name).__bases__[0].__name__ for name in ERRORS} == ERRORS


def test_the_import_loads_no_other_module():
    program = (
        "import sys, pneuforce; print([n for n in sys.modules if n.startswith(('pneuforce.', 'numpy'))])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_constants_are_those_of_the_installation():
    assert pneuforce.MAP_HASH == map_hash.MAP_HASH
    assert pneuforce.__version__ == version("pneuforce")


def test_the_changelog_names_each_public_name():
    changelog = CHANGELOG.read_text(encoding="utf-8")
    assert [name for name in pneuforce.__all__ if f"`{name}`" not in changelog] == []


def type_errors(folder, *lines):
    """Return the errors that mypy finds in a program."""
    program = folder / "program.py"
    program.write_text("\n".join(lines))
    mypy = [sys.executable, "-m", "mypy", "--follow-imports=silent", f"--cache-dir={folder}", program]
    done = subprocess.run(mypy, capture_output=True, text=True, check=False, cwd=ROOT)
    return re.findall(r"error: (.*)", done.stdout)


def test_a_type_checker_accepts_all_public_names_and_no_other(tmp_path):
    names = [*pneuforce.__all__, "__version__", "conect"]
    assert type_errors(tmp_path, "import pneuforce", *(f"pneuforce.{name}" for name in names)) == [
        'Module has no attribute "conect"; maybe "connect"?  [attr-defined]'
    ]


def test_the_force_of_numpy_scalars_has_the_type_of_floats(tmp_path):
    program = ("import numpy as np", "import pneuforce", "pressures_kpa = np.array([9.0, 9.4])")
    uses = (
        "one: float = pneuforce.force(8.0, np.float32(9.2)).force_n",
        "two: float = pneuforce.force(np.int64(8), np.mean(pressures_kpa)).force_n",
        "pneuforce.force(8.0, np.float32(9.2)).force_n.mean()",
        "pneuforce.force(8.0, pressures_kpa).force_n.mean()",
    )
    assert type_errors(tmp_path, *program, *uses) == ['"float" has no attribute "mean"  [attr-defined]']


def test_an_unknown_name_is_an_attribute_error():
    assert not hasattr(pneuforce, "conect")
