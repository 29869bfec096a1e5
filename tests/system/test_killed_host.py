"""Test of recordings whose host process was killed: the ending says only what the recorder knows."""

import os
import signal
import subprocess
import sys
from collections import Counter
from contextlib import ExitStack

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.recording.schema import EndReason
from pneuforce.instrument.service.local_socket.recorder import NO_END
from pneuforce.teststand.child_process import ChildProcess
from pneuforce.teststand.stack import toml
from tests.instrument.recording.recording_files import read_contents
from tests.system.waiting import wait_for

KILLS = int(os.environ.get("KILLS", "4"))


@pytest.fixture(scope="module")
def configuration(tmp_path_factory):
    """Return a configuration for a simulated rig that runs during the tests."""
    folder = tmp_path_factory.mktemp("killed")
    with ChildProcess("simulator", ["pneuforce", "sim", "run", "--link", str(folder / "rig")]) as rig:
        rig.ready()
        tables = {"rig": {"port": str(folder / "rig")}, "modbus": {"enabled": False}}
        tables |= {"events": {"file": ""}, "local": {"socket": str(folder / "pneuforce.sock")}}
        (folder / "instrument.toml").write_text(toml(tables))
        yield folder / "instrument.toml"


def has_samples(file):
    try:
        return bool(read_contents(file).samples)
    except ConfigurationError:  # no header yet
        return False


def ending_after_kill(configuration, file):
    """Record an instrument, kill its host process, and return the ending of the recording."""
    with ExitStack() as children:
        words = ["pneuforce", "run", "--config", str(configuration)]
        host = children.enter_context(ChildProcess("instrument", words))
        host.ready()
        recorder = subprocess.Popen(
            [sys.executable, "-P", "-m", "pneuforce", "record", str(file), "--config", str(configuration)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        children.callback(recorder.kill)
        wait_for(lambda: has_samples(file), bool)
        host.send(signal.SIGKILL)
        assert recorder.wait(60) == 1
    return read_contents(file).ending


def test_the_ending_after_a_kill_of_the_host_does_not_claim_a_cause(configuration, tmp_path):
    endings = [ending_after_kill(configuration, tmp_path / f"{n}.recording") for n in range(KILLS)]
    found = Counter((ending.how, ending.why) for ending in endings)
    print(f"{KILLS} kills: {dict(found)}")
    assert set(found) == {(EndReason.CUT_OFF, NO_END)}
