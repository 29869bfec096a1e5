"""Reason why a certificate and its private key cannot be used, for which OpenSSL has only a short code."""

from __future__ import annotations

from pathlib import Path


def pem_problem(certificate: str, key: str) -> str:
    """Return which of two readable files is wrong, and what it must contain."""
    from cryptography import x509  # slow to import, and only needed after an error
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    try:
        public = x509.load_pem_x509_certificate(Path(certificate).read_bytes()).public_key()
    except ValueError:
        return f"{certificate} contains no valid certificate in PEM format"
    try:
        private = load_pem_private_key(Path(key).read_bytes(), None)
    except TypeError:
        return f"{key} is encrypted: remove its password, and protect the file with its permissions"
    except ValueError:
        return f"{key} contains no valid private key in PEM format"
    if private.public_key() != public:
        return f"{key} is not the key of the certificate {certificate}"
    return f"{certificate} contains an invalid certificate after the first one"
