"""Tests of the signatures of configuration and calibration: state, refusal before parsing, warnings."""

import pytest

from pneuforce.errors import ConfigurationFileError
from pneuforce.instrument.calibration import file as calibration_file
from pneuforce.instrument.config import load
from pneuforce.instrument.service.checks.start_checks import load_checked
from pneuforce.instrument.signing.signed_file import signature_path
from tests.instrument.signing.keys import make_key, sign, trusted_line
from tests.tools import needs

pytestmark = needs("openssh-client", "/usr/bin/ssh-keygen")
TEXT = '[measurement]\ncalibration = "calibration.toml"\n'


@pytest.fixture(scope="module")
def key(tmp_path_factory):
    return make_key(tmp_path_factory.mktemp("key") / "lab")


@pytest.fixture
def files(tmp_path, key):
    """Return a signed configuration, its signed calibration, and the file of trusted keys."""
    configuration, calibration = tmp_path / "instrument.toml", tmp_path / "calibration.toml"
    configuration.write_text(TEXT)
    calibration_file.save(calibration_file.empty(0), calibration)
    for file in (configuration, calibration):
        signature_path(file).write_bytes(sign(file.read_bytes(), key))
    (tmp_path / "trusted-keys").write_text(trusted_line(key, "lab"))
    return configuration, calibration, tmp_path / "trusted-keys"


def states(configuration):
    identity = configuration.settings().identity
    return identity.configuration_signature, identity.calibration_signature


def test_signed_files_start_and_are_no_warning(files):
    configuration = load_checked(files[0], files[2])
    assert states(configuration) == ("signed", "signed")
    assert configuration.signatures.calibration.signer == "lab"
    assert "signed" not in configuration.warning


def test_the_signatures_do_not_change_the_hash_of_the_configuration(files):
    signed = load(files[0])
    signature_path(files[0]).unlink()
    assert load(files[0]).hash == signed.hash


@pytest.mark.parametrize("altered", [0, 1])
def test_an_altered_file_is_a_warning_and_is_refused_if_signatures_are_required(files, altered):
    with files[altered].open("a") as file:
        file.write("# altered\n")
    configuration = load_checked(files[0])
    assert states(configuration)[altered] == "altered"
    assert configuration.warning.count("is altered") == 1
    with pytest.raises(ConfigurationFileError, match="altered") as caught:
        load_checked(files[0], files[2])
    assert str(files[altered]) in str(caught.value)
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize("unsigned", [0, 1])
def test_an_unsigned_file_is_refused_if_signatures_are_required(files, unsigned):
    signature_path(files[unsigned]).unlink()
    assert states(load_checked(files[0]))[unsigned] == "unsigned"
    with pytest.raises(ConfigurationFileError, match="unsigned"):
        load_checked(files[0], files[2])


def test_the_signatures_of_both_files_cannot_be_exchanged(files):
    paths = [signature_path(file) for file in files[:2]]
    contents = [path.read_bytes() for path in paths]
    for path, content in zip(paths, reversed(contents), strict=True):
        path.write_bytes(content)
    assert states(load_checked(files[0])) == ("altered", "altered")


def test_a_file_that_is_not_signed_is_refused_before_it_is_parsed(files):
    files[0].write_text("[[[ no TOML")
    with pytest.raises(ConfigurationFileError, match="altered"):
        load_checked(files[0], files[2])


def test_a_signed_configuration_cannot_name_an_unsigned_calibration(files, key):
    files[0].write_text(TEXT.replace("calibration.toml", "other.toml"))
    signature_path(files[0]).write_bytes(sign(files[0].read_bytes(), key))
    (files[0].parent / "other.toml").write_bytes(files[1].read_bytes())
    with pytest.raises(ConfigurationFileError, match="unsigned"):
        load_checked(files[0], files[2])


def test_a_configuration_without_a_calibration_needs_one_signature(files, key):
    files[0].write_text("[balloon]\nid = 7\n")
    signature_path(files[0]).write_bytes(sign(files[0].read_bytes(), key))
    assert states(load_checked(files[0], files[2])) == ("signed", "no_file")


def test_an_unsigned_file_is_a_warning_only_beside_trusted_keys(files):
    for file in files[:2]:
        signature_path(file).unlink()
    assert load_checked(files[0]).warning.count("is unsigned") == 2
    files[2].unlink()
    assert "unsigned" not in load_checked(files[0]).warning


def test_a_damaged_file_of_trusted_keys_stops_the_start(files):
    files[2].write_text("damaged\n")
    with pytest.raises(ConfigurationFileError, match="line 1"):
        load_checked(files[0])
