"""The options file of an official starter kit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from real_bench.compat.names import ACTION_TYPES, LEVELS
from real_bench.errors import RealBenchError
from real_bench.inputs.yaml_files import read_mapping

NAMES = ("options.yml", "options.yaml")


@dataclass(frozen=True)
class OfficialOptions:
    """What a starter kit's options file says that matters here; None where it says nothing.

    Attributes:
        condition: by environment and action type.
        objects, steps, trials: how many.
        goals: the official goal file.
    """

    condition: str | None = None
    objects: int | None = None
    steps: int | None = None
    trials: int | None = None
    goals: str | None = None


def official_options(folder: Path) -> OfficialOptions:
    """What the options file in a controller's folder says; raises RealBenchError for a bad one."""
    for name in NAMES:
        if (folder / name).is_file():
            values = dict(_flatten(read_mapping(folder / name, "the options file", RealBenchError)))
            return _parse_options(values)
    return OfficialOptions()


def _flatten(values: Mapping[Any, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flatten(value)
        else:
            yield str(name), value


def _parse_options(values: Mapping[str, Any]) -> OfficialOptions:
    perception = LEVELS.get(str(values.get("environment")))
    control = ACTION_TYPES.get(str(values.get("action_type")))
    condition = perception + control if perception and control else None
    return OfficialOptions(
        condition=condition,
        objects=_number(values.get("n_objects")),
        steps=_number(values.get("intrinsic_timesteps")),
        trials=_number(values.get("extrinsic_trials")),
        goals=_text(values.get("goals_dataset_path")),
    )


def _number(value: Any) -> int | None:
    try:
        return int(float(value)) if value is not None and float(value) >= 1 else None
    except (TypeError, ValueError, OverflowError):
        return None


def _text(value: Any) -> str | None:
    return value if isinstance(value, str) else None
