"""`pneuforce config --check`: check that instruments can start with their configuration files."""

from __future__ import annotations

from pathlib import Path

from pneuforce.errors import ConfigurationFileError
from pneuforce.instrument.cli.output import json_text, print_text
from pneuforce.instrument.config import Configuration
from pneuforce.instrument.service.certificate_checks import certificate_warnings
from pneuforce.instrument.service.file_checks import check_files
from pneuforce.instrument.service.instruments_on_one_host import check_instruments
from pneuforce.instrument.service.start_checks import load_checked


def check_config(paths: list[Path], as_json: bool, require_signed_by: Path | None = None) -> None:
    """Print that the files are valid, with their warnings. With several files, each is one instrument.

    Raises ConfigurationFileError for an invalid file, or for two instruments that use the same port or file.
    """
    configurations = {path: load_checked(path, require_signed_by) for path in paths}
    check_instruments(configurations)
    warnings = {path: _warning(configuration, path) for path, configuration in configurations.items()}
    if as_json:
        files = [
            {"file": str(path), "warning": warnings[path] or None, "signatures": _signatures(configuration)}
            for path, configuration in configurations.items()
        ]
        print_text(json_text({"ok": True, **(files[0] if len(files) == 1 else {"instruments": files})}))
        return
    for path, warning in warnings.items():
        print_text(f"{path}: good" + (f", but {warning}" if warning else ""))
        for name, signature in configurations[path].signatures._asdict().items():
            if signature.signer:
                print_text(f"the {name} file is {signature}")


def _signatures(configuration: Configuration) -> dict[str, str]:
    return {name: str(signature) for name, signature in configuration.signatures._asdict().items()}


def _warning(configuration: Configuration, path: Path) -> str:
    """Return the warnings about a configuration. Raises ConfigurationFileError if a file cannot be used."""
    problems, remarks = check_files(configuration, path)
    if problems:
        raise ConfigurationFileError(f"{path}: {'; '.join(problems)}")
    return "; ".join(
        [*filter(None, [configuration.warning]), *certificate_warnings(configuration, path), *remarks]
    )
