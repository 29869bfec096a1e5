"""Table of the files that the enabled parts of a configuration read or write."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from pneuforce.instrument.config import Configuration, resolve_path
from pneuforce.support.toml_sections import Section

#: Key of the configuration file itself in the table.
CONFIGURATION_FILE = "the configuration file"


class ConfiguredFile(NamedTuple):
    """File or folder of an instrument. `key` is the configuration key that names it."""

    key: str
    path: Path
    is_written: bool  #: False if the instrument only reads the file


def configured_files(configuration: Configuration, path: Path) -> Iterator[ConfiguredFile]:
    """Yield each file that the instrument uses, the configuration file first.

    `path` is the configuration file, to which the names of files are relative.
    """
    yield ConfiguredFile(CONFIGURATION_FILE, path, False)
    for name, section, read, written in _sections(configuration):
        for key in (*read, *written):
            file = resolve_path(path, getattr(section, key))
            if file is not None:
                yield ConfiguredFile(f"{name}.{key}", file, key in written)


def _sections(
    configuration: Configuration,
) -> Iterator[tuple[str, Section, tuple[str, ...], tuple[str, ...]]]:
    """Yield each section that uses files: its name, and the keys of the files that are read and written."""
    security, can = configuration.modbus_security, configuration.can
    web, mqtt = configuration.web, configuration.mqtt
    yield "measurement", configuration.measurement, ("calibration",), ()
    yield "events", configuration.events, (), ("file",)
    yield "local", configuration.local, (), ("socket",)
    if security.enabled:
        yield "modbus_security", security, ("ca", "certificate", "key", "crl"), ()
    if can.enabled and can.mode == "canopen":
        yield "can", can, (), ("parameter_file",)
    if mqtt.enabled:
        yield "mqtt", mqtt, ("ca", "certificate", "key", "password_file"), ("store",)
    if web.enabled:
        yield "web", web, ("certificate", "key", "users_file"), ("recordings",)
