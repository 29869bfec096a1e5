"""Results of `pneuforce sign`, as text or as JSON."""

from __future__ import annotations

import sys
from pathlib import Path

from pneuforce.errors import UsageError
from pneuforce.instrument.cli.terminal.failure import checked_values
from pneuforce.instrument.cli.terminal.output import json_text, print_text
from pneuforce.instrument.commissioning.signing import new_key, sign_file
from pneuforce.instrument.signing.signed_file import SignatureState, read_signed
from pneuforce.instrument.signing.trusted_keys import FILE_NAME, trusted_keys_of


def make_key(key: Path, signer: str, passphrase: bool) -> str:
    """Make a key. Return what to do next. Raises PneuforceError."""
    if passphrase and not sys.stdin.isatty():
        raise UsageError("the passphrase is asked for on a terminal; without a terminal, use --no-passphrase")
    line = new_key(key, signer, passphrase)
    return (
        f"{key} and {key}.pub are made. Who has {key} can sign files: keep it off the instrument.\n"
        f"Add this line to the file {FILE_NAME} of each instrument, which only root may write:\n{line}"
    )


def sign_files(files: list[Path], key: Path) -> str:
    """Sign the files. Return the names of the signatures. Raises PneuforceError."""
    return "\n".join(f"{sign_file(file, key)} is written: copy it together with {file}" for file in files)


def check_files(files: list[Path], trusted_keys: Path | None, as_json: bool) -> int:
    """Print the signature of each file. Return the exit code, 1 if a file is not signed by a trusted key.

    Raises ConfigurationError if a file cannot be read.
    """
    signatures = {
        file: read_signed(file, trusted_keys_of(file, trusted_keys)._replace(required=False)).signature
        for file in files
    }
    passed = all(each.state is SignatureState.SIGNED for each in signatures.values())
    lines = [f"{file}: {signature}" for file, signature in signatures.items()]
    if as_json:
        facts = [{"file": str(file), **each._asdict()} for file, each in signatures.items()]
        print_text(json_text(checked_values(passed, "; ".join(lines)) | {"files": facts}))
    else:
        print_text("\n".join(lines))
    return 0 if passed else 1
