"""`pneuforce certificates`: certificates for Modbus/TCP Security and the web page, without a PKI."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli.terminal.options import Json

commands = typer.Typer(
    no_args_is_help=True,
    help="Make certificates for Modbus/TCP Security and the web page: authority, instruments, clients with "
    "roles, revocation.",
)

Folder = Annotated[
    Path, typer.Argument(help="Folder with ca.pem and ca.key. Keep ca.key off the instrument.")
]
Days = Annotated[int, typer.Option(help="Days for which the certificate is valid.", min=1, max=3650)]


@commands.command("authority")
def authority_(
    folder: Annotated[Path, typer.Argument(help="New folder for ca.pem and ca.key.")],
    name: Annotated[str, typer.Option(help="Name of the authority.")] = "pneuforce authority",
) -> None:
    """Make an authority, which signs all other certificates.

    Example: pneuforce certificates authority pki
    """
    from pneuforce.instrument.cli.access.certificates import make_authority

    typer.echo(make_authority(folder, name))


@commands.command()
def instrument(
    folder: Folder,
    host: Annotated[
        list[str], typer.Option(help="Address or host name that clients connect to; can be repeated.")
    ],
    name: Annotated[str, typer.Option(help="Name of the new files.")] = "instrument",
    days: Days = 730,
) -> None:
    """Make the certificate and the key of an instrument.

    Example: pneuforce certificates instrument pki --host 192.168.1.20 --host sensor.local
    """
    from pneuforce.instrument.cli.access.certificates import make_instrument

    typer.echo(make_instrument(folder, name, host, days))


@commands.command()
def client(
    folder: Folder,
    name: Annotated[str, typer.Argument(help="Name of the client and of the new files.")],
    role: Annotated[
        str, typer.Option(help=r"Role in \[modbus_security] roles: viewer, operator, or your own.")
    ] = "viewer",
    days: Days = 730,
) -> None:
    """Make the certificate and the key of a client, for example of a PLC.

    Example: pneuforce certificates client pki plc --role operator
    """
    from pneuforce.instrument.cli.access.certificates import make_client

    typer.echo(make_client(folder, name, role, days))


@commands.command()
def revoke(
    folder: Folder,
    certificate: Annotated[Path, typer.Argument(help="Certificate that must not be used any more (PEM).")],
) -> None:
    """Add a certificate to the list of revoked certificates, crl.pem. Then copy crl.pem to each instrument.

    Example: pneuforce certificates revoke pki pki/plc.pem
    """
    from pneuforce.instrument.cli.access.certificates import revoke as revoke_

    typer.echo(revoke_(folder, certificate))


@commands.command()
def show(
    file: Annotated[
        Path, typer.Argument(help="A certificate, or a list of revoked certificates such as crl.pem (PEM).")
    ],
    as_json: Json = False,
) -> None:
    """Print name, role and validity of a certificate, or the content of a list of revoked certificates.

    Example: pneuforce certificates show pki/plc.pem
    """
    from pneuforce.instrument.cli.access.certificate_text import show as show_

    typer.echo(show_(file, as_json))
