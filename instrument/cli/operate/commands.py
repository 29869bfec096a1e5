"""The commands that operate a running instrument, for example status, vent and hold."""

from __future__ import annotations

from typing import Annotated

import typer

from pneuforce.instrument.cli.operate.instrument_address import InstrumentAddress
from pneuforce.instrument.cli.terminal.option_groups import expand_options
from pneuforce.instrument.cli.terminal.options import Json

commands = typer.Typer()


@commands.command()
@expand_options
def status(*, as_json: Json = False, address: InstrumentAddress) -> None:
    """Show state, fault with its remedy, force, pressure, setpoint, lease and versions of an instrument.

    The force is shown with its expanded uncertainty (2 u), or with the reason why there is none.
    With --json, a value that is not available is null.

    Example: pneuforce status --json
    """
    from pneuforce.instrument.cli.operate.status import show_status

    show_status(address.url, as_json)


@commands.command()
@expand_options
def vent(
    *,
    timeout_s: Annotated[
        float,
        typer.Option("--timeout", help="Longest time for the confirmation, in s.", min=0.0, max=60.0),
    ] = 10.0,
    as_json: Json = False,
    address: InstrumentAddress,
) -> None:
    """Vent the balloon, and wait until the vent is verified: the sensor reads less than 0.3 kPa for 0.5 s.

    Look at the balloon: behind a kinked tube, the sensor reads zero although the balloon is inflated.
    The vent is the first write that is sent, in every state and without a lease.
    The exit code is 0 only if the vent is confirmed, and 5 if the vent was sent but not confirmed.
    With any other exit code, the vent was perhaps not sent: press the stop switch at the rig.

    Example: pneuforce vent
    """
    from pneuforce.instrument.cli.operate.vent import vent_and_confirm

    vent_and_confirm(address.url, timeout_s, as_json)


@commands.command("set")
@expand_options
def set_(
    *,
    setpoint_kpa: Annotated[float, typer.Argument(help="Setpoint in kPa.", min=2.0, max=12.0)],
    as_json: Json = False,
    address: InstrumentAddress,
) -> None:
    """Write the setpoint of the next hold. A balloon that is held gets the setpoint at once.

    The force is measured only at setpoints from 4.95 to 11.45 kPa. Other setpoints give a warning.

    Example: pneuforce set 6.5
    """
    from pneuforce.instrument.cli.operate.requests import set_setpoint

    set_setpoint(address.url, setpoint_kpa, as_json)


@commands.command()
@expand_options
def limit(
    *,
    force_limit_n: Annotated[float, typer.Argument(help="Limit of the force alarm in N.", min=0.1, max=20.0)],
    as_json: Json = False,
    address: InstrumentAddress,
) -> None:
    """Write the limit of the force alarm. No valve is moved.

    Example: pneuforce limit 4.5
    """
    from pneuforce.instrument.cli.operate.requests import execute, set_force_limit

    execute(
        address.url,
        lambda sensor: set_force_limit(sensor, force_limit_n),
        as_json,
        force_limit_n=force_limit_n,
    )


@commands.command()
@expand_options
def hold(
    *,
    setpoint_kpa: Annotated[
        float | None,
        typer.Argument(help="Setpoint in kPa; default: the last setpoint.", min=2.0, max=12.0),
    ] = None,
    seconds: Annotated[
        float | None, typer.Option(help="Vent after this time, in s; default: at Ctrl-C.", min=0.0)
    ] = None,
    lease_s: Annotated[float, typer.Option("--lease", help="Lease time, in s.", min=0.2, max=60.0)] = 2.0,
    take_over: Annotated[
        bool,
        typer.Option(
            "--take-over",
            help="Take the balloon over from another program of this computer: vent, then hold.",
        ),
    ] = False,
    as_json: Json = False,
    address: InstrumentAddress,
) -> None:
    """Vent, inflate the balloon, hold the balloon and renew the lease until Ctrl-C, then vent.

    Shows the measurement once per second. SIGTERM, and the end of the terminal, vent in the same way.
    If the command is killed, the lease expires, and the instrument vents and trips.
    A balloon that is inflated, or a lease of a client, is taken over only with --take-over.
    The exit code is 5 if the hold has ended and its vent is not verified: the balloon may be inflated.

    Example: pneuforce hold 6.5 --seconds 60
    """
    from pneuforce.instrument.cli.operate.hold import hold_until_stopped

    hold_until_stopped(address.url, setpoint_kpa, lease_s, seconds, take_over, as_json)


@commands.command()
@expand_options
def release(*, as_json: Json = False, address: InstrumentAddress) -> None:
    """Vent, and end the lease of this computer, for example after a program that was killed.

    Example: pneuforce release
    """
    from pneuforce.instrument.cli.operate.requests import execute, release_lease

    execute(address.url, release_lease, as_json, balloon_may_be_inflated=False)


@commands.command()
@expand_options
def clear(*, as_json: Json = False, address: InstrumentAddress) -> None:
    """Clear the latched faults. Remove their cause before. This command moves no valve.

    Example: pneuforce clear
    """
    from pneuforce.instrument.cli.operate.requests import clear_and_report

    clear_and_report(address.url, as_json)


@commands.command()
@expand_options
def zero(*, as_json: Json = False, address: InstrumentAddress) -> None:
    """Make a zero adjustment of the pressure sensor. This is possible only while the rig is vented.

    Example: pneuforce zero
    """
    from pneuforce.instrument.cli.operate.requests import execute, make_zero_adjustment

    execute(address.url, make_zero_adjustment, as_json)


@commands.command("new-balloon")
@expand_options
def new_balloon(
    *,
    balloon_id: Annotated[int, typer.Argument(help="Number of the new balloon.", min=0, max=65535)],
    as_json: Json = False,
    address: InstrumentAddress,
) -> None:
    """Report that another balloon was mounted. This is possible only while the rig is vented.

    The count of inflations begins again. A force calibration of another balloon is no longer used.
    The number is valid until the instrument ends: also write balloon.id into its configuration.

    Example: pneuforce new-balloon 12
    """
    from pneuforce.instrument.cli.operate.requests import execute, mount_balloon

    execute(address.url, lambda sensor: mount_balloon(sensor, balloon_id), as_json, balloon_id=balloon_id)
