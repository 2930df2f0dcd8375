"""Whether copies of a controller are independent, as far as that can be checked."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Iterator
from itertools import takewhile
from pathlib import Path
from types import ModuleType
from typing import Any

from real_bench.controller_code.source import is_ignored

MAX_DEPTH = 6
"""How deep inside a shared place to look for the controller."""


def shared_through(controller: object, place: Path | None) -> str | None:
    """The name in a controller's code that leads to the controller itself; None: there is none.

    All copies share a class attribute or global that holds the controller, so each trial would
    see what earlier ones left.

    Args:
        controller: the controller.
        place: the folder or file of its code.
    """
    if place is None:
        return None
    for module in _modules_in(place):
        for name, value in _shared_values(module):
            if _leads_to(value, controller, MAX_DEPTH, set()):
                return name
    return None


def _modules_in(place: Path) -> list[ModuleType]:
    files = ((module, getattr(module, "__file__", None)) for module in list(sys.modules.values()))
    return [module for module, file in files if isinstance(file, str) and _is_in(Path(file), place)]


def _is_in(file: Path, place: Path) -> bool:
    """Whether a file is code in a place; a virtual environment below it holds other people's."""
    if not file.is_relative_to(place):
        return False
    folders = takewhile(lambda folder: folder != place, file.parents)
    return file == place or not any(map(is_ignored, folders))


def _shared_values(module: ModuleType) -> Iterator[tuple[str, Any]]:
    """The globals of a module and the attributes of its classes, by name."""
    for name, value in list(vars(module).items()):
        if inspect.isclass(value):
            if value.__module__ == module.__name__:
                for attribute, held in list(vars(value).items()):
                    yield f"{name}.{attribute}", held
        elif not name.startswith("__"):
            yield name, value


def _leads_to(value: Any, target: object, depth: int, seen: set[int]) -> bool:
    if value is target:
        return True
    if depth == 0 or id(value) in seen:
        return False
    seen.add(id(value))
    return any(_leads_to(part, target, depth - 1, seen) for part in _members(value))


def _members(value: Any) -> list[Any]:
    """What an object holds; nothing where it cannot be looked into."""
    try:
        if isinstance(value, dict):
            return list(value.values())
        if isinstance(value, list | tuple | set | frozenset):
            return list(value)
        if inspect.ismodule(value) or inspect.isclass(value) or inspect.isroutine(value):
            return []
        return list(vars(value).values())
    except Exception:  # whatever a stranger's object makes of being asked
        return []
