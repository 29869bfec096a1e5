"""Recording and configuration for the tests of the commands that use recordings."""

import shutil

import pytest

from tests.instrument.calibration.test_golden import GOLDEN
from tests.instrument.recording.virtual_host import VirtualHost, write_recording


@pytest.fixture(scope="module")
def entries():
    """Return the entries of an instrument without calibration, from its first byte on, with contacts."""
    host = VirtualHost()
    host.record()
    host.inflate()
    host.wait_for_contact()
    host.run(6.0)
    return host.recorded()


@pytest.fixture(scope="module")
def recording(entries, tmp_path_factory):
    path = tmp_path_factory.mktemp("recorded") / "press.recording"
    write_recording(entries, path)
    return path


@pytest.fixture(scope="module")
def config(recording):
    """Return a configuration with a force calibration, and another filter."""
    shutil.copy(GOLDEN, recording.with_name("calibration.toml"))
    path = recording.with_name("instrument.toml")
    path.write_text('[measurement]\ncalibration = "calibration.toml"\nfilter_time_constant_s = 0.1\n')
    return path
