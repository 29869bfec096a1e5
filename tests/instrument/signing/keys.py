"""Real keys and signatures, made by ssh-keygen."""

import subprocess

from pneuforce.instrument.signing.trusted_keys import parse_trusted_keys


def make_key(path, kind="ed25519"):
    """Make a key without a passphrase, and return its path."""
    ssh_keygen("-q", "-t", kind, "-N", "", "-C", path.name, "-f", path)
    return path


def trusted_line(key, name):
    """Return the line of a file of trusted keys."""
    return f"{name} {' '.join(key.with_name(f'{key.name}.pub').read_text().split()[:2])}\n"


def trusted(key, name):
    """Return the keys of a file of trusted keys with one line."""
    return parse_trusted_keys(trusted_line(key, name).encode(), "trusted-keys")


def sign(content, key, namespace="pneuforce", *options):
    """Return the signature file that ssh-keygen makes for a content."""
    return ssh_keygen("-Y", "sign", "-q", "-f", key, "-n", namespace, *options, standard_input=content)


def ssh_keygen(*words, standard_input=None):
    return subprocess.run(
        ["ssh-keygen", *map(str, words)], input=standard_input, capture_output=True, check=True
    ).stdout
