"""Reason why a TLS handshake failed, in a few words."""

from __future__ import annotations

import ssl


def tls_failure_reason(error: ssl.SSLError) -> str:
    """Return the text of OpenSSL for an error, for example "unsupported protocol"."""
    return getattr(error, "verify_message", "") or str(error.reason).lower().replace("_", " ")
