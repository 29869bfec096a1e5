"""Purpose of a certificate: its extended key usage (RFC 5280, section 4.2.1.12)."""

from __future__ import annotations


def is_server_certificate(certificate: bytes) -> bool:
    """Return True if clients may accept a certificate (PEM) for a server.

    A certificate without an extended key usage is valid for all purposes. The result is also True if the
    certificate cannot be decoded, because its purpose is then unknown.
    """
    from cryptography import x509  # slow to import, and only needed by servers with a certificate
    from cryptography.x509.oid import ExtendedKeyUsageOID

    try:
        extensions = x509.load_pem_x509_certificate(certificate).extensions
        usages = extensions.get_extension_for_class(x509.ExtendedKeyUsage).value
    except (ValueError, x509.ExtensionNotFound):
        return True
    return ExtendedKeyUsageOID.SERVER_AUTH in usages or ExtendedKeyUsageOID.ANY_EXTENDED_KEY_USAGE in usages
