"""Tests of `pneuforce sign` as a user types it, with the real ssh-keygen as signer and as second verifier."""

import json
import subprocess
from pathlib import Path

import pytest

from tests.command_runner import pneuforce
from tests.instrument.signing.keys import make_key, ssh_keygen
from tests.tools import needs

pytestmark = needs("openssh-client", "/usr/bin/ssh-keygen")
EXAMPLES = Path(__file__).parents[4] / "docs/examples"


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """Return a folder with a key that `sign new-key` has made, and with the file trusted-keys."""
    folder = tmp_path_factory.mktemp("lab")
    made = pneuforce("sign", "new-key", folder / "lab.key", "--signer", "lab", "--no-passphrase")
    assert (made.returncode, made.stderr) == (0, "")
    (folder / "trusted-keys").write_text(made.stdout.splitlines()[-1] + "\n")
    return folder


def test_only_its_owner_can_read_a_new_key(lab):
    assert (lab / "lab.key").stat().st_mode & 0o777 == 0o600


def test_an_existing_key_is_kept(lab):
    before = (lab / "lab.key").read_bytes()
    again = pneuforce("sign", "new-key", lab / "lab.key", "--signer", "lab", "--no-passphrase")
    assert (again.returncode, len(again.stderr.splitlines())) == (2, 1)
    assert (lab / "lab.key").read_bytes() == before


def test_a_passphrase_is_asked_for_only_on_a_terminal(lab):
    refused = pneuforce("sign", "new-key", lab / "other.key", "--signer", "lab")
    assert (refused.returncode, len(refused.stderr.splitlines())) == (2, 1)
    assert not (lab / "other.key").exists()


@pytest.mark.parametrize("signer", ["", "two words", "*", "x\nother ssh-ed25519 AAAA"])
def test_a_name_that_the_file_of_keys_cannot_contain_is_refused(lab, signer):
    refused = pneuforce("sign", "new-key", lab / "other.key", "--signer", signer, "--no-passphrase")
    assert (refused.returncode, (lab / "other.key").exists()) == (2, False)


def test_a_signed_file_is_verified_by_both_programs_until_it_changes(lab):
    file = lab / "instrument.toml"
    file.write_text("[balloon]\nid = 7\n")
    for expected in (0, 1):
        if expected == 0:
            assert pneuforce("sign", "file", file, "--key", lab / "lab.key").returncode == 0
        checked = pneuforce("sign", "check", file, "--json")
        (facts,) = json.loads(checked.stdout)["files"]
        assert (checked.returncode, facts["state"]) == (expected, ["signed", "altered"][expected])
        verified = subprocess.run(
            f"ssh-keygen -Y verify -n pneuforce -I lab -f trusted-keys -s {file}.sig",
            shell=True,
            cwd=lab,
            input=file.read_bytes(),
            capture_output=True,
            check=False,
        )
        assert (verified.returncode == 0) is (expected == 0), verified.stderr
        file.write_text("[balloon]\nid = 8\n")
    assert pneuforce("sign", "file", file, "--key", lab / "lab.key").returncode == 0
    assert pneuforce("sign", "check", file).returncode == 0


def test_an_encrypted_key_does_not_hang_a_script(lab, tmp_path):
    """Without a terminal, ssh-keygen cannot ask for the passphrase, and nothing is written."""
    key = tmp_path / "key"
    ssh_keygen("-q", "-t", "ed25519", "-N", "secret", "-f", key)
    file = tmp_path / "file.toml"
    file.write_text("")
    refused = subprocess.run(
        ["setsid", "pneuforce", "sign", "file", file, "--key", key],
        env={"PATH": f"{Path(__file__).parents[4]}/.venv/bin:/usr/bin:/bin"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert (refused.returncode, (tmp_path / "file.toml.sig").exists()) == (2, False)
    assert "Traceback" not in refused.stderr


def test_other_keys_and_missing_files_are_refused(lab, tmp_path):
    file = tmp_path / "file.toml"
    file.write_text("")
    for key in (make_key(tmp_path / "rsa", "rsa"), tmp_path / "absent", file):
        refused = pneuforce("sign", "file", file, "--key", key)
        assert (refused.returncode, "Traceback" in refused.stderr) == (2, False)
        assert not (tmp_path / "file.toml.sig").exists()


def test_a_new_calibration_part_says_that_the_signature_is_no_longer_valid(lab, tmp_path):
    out = tmp_path / "calibration.toml"
    words = ("calibrate", "radius", EXAMPLES / "radius.csv", "--out", out)
    for _ in range(2):  # on the same day, the second file has the same bytes
        assert "signature" not in pneuforce(*words).stdout
        assert pneuforce("sign", "file", out, "--key", lab / "lab.key").returncode == 0
    lag = pneuforce("calibrate", "lag", EXAMPLES / "lag.csv", "--out", out)
    assert f"pneuforce sign file {out}" in lag.stdout
    checked = pneuforce("sign", "check", out, "--trusted-keys", lab / "trusted-keys")
    assert (checked.returncode, "altered" in checked.stdout) == (1, True)
