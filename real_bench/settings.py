"""A controller's settings: from a file and the command line to a validated record."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from real_bench.errors import ControllerError, SubmissionError, faults
from real_bench.inputs.records import Record
from real_bench.inputs.yaml_files import parse, read_mapping
from real_bench.text.nearest import did_you_mean
from real_bench.text.quoting import one_line

Values = dict[str, Any]


class Settings(Record):
    """Base of a controller's settings: frozen, refuses unknown names."""


def settings_class(controller: type[Any]) -> type[Settings] | None:
    """The class of a controller's settings, its attribute ``Settings``, if it has any."""
    found = getattr(controller, "Settings", None)
    if found is None:
        return None
    if not (isinstance(found, type) and issubclass(found, Settings)):
        from real_bench.controller import Controller

        if not issubclass(controller, Controller):  # the name means something else there
            return None
        raise ControllerError(
            f"{controller.__name__}.Settings must derive from real_bench.settings.Settings"
        )
    return found


def check_settings(controller: type[Any], spec: str, values: Mapping[str, Any]) -> Settings | None:
    """The settings of a controller, with defaults for the rest; None if it has none.

    Raises:
        ControllerError: with everything that is wrong, and what can be set.
    """
    kind = settings_class(controller)
    if kind is None:
        if values:
            raise ControllerError(
                f"controller {spec} has no settings, got {', '.join(map(str, values))}"
            )
        return None
    return validated(kind, values, f"controller {spec}")


def validated(kind: type[Settings], values: Mapping[str, Any], owner: str) -> Settings:
    """Settings of a class, with defaults for the rest.

    Raises:
        ControllerError: with everything that is wrong, and what can be set.
    """
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        known = dict(_default_values(kind))
        parts = {name.rpartition(".")[0] for name in known} - {""}

        def unknown(place: tuple[int | str, ...]) -> str:
            return did_you_mean(".".join(map(str, place)), [*sorted(parts), *known])

        listed = ", ".join(f"{name}={value}" for name, value in known.items())
        raise ControllerError(
            f"{owner}, bad settings: {faults(error, unknown=unknown)} "
            f"(settings and defaults: {listed})"
        ) from error
    except Exception as error:  # a validator of its own, or a type that its file does not import
        raise _class_error(owner, error) from error


def _class_error(owner: str, error: Exception) -> SubmissionError:
    return SubmissionError(
        f"{owner}: its class of settings fails: {type(error).__name__}: {one_line(error)}"
    )


def settings_in_full(controller: type[Any], spec: str, values: Mapping[str, Any]) -> Values:
    """The settings of a controller as plain values, defaults included, for storage in files.

    Raises:
        ControllerError: they are wrong, or would not be the same when read again.
    """
    settings = check_settings(controller, spec, values)
    if settings is None:
        return {}
    try:
        kept: Values = json.loads(json.dumps(settings.model_dump(mode="json"), allow_nan=False))
        again = type(settings).model_validate(kept)
    except ValidationError as error:
        reason = faults(error)
    except (ValueError, TypeError) as error:  # what JSON cannot hold
        reason = one_line(error)
    except Exception as error:
        raise _class_error(f"controller {spec}", error) from error
    else:
        if again == settings:
            return kept
        changed = [
            name
            for name in type(settings).model_fields
            if getattr(again, name) != getattr(settings, name)
        ]
        reason = f"{', '.join(changed)} would change"
    raise ControllerError(
        f"controller {spec}: its settings do not survive being written and read: {reason} "
        "(use fields without alias and exclude, and no computed fields)"
    )


def as_validated(full: Mapping[str, Any], wanted: Mapping[str, Any]) -> Values:
    """Those of the full settings that were asked for, as the controller has them."""
    found: Values = {}
    for name, value in wanted.items():
        kept = full.get(name, value)
        both = isinstance(kept, Mapping) and isinstance(value, Mapping)
        found[name] = as_validated(kept, value) if both else kept
    return found


def read_settings(file: Path | None, assignments: Iterable[str]) -> Values:
    """The values in a YAML file, overridden by ``dotted.name=value`` assignments."""
    values = {} if file is None else read_mapping(file, "the settings file", ControllerError)
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        if not equals or not all(name.split(".")):
            raise ControllerError(f"--set needs name=value, e.g. planner.depth=8, not {assignment}")
        values = merged(
            values, _nested(name.split("."), parse(text, f"--set {name}", ControllerError))
        )
    return values


def merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> Values:
    """Two trees of values merged; the second one wins."""
    both = dict(below)
    for key, value in above.items():
        old = both.get(key)
        if isinstance(old, Mapping) and isinstance(value, Mapping):
            both[key] = merged(old, value)
        else:
            both[key] = value
    return both


def dotted(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """A tree of values as dotted names, as for ``--set``, and their values."""
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from dotted(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _nested(names: list[str], value: Any) -> Values:
    return {names[0]: _nested(names[1:], value) if names[1:] else value}


def _default_values(kind: type[Settings], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every name that can be set, dotted, with its default."""
    for name, field in kind.model_fields.items():
        default = "(required)" if field.is_required() else _default(field)
        if isinstance(default, Settings):
            yield from _default_values(type(default), f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", default


def _default(field: FieldInfo) -> Any:
    try:
        return field.get_default(call_default_factory=True)
    except Exception:  # a factory that is made for other values, or is a stranger's
        return "(computed)"
