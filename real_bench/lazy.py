"""Packages that load a module on first use of one of its names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(
    package: str, modules: Mapping[str, tuple[str, ...]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """A ``__getattr__`` and a ``__dir__`` for a package.

    Args:
        package: its name.
        modules: for each of its modules, the names in it that the package offers; a module's own
            name offers the module.
    """
    places = {name: f"{package}.{module}" for module, names in modules.items() for name in names}

    def find(name: str) -> Any:
        if name not in places:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module = import_module(places[name])
        return module if module.__name__ == f"{package}.{name}" else getattr(module, name)

    def all_names() -> list[str]:
        return sorted({*vars(import_module(package)), *places})

    return find, all_names
