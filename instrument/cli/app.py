"""The command `pneuforce` with its sub-commands. Each command imports its modules only when it runs."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from pneuforce.instrument.cli import files, overview
from pneuforce.instrument.cli.access import certificate_commands, sign_commands, user_commands
from pneuforce.instrument.cli.calibrate import commands as calibrate_commands
from pneuforce.instrument.cli.log import commands as log_commands
from pneuforce.instrument.cli.model import commands as model_commands
from pneuforce.instrument.cli.operate import commands as operate_commands
from pneuforce.instrument.cli.recordings import commands as recording_commands
from pneuforce.instrument.cli.rig import commands as rig_commands
from pneuforce.instrument.cli.sim import commands as sim_commands
from pneuforce.instrument.cli.sim.commands import BoardName, BoardOption, ScenarioName, Seed
from pneuforce.instrument.cli.terminal.options import CHECKED_LATER, Json, RequireSignedBy, Seconds
from pneuforce.instrument.cli.watch import can_commands
from pneuforce.instrument.cli.watch import command as watch_command

app = typer.Typer(
    name="pneuforce",
    help="Pneumatic force sensor for surgical robots: measure a force with its uncertainty, serve it over "
    "Modbus, CAN, CANopen and a web page.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},  # the sub-commands inherit this setting
)
app.add_typer(model_commands.commands)
app.add_typer(rig_commands.commands)
app.add_typer(operate_commands.commands)
app.add_typer(watch_command.commands)
app.add_typer(can_commands.commands)
app.add_typer(recording_commands.commands)
app.add_typer(calibrate_commands.commands, name="calibrate")
app.add_typer(log_commands.commands, name="log")
app.add_typer(certificate_commands.commands, name="certificates")
app.add_typer(sign_commands.commands, name="sign")
app.add_typer(user_commands.commands, name="users")
app.add_typer(sim_commands.commands, name="sim")
app.add_typer(files.commands)
app.add_typer(overview.commands)
app.command()(sim_commands.press)


def _print_version(requested: bool) -> None:
    if requested:
        from importlib.metadata import version

        typer.echo(f"pneuforce {version('pneuforce')}")
        raise typer.Exit


@app.callback()
def _pneuforce(
    version: Annotated[
        bool,
        typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True),
    ] = False,
) -> None:
    pass


class MapFormat(Enum):
    """Documents that are generated from the register map."""

    MD = "md"
    FAULTS = "faults"
    CSV = "csv"
    JSON = "json"
    MAP_FILES = "map-files"
    DBC = "dbc"
    EDS = "eds"
    OBJECTS = "objects"
    ST = "st"
    PLCOPEN = "plcopen"
    SCL = "scl"
    H = "h"
    NODE_RED = "node-red"
    NODE_RED_DASHBOARD = "node-red-dashboard"
    METRICS = "metrics"
    PROMETHEUS_RULES = "prometheus-rules"
    GRAFANA = "grafana"
    MQTT = "mqtt"


@app.command()
def demo(
    seconds: Seconds = None,
    modbus_port: Annotated[int, typer.Option(help="TCP port of the Modbus server.", min=1, max=65535)] = 5020,
    can_port: Annotated[
        int, typer.Option(help="TCP port of the CAN hub (socketcand protocol).", min=1, max=65535)
    ] = 29536,
    control_port: Annotated[
        int,
        typer.Option(
            help="TCP port of the simulator's control server; 0 selects a free port.", min=0, max=65535
        ),
    ] = 0,
    web_port: Annotated[
        int, typer.Option(help="TCP port of the web page; 0 selects a free port.", min=0, max=65535)
    ] = 8080,
    scenario: ScenarioName = "demo",
    seed: Seed = None,
    board: BoardOption = BoardName.PYTHON,
) -> None:
    """Run the complete instrument on a simulated rig, with live panel, web page, Modbus and CAN.

    Starts the rig simulator, a CAN hub and the instrument as separate processes.
    Inflates the balloon, and a simulated hand presses the balloon again and again.
    The panel shows values that are read back over Modbus and CAN.

    Example: pneuforce demo --seconds 60
    """
    from secrets import token_urlsafe

    from pneuforce.instrument.cli.demo import run_demo
    from pneuforce.instrument.cli.panel import DemoPorts
    from pneuforce.instrument.cli.sim.scenarios import check_scenario
    from pneuforce.teststand.stack import check_ports_free, free_port

    simulator = ["--control-port", str(control_port), "--scenario", check_scenario(scenario)]
    simulator += ["--board", board.value]
    simulator += [] if seed is None else ["--seed", str(seed)]
    ports = {"modbus-port": modbus_port, "can-port": can_port, "control-port": control_port}
    check_ports_free({**ports, "web-port": web_port})
    demo_ports = DemoPorts(modbus_port, can_port, web_port or free_port(), token_urlsafe(12))
    raise typer.Exit(run_demo(seconds, demo_ports, simulator))


@app.command()
def run(
    config: Annotated[
        Path,
        typer.Option(
            "--config",
            help="The instrument.toml; pneuforce config --example prints one.",
            readable=CHECKED_LATER,
        ),
    ],
    record: Annotated[
        Path | None, typer.Option(help="Record everything from the start into this new file.")
    ] = None,
    require_signed_by: RequireSignedBy = None,
) -> None:
    """Run the instrument with a real rig and real buses until Ctrl-C or SIGTERM, then vent and exit.

    At the end, the instrument waits up to 5 s until the vent is verified. A second Ctrl-C ends the wait.
    The exit code is 5 if the vent was not verified: look at the balloon.

    Example: pneuforce run --config instrument.toml
    """
    from pneuforce.errors import ConfigurationFileError
    from pneuforce.instrument.cli.terminal.exit_codes import ExitCode
    from pneuforce.instrument.config import resolve_path
    from pneuforce.instrument.service.checks.start_checks import load_checked
    from pneuforce.instrument.service.processes.modbus_security_server import tls_files
    from pneuforce.instrument.service.processes.mqtt_process import mqtt_files
    from pneuforce.instrument.service.processes.web_process import web_files
    from pneuforce.instrument.service.serve import ServiceFiles, serve

    configuration = load_checked(config, require_signed_by)
    if record and not configuration.local.socket:
        raise ConfigurationFileError(
            f"{config}: --record needs the local socket, and local.socket is empty: set local.socket"
        )
    verified = serve(
        configuration,
        ServiceFiles(
            events=resolve_path(config, configuration.events.file),
            socket=resolve_path(config, configuration.local.socket),
            recording=record,
            can_parameters=resolve_path(config, configuration.can.parameter_file),
            tls=tls_files(configuration.modbus_security, config),
            web=web_files(configuration.web, config),
            mqtt=mqtt_files(configuration.mqtt, config),
        ),
    )
    raise typer.Exit(ExitCode.DONE if verified else ExitCode.VENT_NOT_CONFIRMED)


@app.command("map")
def map_(
    form: Annotated[MapFormat, typer.Option("--format", help="Document to print.")] = MapFormat.MD,
    node_id: Annotated[
        int | None,
        typer.Option(
            help="For dbc and csv: CAN node id of the instrument.", min=1, max=127, show_default="5"
        ),
    ] = None,
) -> None:
    """Print the register map and the CAN frames, as a document or as code for PLC and C programs.

    Example: pneuforce map --format dbc > pneuforce.dbc
    """
    from pneuforce.errors import UsageError
    from pneuforce.registers.views import VIEWS

    view = VIEWS[form.value]
    if node_id is None:
        text = view.render()
    elif view.render_node is None:
        formats = " and ".join(name for name, other in VIEWS.items() if other.render_node)
        raise UsageError(
            f"--node-id has no effect on the format {form.value}, which is the same for each node id: omit "
            f"--node-id, or use one of the formats {formats}"
        )
    else:
        text = view.render_node(node_id)
    typer.echo(text, nl=False)


@app.command()
def config(
    example: Annotated[
        bool, typer.Option("--example", help="Print every key with its default, meaning and limits.")
    ] = False,
    check: Annotated[
        list[Path] | None,
        typer.Option(
            "--check",
            help="Check this file; repeat it for all instruments of a computer.",
            readable=CHECKED_LATER,
        ),
    ] = None,
    require_signed_by: RequireSignedBy = None,
    as_json: Json = False,
) -> None:
    """Print an example configuration, or check an instrument.toml.

    Example: pneuforce config --example > instrument.toml
    """
    from pneuforce.errors import ConfigurationError
    from pneuforce.instrument.cli.config_check import check_config
    from pneuforce.instrument.config import example as example_text

    if as_json and not check:
        raise ConfigurationError("--json is valid only with --check: the example is printed as TOML")
    if require_signed_by and not check:
        raise ConfigurationError("--require-signed-by is valid only with --check")
    if example or not check:
        typer.echo(example_text(), nl=False)
    if check:
        check_config(check, as_json, require_signed_by)
