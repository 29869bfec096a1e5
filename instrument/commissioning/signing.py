"""Signing of files with the program ssh-keygen. The private key is never read by this program."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from pneuforce.errors import ConfigurationError, NotInstalled, UsageError
from pneuforce.instrument.signing.signed_file import signature_path
from pneuforce.instrument.signing.ssh_signature import KEY_TYPE, NAMESPACE, decode_signature
from pneuforce.instrument.signing.trusted_keys import SIGNER_NAME
from pneuforce.support.atomic_file import read_file, replaced_user_file


def new_key(key: Path, signer: str, passphrase: bool) -> str:
    """Make a private key and a public key. Return the line for the files of trusted keys.

    ssh-keygen asks for the passphrase on the terminal. Raises ConfigurationError or UsageError.
    """
    if not SIGNER_NAME.fullmatch(signer):
        raise UsageError(f"{signer!r} cannot be the name of a signer: use up to 64 of A-Z a-z 0-9 . _ @ + -")
    public = key.with_name(f"{key.name}.pub")
    for path in (key, public):
        if path.exists():
            raise UsageError(f"{path} exists: choose another name, or move the old file away")
    without = [] if passphrase else ["-N", ""]
    _ssh_keygen(["-q", "-t", "ed25519", "-C", signer, "-f", str(key), *without], f"{key} was not made")
    kind, blob = public.read_text(encoding="ascii").split()[:2]
    return f"{signer} {kind} {blob}"


def sign_file(file: Path, key: Path) -> Path:
    """Sign a file with a private key, and return the path of the signature.

    An old signature is replaced. Raises ConfigurationError if a file cannot be used, or if the key is not an
    Ed25519 key.
    """
    content = read_file(file)
    read_file(key, "pneuforce sign new-key makes a key")
    what = f"{file} was not signed"
    armored = _ssh_keygen(["-Y", "sign", "-q", "-f", str(key), "-n", NAMESPACE], what, content)
    try:
        signature = decode_signature(armored)
    except ValueError as error:
        raise ConfigurationError(f"{what}: {error}; use a key of the type {KEY_TYPE.decode()}") from None
    if not signature.matches(content):
        raise ConfigurationError(f"{what}: the signature of ssh-keygen does not match the file")
    with replaced_user_file(signature_path(file)) as temporary:
        temporary.write_bytes(armored)
        temporary.chmod(0o644)
    return signature_path(file)


def _ssh_keygen(arguments: list[str], what: str, standard_input: bytes | None = None) -> bytes:
    """Run ssh-keygen and return its standard output. `what` is the beginning of the message of a failure."""
    program = shutil.which("ssh-keygen")
    if program is None:
        raise NotInstalled(f"{what}: ssh-keygen is missing (Debian package openssh-client)")
    done = subprocess.run([program, *arguments], input=standard_input, stdout=subprocess.PIPE, check=False)
    if done.returncode:
        raise ConfigurationError(f"{what}: ssh-keygen failed, see its message above")
    return done.stdout
