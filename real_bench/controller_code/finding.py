"""Load a controller's class: by name, as ``module:Class``, or from a file."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

from real_bench.controller import BasePolicy, Controller
from real_bench.controller_code import official_module
from real_bench.controller_code.blame import blame
from real_bench.controller_code.source import ControllerSource, installed, is_ignored
from real_bench.errors import ControllerError, SubmissionError
from real_bench.text.nearest import did_you_mean

SUBMITTED = "SubmittedPolicy"
"""The official name for the class that a file submits."""

ALIKE, ALIKE_METHODS = 0.9, 0.85
"""How alike two names are, from 0 to 1, if one may be a slip of the other; a constant may well be
called ``steps``, a method ``seeds`` is hardly meant."""

LOADED_AS = "real_bench_user_"
"""Prefix of the module names of controller files."""

NEVER_SHADOWED = frozenset({"real_bench", "real_robots"})


def find_controller(spec: str) -> type[Any]:
    """The class that ``spec`` names.

    ``spec`` is the name of an installed controller (``real_r``), ``package.module:Class``, or
    ``path/to/file.py``, with ``:Class`` if the file neither has ``SubmittedPolicy = ...`` nor
    defines exactly one class derived from ours.

    Raises:
        ControllerError: it does not exist or cannot be loaded, with file, line and reason.
    """
    official_module.install(replace=True)  # even if the official one is installed
    source = ControllerSource.of(spec)
    if source.file is not None:
        module = _load_submitted(source.file, source.place, spec)
    elif source.spec.endswith(f":{source.class_name}"):
        module = _load_module(source)
    else:
        return _load_installed(source)
    named = (
        getattr(module, source.class_name, None)
        if source.class_name
        else _choose_class(module, spec)
    )
    if named is None:
        classes = [name for name, value in vars(module).items() if inspect.isclass(value)]
        hint = did_you_mean(source.class_name, classes)
        raise SubmissionError(f"controller {spec}: class not found: {source.class_name}{hint}")
    return _check_class(named, spec)


def controller_folders() -> set[str]:
    """The folders of the controller files that this process has loaded; it imports from them."""
    files = {name: getattr(module, "__file__", None) for name, module in sys.modules.items()}
    return {
        str(Path(file).parent)
        for name, file in files.items()
        if file and name.startswith(LOADED_AS)
    }


def source_file(controller: type[Any]) -> Path | None:
    """The file that defines a controller's class, if there is one."""
    try:
        return Path(inspect.getfile(controller))
    except (TypeError, OSError):
        return None


def uses_extended_api(controller: type[Any]) -> bool:
    """Whether a class has our hooks besides the official ones: it is derived from Controller.

    Other classes may have a method of the same name that means something else.
    """
    return issubclass(controller, Controller)


def is_action_level(controller: type[Any]) -> bool:
    """Whether a class decides on whole actions (otherwise: one call per step)."""
    return uses_extended_api(controller) and controller.next_action is not Controller.next_action


def overrides_hook(controller: type[Any], hook: str) -> bool:
    """Whether a class defines one of our hooks itself."""
    return uses_extended_api(controller) and getattr(controller, hook) is not getattr(
        Controller, hook
    )


def misspelt_hooks(controller: type[Any]) -> Iterator[tuple[str, str]]:
    """Names that a class defines, each with the hook or attribute of ours that may be meant."""
    base = Controller if uses_extended_api(controller) else BasePolicy
    known = [name for name in dir(base) if not name.startswith("_")]
    own = [kind for kind in controller.__mro__ if kind is not object and kind not in base.__mro__]
    for name, value in {name: value for kind in own for name, value in vars(kind).items()}.items():
        if not name.startswith("_") and name not in known:
            likeness = ALIKE_METHODS if callable(value) else ALIKE
            for meant in get_close_matches(name, known, 1, likeness):
                yield name, meant


def _load_installed(source: ControllerSource) -> type[Any]:
    try:
        loaded = installed(source.spec).load()
    except (Exception, SystemExit) as error:
        raise _load_error(source, error) from error
    return _check_class(loaded, source.spec)


def _load_module(source: ControllerSource) -> ModuleType:
    try:
        return importlib.import_module(source.module)
    except (Exception, SystemExit) as error:
        raise _load_error(source, error) from error


def _load_error(source: ControllerSource, error: BaseException) -> ControllerError:
    hint = ""
    if isinstance(error, ModuleNotFoundError) and error.name and Path(error.name).is_dir():
        hint = f" (the folder {error.name} is here: set PYTHONPATH=. to import from it)"
    return SubmissionError(f"controller {source.spec} cannot be loaded: {blame(error)}{hint}")


def _load_submitted(path: Path, folder: Path, spec: str) -> ModuleType:
    try:
        return _load_file(path, folder)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        told = blame(error, folder)
        if "attempted relative import" in str(error):
            told += (
                " (a file is loaded by itself: name the module, e.g. "
                f"PYTHONPATH={folder.parent} and {folder.name}.{path.stem}:Class, "
                "or import without the dot)"
            )
        raise SubmissionError(f"controller {spec} cannot be loaded: {told}") from error


@cache
def _load_file(path: Path, folder: Path) -> ModuleType:
    """The module of a file, run only once per process."""
    name = f"{LOADED_AS}{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(f"{path} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # so that its classes can be copied and its dataclasses resolved
    if str(folder) not in sys.path:  # first, as for a script: its neighbours are meant
        sys.path.insert(0, str(folder))
    try:
        with _hide_namesakes(folder):
            spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


@contextmanager
def _hide_namesakes(folder: Path) -> Iterator[None]:
    """Let imports find what is in a folder, even if another module of that name is loaded.

    Whoever loaded the other module keeps it.
    """
    neighbours = {
        path.stem for path in folder.iterdir() if not is_ignored(path) and _is_module(path)
    }
    shadowing = {
        name: module
        for name, module in sys.modules.items()
        if name.partition(".")[0] in neighbours - NEVER_SHADOWED
        and not _is_module_in(module, folder)
    }
    for name in shadowing:
        del sys.modules[name]
    try:
        yield
    finally:
        sys.modules.update(shadowing)


def _is_module(path: Path) -> bool:
    return path.suffix == ".py" if path.is_file() else any(path.glob("*.py"))


def _is_module_in(module: Any, folder: Path) -> bool:
    file = getattr(module, "__file__", None)
    return isinstance(file, str) and Path(file).is_relative_to(folder)


def _choose_class(module: ModuleType, spec: str) -> Any:
    """The class that a file submits: ``SubmittedPolicy``, or its one class derived from ours."""
    if hasattr(module, SUBMITTED):
        return getattr(module, SUBMITTED)
    own = list(dict.fromkeys(_classes(module, BasePolicy)))  # a class may have two names
    if len(own) == 1:
        return own[0]
    found = ", ".join(value.__name__ for value in own) or "none"
    others = [value.__name__ for value in _classes(module, object) if _is_controller_like(value)]
    which = f" ({', '.join(others)} could be meant)" if others and not own else ""
    raise SubmissionError(
        f"controller {spec}: exactly one class derived from Controller or BasePolicy was expected, "
        f"found {found}{which}; name it as {spec}:Class, or set {SUBMITTED} = Class in the file"
    )


def _classes(module: ModuleType, base: type[Any]) -> Iterator[type[Any]]:
    for value in vars(module).values():
        is_own = inspect.isclass(value) and value.__module__ == module.__name__
        if is_own and issubclass(value, base):
            yield value


def _check_class(loaded: Any, spec: str) -> type[Any]:
    if not inspect.isclass(loaded):
        raise SubmissionError(f"controller {spec} is not a class")
    if not _is_controller_like(loaded):
        slips = "".join(
            f"; {name}: did you mean {meant}?" for name, meant in misspelt_hooks(loaded)
        )
        raise SubmissionError(f"controller {spec} has neither step() nor next_action(){slips}")
    return loaded


def _is_controller_like(value: type[Any]) -> bool:
    step = getattr(value, "step", None)
    return is_action_level(value) or (callable(step) and step is not BasePolicy.step)
