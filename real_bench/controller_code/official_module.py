"""What ``import real_robots`` gives: ours, for controllers of the official package."""

from __future__ import annotations

import importlib.util
import logging
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType

NAME = "real_robots"
OURS = Path(__file__).parents[1] / "compat" / NAME

log = logging.getLogger(__name__)


def install(*, replace: bool = False) -> ModuleType:
    """Let ``import real_robots`` give ours if the official package is not installed.

    Args:
        replace: give ours even if it is installed, for the rest of this process. A module that was
            imported before stays.

    Returns:
        what ``import real_robots`` gives now; a warning is logged if that is the official one.
    """
    if NAME in sys.modules:
        return _imported(sys.modules[NAME])
    elsewhere = _installed_elsewhere()
    if elsewhere and not replace:
        log.warning(
            "real_robots is installed in %s and is what you import: to use realbench's, call "
            "real_bench.compat.install(replace=True)",
            elsewhere,
        )
        return importlib.import_module(NAME)
    if elsewhere:
        log.warning("real_robots is realbench's in this process, not the one in %s", elsewhere)
    return _load(OURS)


def _imported(module: ModuleType) -> ModuleType:
    place = Path(module.__file__ or "").parent
    if place != OURS:
        log.warning("real_robots was already imported from %s, and stays in use", place)
    return module


def _installed_elsewhere() -> Path | None:
    """The folder of an official package that could be imported; None if there is none."""
    found: ModuleSpec | None = importlib.util.find_spec(NAME)
    return Path(found.origin).parent if found and found.origin else None


def _load(folder: Path) -> ModuleType:
    """Import our folder under the official name."""
    spec = importlib.util.spec_from_file_location(
        NAME, folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[NAME] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[NAME]
        raise
    return module
