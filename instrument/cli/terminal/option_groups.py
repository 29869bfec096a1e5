"""Groups of options: several commands share the options that one NamedTuple declares."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator
from functools import wraps
from typing import Any, get_type_hints

from pneuforce.errors import ConfigurationError


def expand_options(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command for typer in which options replace each parameter that is a group of options.

    A group is a NamedTuple whose fields are annotated with `typer.Option`.
    """
    hints = get_type_hints(command, include_extras=True)
    groups = {name: hint for name, hint in hints.items() if hasattr(hint, "_fields")}

    @wraps(command)
    def with_options(**values: Any) -> None:
        made = {
            name: group(**{field: values.pop(field) for field in group._fields})
            for name, group in groups.items()
        }
        command(**made, **values)

    parameters: list[inspect.Parameter] = []
    for each in inspect.signature(command).parameters.values():
        hint = hints[each.name]
        if each.name in groups:
            parameters += _parameters(hint)
        else:
            parameters.append(each.replace(annotation=hint, kind=inspect.Parameter.KEYWORD_ONLY))
    with_options.__annotations__ = {each.name: each.annotation for each in parameters}
    with_options.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return with_options


def _parameters(group: Any) -> Iterator[inspect.Parameter]:
    """Yield one parameter for each field of the group."""
    for name, hint in get_type_hints(group, include_extras=True).items():
        default = group._field_defaults.get(name, inspect.Parameter.empty)
        yield inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def given_options(group: Any) -> list[str]:
    """Return the options of a group that the user gave. An option with its default value is not given."""
    defaults = group._field_defaults
    return [
        f"--{name.replace('_', '-')}" for name, value in group._asdict().items() if value != defaults[name]
    ]


def reject_options(options: Iterable[str], when: str) -> None:
    """Raise ConfigurationError if there are options. `when` states in which case they can be used."""
    given = ", ".join(options)
    if given:
        raise ConfigurationError(f"{given} can be used only {when}")
