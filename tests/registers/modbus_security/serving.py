"""TLS gateway with a source in a thread, and clients with certificates."""

import asyncio
import socket
import ssl
import threading
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding

from pneuforce.instrument.commissioning.certificates import (
    certificate_pem,
    key_pem,
    new_authority,
    new_client,
    new_instrument,
)
from pneuforce.instrument.service.local_socket.unix_socket import LocalSocket
from pneuforce.registers.modbus.register_bank import RegisterBank
from pneuforce.registers.modbus.tcp import ModbusTcpOptions
from pneuforce.registers.modbus_security.__main__ import open_listener
from pneuforce.registers.modbus_security.forwarded import ForwardedConnections
from pneuforce.registers.modbus_security.gateway import Gateway
from pneuforce.registers.rights import DEFAULT_ROLES
from pneuforce.support.tls_files import TlsFiles
from tests.registers.modbus.serving import IDENTITY

#: A role that may set the pressure and nothing else, besides the usual ones.
ROLES = dict(DEFAULT_ROLES) | {"setter": ("setpoint",)}
PAST_DAYS = 400


class Pki:
    """Folder with an authority, the certificate of an instrument, and the certificates of clients."""

    def __init__(self, folder: Path):
        folder.mkdir(exist_ok=True)
        self.folder, self.now = folder, datetime.now(UTC)
        self.authority = new_authority("test authority", self.now)
        self.write("ca", self.authority)
        self.renew_instrument()

    def renew_instrument(self, days=365, age_days=0):
        begin = self.now - timedelta(days=age_days)
        self.write("instrument", new_instrument(self.authority, ["localhost", "127.0.0.1"], begin, days))

    @property
    def own(self):
        """Return the paths of the certificate and the key of the instrument."""
        return {
            name: str(self.folder / file)
            for name, file in (("certificate", "instrument.pem"), ("key", "instrument.key"))
        }

    def client(self, name, role, days=365, age_days=0):
        """Write and return the certificate of a client that was made `age_days` ago."""
        pair = new_client(self.authority, name, role, self.now - timedelta(days=age_days), days)
        self.write(name, pair)
        return pair

    def write_overdue_list(self, days):
        """Write a list of revoked certificates whose next update was due `days` ago. Return its path."""
        due, authority = self.now - timedelta(days=days), self.authority
        builder = x509.CertificateRevocationListBuilder().issuer_name(authority.certificate.subject)
        builder = builder.last_update(due - timedelta(days=7)).next_update(due)
        crl = self.folder / "crl.pem"
        crl.write_bytes(builder.sign(authority.key, SHA256()).public_bytes(Encoding.PEM))
        return crl

    def write(self, name, pair):
        (self.folder / f"{name}.pem").write_bytes(certificate_pem(pair.certificate))
        (self.folder / f"{name}.key").write_bytes(key_pem(pair.key))

    def files(self, crl=""):
        return TlsFiles(**self.own, ca=str(self.folder / "ca.pem"), crl=crl)

    def context(self, name="", authority="ca"):
        """Return the context of a client; without a certificate if `name` is empty."""
        context = ssl.create_default_context(cafile=self.folder / f"{authority}.pem")
        if name:
            context.load_cert_chain(self.folder / f"{name}.pem", self.folder / f"{name}.key")
        return context


class Serving:
    """Running gateway."""

    def __init__(self, gateway, pool, port):
        self.gateway, self.pool, self.port = gateway, pool, port

    def connect(self, context, session=None):
        """Return a TLS connection. Raises ssl.SSLError at the handshake or at the first read."""
        plain = socket.create_connection(("127.0.0.1", self.port), timeout=15)
        return context.wrap_socket(plain, server_hostname="localhost", session=session)


@contextmanager
def serving(folder, source, files, allow=(), roles=ROLES):
    """Run a gateway and the connections that it forwards until the block ends."""
    loop = asyncio.new_event_loop()
    pool = ForwardedConnections(
        source, RegisterBank(), IDENTITY, ModbusTcpOptions(max_connections=8), roles, loop.time
    )
    local = LocalSocket(folder / "gateway.sock", pool.new_connection)
    gateway = Gateway(files, local.path, list(allow))
    listener = open_listener("127.0.0.1", 0)
    port = listener.getsockname()[1]
    loop.run_until_complete(local.open())
    task = loop.create_task(gateway.run(listener))
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    try:
        yield Serving(gateway, pool, port)
    finally:
        loop.call_soon_threadsafe(task.cancel)
        loop.call_soon_threadsafe(pool.close)
        loop.call_soon_threadsafe(loop.stop)
        thread.join()
        loop.run_until_complete(asyncio.sleep(0.01))
        local.close()
        loop.close()
