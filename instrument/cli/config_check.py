"""`pneuforce config --check`: check that instruments can start with their configuration files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pneuforce.errors import ConfigurationFileError
from pneuforce.instrument.cli.terminal.output import done_json, print_text
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.checks.certificate_checks import certificate_warnings
from pneuforce.instrument.service.checks.file_checks import check_files
from pneuforce.instrument.service.checks.instruments_on_one_host import check_instruments
from pneuforce.instrument.service.checks.port_checks import port_remarks
from pneuforce.instrument.service.checks.start_checks import load_trusted, reject, start_problems
from pneuforce.instrument.service.checks.valid_part import problems_of_valid_part


def check_config(paths: list[Path], as_json: bool, require_signed_by: Path | None = None) -> None:
    """Print that the files are valid, with their warnings. With several files, each is one instrument.

    Raises ConfigurationFileError with one line for each problem of a file, and for each port or file that two
    instruments use.
    """
    configurations, warnings, problems = {}, {}, []
    for path in paths:
        try:
            configurations[path], problem = load_trusted(path, require_signed_by)
            warnings[path] = _warning(configurations[path], path, problem)
        except ConfigurationFileError as error:
            problems += [str(error), *problems_of_valid_part(error, path)]
    try:
        check_instruments(configurations)
    except ConfigurationFileError as error:
        problems.append(str(error))
    if problems:
        raise ConfigurationFileError("\n".join(problems))
    if as_json:
        files = [
            _values(configuration, path, warnings[path]) for path, configuration in configurations.items()
        ]
        values = files[0] if len(files) == 1 else {"instruments": files}
        print_text(done_json("; ".join(_result(path, warnings[path]) for path in configurations), **values))
        return
    for path, configuration in configurations.items():
        print_text(_result(path, warnings[path]))
        print_text(f"configuration hash {configuration.hash_text}")
        for note in _notes(configuration):
            print_text(note)
        for name, signature in configuration.signatures._asdict().items():
            if signature.signer:
                print_text(f"the {name} file is {signature}")


def _result(path: Path, warning: str) -> str:
    return f"{path}: good" + (f", but {warning}" if warning else "")


def _values(configuration: Configuration, path: Path, warning: str) -> dict[str, Any]:
    return {
        "file": str(path),
        "configuration_hash": configuration.hash_text,
        "warning": warning or None,
        "notes": _notes(configuration),
        "signatures": {name: str(each) for name, each in configuration.signatures._asdict().items()},
    }


def _notes(configuration: Configuration) -> list[str]:
    """Return a sentence for each section that is in the file, but disabled because `enabled` is missing."""
    return [
        f"[{name}] is off: add enabled = true to use it"
        for name in sorted(configuration.model_fields_set)
        if "enabled" not in (section := getattr(configuration, name)).model_fields_set
        and not getattr(section, "enabled", True)
    ]


def _warning(configuration: Configuration, path: Path, calibration_problem: str) -> str:
    """Return the warnings about a configuration.

    `calibration_problem` is "" if the calibration can be used. Raises ConfigurationFileError with all
    problems if a file cannot be used.
    """
    problems, remarks = check_files(configuration, path)
    if calibration_problem:  # it has the same cause, with a better remedy
        problems = [problem for problem in problems if not problem.startswith("measurement.calibration: ")]
    reject(path, (calibration_problem, *start_problems(configuration, path), *problems))
    return "; ".join(
        [
            *filter(None, [configuration.warning]),
            *certificate_warnings(configuration, path),
            *remarks,
            *port_remarks(configuration),
        ]
    )
