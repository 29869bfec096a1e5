"""Tests of signed files: what an attacker can do with a file, its signature and the keys."""

import os
import threading
from pathlib import Path

import pytest

from pneuforce.errors import ConfigurationError
from pneuforce.instrument.signing import signed_file
from pneuforce.instrument.signing.signed_file import (
    MAX_SIGNATURE_BYTES,
    SignatureState,
    read_signed,
    signature_path,
)
from pneuforce.instrument.signing.trusted_keys import (
    NO_TRUSTED_KEYS,
    TrustedKeys,
    parse_trusted_keys,
    trusted_keys_of,
)
from pneuforce.registers.codes import SIGNATURES
from tests.instrument.signing.keys import make_key, sign, trusted, trusted_line
from tests.tools import needs

pytestmark = needs("openssh-client", "/usr/bin/ssh-keygen")
CONTENT = b"[balloon]\nid = 7\n"


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    """Return the keys of a laboratory, which is trusted, and of an attacker."""
    folder = tmp_path_factory.mktemp("keys")
    return make_key(folder / "lab"), make_key(folder / "attacker")


@pytest.fixture
def signed(tmp_path, keys):
    """Return a signed file and the trusted keys."""
    file = tmp_path / "instrument.toml"
    file.write_bytes(CONTENT)
    signature_path(file).write_bytes(sign(CONTENT, keys[0]))
    return file, TrustedKeys(trusted(keys[0], "lab"), Path("trusted-keys"), required=True)


def state_of(file, trusted_keys):
    content, signature = read_signed(file, trusted_keys._replace(required=False))
    assert content == file.read_bytes()
    if not signature.accepted:
        with pytest.raises(ConfigurationError, match="is required"):
            read_signed(file, trusted_keys)
    return signature.state


def test_a_signed_file_names_its_signer(signed):
    file, trusted_keys = signed
    content, signature = read_signed(file, trusted_keys)
    assert (content, signature.state, signature.signer) == (CONTENT, SignatureState.SIGNED, "lab")
    assert signature.fingerprint in str(signature)


def test_the_registers_have_a_code_for_each_state():
    assert set(SIGNATURES.names.values()) == {*SignatureState}
    assert SIGNATURES.names[1] == SignatureState.SIGNED


def test_a_file_without_a_signature_is_unsigned(signed):
    file, trusted_keys = signed
    signature_path(file).unlink()
    assert state_of(file, trusted_keys) == "unsigned"


def write(change):
    return lambda file, _keys: file.write_bytes(change(CONTENT))


def replace_signature(make):
    return lambda file, keys: signature_path(file).write_bytes(make(keys, signature_path(file).read_bytes()))


def other_file(file, _keys):
    signature_path(file).unlink()
    os.mkfifo(signature_path(file))


def huge(file, _keys):
    signature_path(file).write_bytes(b"")
    os.truncate(signature_path(file), 1_000_000_000)


def folder(file, _keys):
    signature_path(file).unlink()
    signature_path(file).mkdir()


def loop(file, _keys):
    signature_path(file).unlink()
    signature_path(file).symlink_to(signature_path(file).name)


def device(file, _keys):
    signature_path(file).unlink()
    signature_path(file).symlink_to("/dev/zero")


ATTACKS = {
    "a changed value": write(lambda content: content.replace(b"7", b"8")),
    "other line ends": write(lambda content: content.replace(b"\n", b"\r\n")),
    "an added line": write(lambda content: content + b"\n"),
    "a file that is cut short": write(lambda content: content[:-1]),
    "a byte order mark": write(lambda content: b"\xef\xbb\xbf" + content),
    "the signature of another file": replace_signature(lambda keys, _old: sign(b"[rig]\n", keys[0])),
    "a signature for another purpose": replace_signature(lambda keys, _old: sign(CONTENT, keys[0], "file")),
    "a truncated signature": replace_signature(lambda _keys, old: old[:200]),
    "an empty signature": replace_signature(lambda _keys, _old: b""),
    "two signatures": replace_signature(lambda _keys, old: old + old),
    "a pipe": other_file,
    "a signature of 1 GB": huge,
    "a folder": folder,
    "a loop of links": loop,
    "an endless device": device,
}


@pytest.mark.parametrize("attack", ATTACKS)
def test_an_attack_is_detected(signed, keys, attack):
    file, trusted_keys = signed
    ATTACKS[attack](file, keys)
    assert state_of(file, trusted_keys) == "altered"


def test_the_signature_of_an_attacker_is_not_trusted(signed, keys):
    file, trusted_keys = signed
    altered = CONTENT + b"# altered\n"
    file.write_bytes(altered)
    signature_path(file).write_bytes(sign(altered, keys[1]))
    assert state_of(file, trusted_keys) == "unknown_key"


def test_without_trusted_keys_an_altered_file_is_still_detected(signed):
    file, _ = signed
    assert read_signed(file, NO_TRUSTED_KEYS).signature.state == "unknown_key"
    file.write_bytes(b"")
    assert read_signed(file, NO_TRUSTED_KEYS).signature.state == "altered"


def test_a_signature_behind_a_link_is_checked_against_the_content(signed, tmp_path):
    file, trusted_keys = signed
    link = tmp_path / "link.toml"
    link.symlink_to(file)
    assert state_of(link, trusted_keys) == "unsigned"
    signature_path(link).symlink_to(signature_path(file))
    assert state_of(link, trusted_keys) == "signed"


def test_a_file_that_changes_while_it_is_read_gives_only_bytes_that_were_checked(signed):
    """Another thread writes both contents again and again. Whatever is returned as signed is signed."""
    file, trusted_keys = signed
    informed = trusted_keys._replace(required=False)
    end = threading.Event()

    def change():
        while not end.is_set():
            file.write_bytes(CONTENT.replace(b"7", b"8"))
            file.write_bytes(CONTENT)

    writer = threading.Thread(target=change)
    writer.start()
    try:
        seen = [read_signed(file, informed) for _ in range(300)]
    finally:
        end.set()
        writer.join()
    assert all((each.signature.state == "signed") is (each.content == CONTENT) for each in seen)


def test_each_file_is_opened_once(signed, monkeypatch):
    """The file is replaced after it was read. The returned content is that of the first read."""
    file, trusted_keys = signed
    check = signed_file.check_signature

    def replace_then_check(*arguments):
        file.write_bytes(b"altered")
        return check(*arguments)

    monkeypatch.setattr(signed_file, "check_signature", replace_then_check)
    assert read_signed(file, trusted_keys).content == CONTENT


def test_only_a_signature_of_normal_size_is_read(signed):
    file, trusted_keys = signed
    padded = signature_path(file).read_bytes() + b"\n" * (MAX_SIGNATURE_BYTES * 2)
    signature_path(file).write_bytes(padded)
    assert state_of(file, trusted_keys) == "signed"


# ---- trusted keys


def test_the_file_of_trusted_keys_has_the_format_of_openssh(keys):
    lab, other = keys
    name, kind, blob = trusted_line(lab, "lab@example.org").split()
    text = f'# keys\n\n{name} namespaces="pneuforce" {kind} {blob} a comment\r\n{trusted_line(other, "b")}'
    parsed = parse_trusted_keys(text.encode(), "file")
    assert [key.name for key in parsed] == ["lab@example.org", "b"]
    assert TrustedKeys(parsed).owner_of(parsed[1].public_key) == "b"
    assert TrustedKeys(parsed[:1]).owner_of(parsed[1].public_key) == ""


@pytest.mark.parametrize(
    "line",
    [
        "lab",
        "lab ssh-ed25519",
        "lab ssh-ed25519 AAAA",
        "lab ssh-ed25519 $$$$",
        "* ssh-ed25519 {key}",
        "lab cert-authority ssh-ed25519 {key}",
        'lab valid-before="20200101" ssh-ed25519 {key}',
        "lab ssh-rsa {key}",
        "lab\x1b[31m ssh-ed25519 {key}",
        "\xff",
    ],
)
def test_a_line_that_is_not_understood_is_refused(keys, line):
    text = line.format(key=trusted_line(keys[0], "x").split()[2])
    with pytest.raises(ConfigurationError, match=r"line 1|UTF-8") as caught:
        parse_trusted_keys(text.encode("latin-1"), "file")
    assert str(caught.value).isprintable()


def test_required_keys_must_exist_and_be_protected(tmp_path, keys):
    file = tmp_path / "keys"
    with pytest.raises(ConfigurationError, match="no such file"):
        trusted_keys_of(tmp_path / "instrument.toml", file)
    file.write_text("# no key\n")
    with pytest.raises(ConfigurationError, match="contains no key"):
        trusted_keys_of(tmp_path / "instrument.toml", file)
    file.write_text(trusted_line(keys[0], "lab"))
    file.chmod(0o664)
    with pytest.raises(ConfigurationError, match="other users may write"):
        trusted_keys_of(tmp_path / "instrument.toml", file)
    file.chmod(0o644)
    found = trusted_keys_of(tmp_path / "instrument.toml", file)
    assert ([key.name for key in found.keys], found.required) == (["lab"], True)


def test_without_required_keys_those_beside_the_configuration_are_used(tmp_path, keys):
    configuration = tmp_path / "instrument.toml"
    assert trusted_keys_of(configuration, None) == NO_TRUSTED_KEYS
    (tmp_path / "trusted-keys").write_text(trusted_line(keys[0], "lab"))
    found = trusted_keys_of(configuration, None)
    assert ([key.name for key in found.keys], found.required) == (["lab"], False)
