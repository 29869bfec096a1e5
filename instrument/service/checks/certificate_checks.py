"""Checks of the certificates that a configuration names: whether servers can use them, and their end."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.processes.modbus_security_server import tls_files
from pneuforce.instrument.service.processes.mqtt_process import mqtt_files
from pneuforce.instrument.service.processes.web_process import web_tls_files
from pneuforce.support.atomic_file import read_file
from pneuforce.support.certificate_days import begin_warning, days_left, renewal_warning
from pneuforce.support.revocation_list import authorities_without_list, list_warning
from pneuforce.support.tls_files import TlsFiles


def certificate_problems(configuration: Configuration, path: Path) -> Iterator[str]:
    """Yield a clause for each certificate file of a server that cannot be used.

    `path` is the configuration file, to which the names of files are relative.
    """
    web = configuration.web
    if web.enabled and bool(web.certificate) != bool(web.key):
        empty = "certificate" if web.key else "key"
        yield f"web.{empty} is empty: name both certificate and key, or none of them"
    for section, files in _files(configuration, path):
        unreadable = files.unreadable()
        yield from (f"{section}.{name}: {problem}" for name, problem in unreadable.items())
        try:
            if not unreadable:
                files.load()
        except OSError as error:
            yield f"{section}: {error}"


def certificate_warnings(configuration: Configuration, path: Path) -> list[str]:
    """Return a clause for each certificate or list of revoked certificates that clients will not accept.

    The certificate is not yet valid, has expired or expires soon. The list is overdue or ends soon.
    """
    found, now_s = [], time.time()
    certificates = [(section, files.own_certificate()) for section, files in _files(configuration, path)]
    mqtt_file = mqtt_files(configuration.mqtt, path)["certificate"]
    if configuration.mqtt.enabled and mqtt_file:
        certificates.append(("mqtt", Path(mqtt_file).read_bytes()))
    for section, certificate in certificates:
        warnings = begin_warning(certificate, now_s), renewal_warning(days_left(certificate, now_s))
        found += [f"{section}: {warning}" for warning in warnings if warning]
    return found + [f"modbus_security: {warning}" for warning in _list_warnings(configuration, path, now_s)]


def _list_warnings(configuration: Configuration, path: Path, now_s: float) -> Iterator[str]:
    """Yield a clause for each list of revoked certificates that is overdue, ends soon or is missing."""
    files = tls_files(configuration.modbus_security, path)
    if not (configuration.modbus_security.enabled and files.get("crl")):
        return
    crl, ca = (read_file(Path(files[name])) for name in ("crl", "ca"))
    if warning := list_warning(crl, now_s):
        yield warning
    for authority in authorities_without_list(crl, ca):
        yield (
            f"crl contains no list of the authority {authority}, so that the instrument rejects the clients "
            "of this authority: append its list to the file"
        )


def _files(configuration: Configuration, path: Path) -> Iterator[tuple[str, TlsFiles]]:
    security, web = configuration.modbus_security, configuration.web
    if security.enabled:
        yield "modbus_security", TlsFiles(**tls_files(security, path))
    if web.enabled and web.certificate and web.key:
        yield "web", TlsFiles(**web_tls_files(web, path))
