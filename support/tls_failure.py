"""Reason why a TLS handshake failed, in words."""

from __future__ import annotations

import ssl


def tls_failure_reason(error: ssl.SSLError) -> str:
    """Return the text of OpenSSL for an error, for example "unsupported protocol"."""
    return getattr(error, "verify_message", "") or str(error.reason).lower().replace("_", " ")


#: Alerts with which a server rejects the certificate of a client, as OpenSSL names them.
_CERTIFICATE_ALERTS = (
    *("BAD_CERTIFICATE", "UNSUPPORTED_CERTIFICATE", "CERTIFICATE_REVOKED", "CERTIFICATE_EXPIRED"),
    *("CERTIFICATE_UNKNOWN", "CERTIFICATE_REQUIRED", "UNKNOWN_CA", "ACCESS_DENIED"),
)


def client_failure_reason(error: ssl.SSLError) -> str:
    """Return why the connection of a client failed, and what to do if the server rejects its certificate."""
    reason = tls_failure_reason(error)
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"its certificate is not accepted: {reason}"
    if not str(error.reason).endswith(tuple(f"ALERT_{alert}" for alert in _CERTIFICATE_ALERTS)):
        return reason
    return (
        f"the server does not accept the certificate of this client ({reason}): the certificate has expired, "
        "is from another authority or is revoked. Look at its end with pneuforce certificates show; the log "
        "of the server names the reason"
    )
