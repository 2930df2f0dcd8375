"""Find a controller's class: by name, as ``module:Class``, or in a file."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
import traceback
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any

from real_bench.controller import BasePolicy, Controller
from real_bench.errors import ControllerError, RealBenchError
from real_bench.files import file_sha256

GROUP = "real_bench.controllers"


def find_controller(spec: str) -> type[Any]:
    """The class that ``spec`` names.

    ``spec`` is the name of an installed controller (``real_r``), ``package.module:Class``, or
    ``path/to/file.py`` with ``:Class`` where the file defines more than one controller.

    Raises:
        ControllerError: it does not exist or cannot be loaded, with file, line and reason.
    """
    _offer_official_import()
    target, _, class_name = spec.partition(":")
    if target.endswith(".py"):
        return _pick_class(_load_file(Path(target).resolve(), spec), class_name, spec)
    if class_name:
        return _pick_class(_load_module(target, spec), class_name, spec)
    return _load_named(spec)


def resolved(spec: str) -> str:
    """The same controller as seen from any folder: a file by its whole path."""
    target, _, class_name = spec.partition(":")
    if not target.endswith(".py"):
        return spec
    return f"{Path(target).resolve()}{':' if class_name else ''}{class_name}"


def controller_file(spec: str) -> Path | None:
    """The file that a controller is in, found without running it; None where that is not known.

    Known are files, and the modules of installed controllers.
    """
    target, _, _ = spec.partition(":")
    path = Path(target)
    if not target.endswith(".py"):
        modules = [offer.module for offer in entry_points(group=GROUP) if offer.name == spec]
        with suppress(ImportError):
            found = importlib.util.find_spec(modules[0]) if modules else None
            path = Path(found.origin or "") if found else path
    return path if path.is_file() else None


def code_beside(file: Path) -> Iterator[Path]:
    """Python files and packages beside a file; no links, which could lead anywhere."""
    for path in sorted(file.parent.iterdir()):
        if path.is_symlink() or path == file:
            continue
        if (path.suffix == ".py" and path.is_file()) or (path / "__init__.py").is_file():
            yield path


def is_defined_by(file: Path, sha256: str) -> bool:
    """Whether this file, or one beside it, has the hash of the file that defines a controller.

    Found without running any of it.
    """
    beside = (path for place in code_beside(file) for path in (place, *place.rglob("*.py")))
    return any(path.is_file() and file_sha256(path) == sha256 for path in (file, *beside))


def is_installed(spec: str) -> bool:
    """Whether it is the name of an installed controller: code that the user trusts already."""
    return any(offer.name == spec for offer in entry_points(group=GROUP))


def installed(name: str) -> EntryPoint:
    """Where an installed controller is; raises ControllerError where there is none of that name."""
    offers = {offer.name: offer for offer in entry_points(group=GROUP)}
    if name not in offers:
        raise ControllerError(
            f"unknown controller {name!r}: use one of {', '.join(sorted(offers)) or '(none)'}, "
            "module:Class, or path/to/file.py[:Class]"
        )
    return offers[name]


def source_file(controller: type[Any]) -> Path | None:
    """The file that defines a controller's class, where there is one."""
    try:
        return Path(inspect.getfile(controller))
    except (TypeError, OSError):
        return None


def source_sha256(controller: type[Any]) -> str:
    """The hash of the file that defines a controller's class; empty where there is none."""
    file = source_file(controller)
    return file_sha256(file) if file else ""


def is_action_level(controller: type[Any]) -> bool:
    """Whether a class decides on whole actions (else: one call a step)."""
    method = getattr(controller, "next_action", None)
    return method is not None and method is not Controller.next_action


def blame(error: BaseException, file: str | None = None) -> str:
    """What happened and where, in one line: the deepest place in ``file``, or anywhere."""
    if isinstance(error, SyntaxError):
        return f"{error.filename}, line {error.lineno}: {error.msg}"
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if frame.filename == file] or list(frames)
    place = f"{own[-1].filename}, line {own[-1].lineno}: " if own else ""
    text = " ".join(str(error).split())
    return f"{place}{type(error).__name__}{': ' if text else ''}{text}"


def says_enough(error: BaseException, file: str | None) -> bool:
    """Whether an error of ours needs no place: ``file`` raised it, or had nothing to do with it."""
    files = [frame.filename for frame in traceback.extract_tb(error.__traceback__)]
    return isinstance(error, RealBenchError) and (file not in files or files[-1] == file)


def _load_named(name: str) -> type[Any]:
    offer = installed(name)
    try:
        loaded = offer.load()
    except (Exception, SystemExit) as error:
        raise ControllerError(f"controller {name} cannot be loaded: {blame(error)}") from error
    return _checked(loaded, name)


def _load_module(name: str, spec: str) -> ModuleType:
    try:
        return importlib.import_module(name)
    except (Exception, SystemExit) as error:
        raise ControllerError(f"controller {spec} cannot be loaded: {blame(error)}") from error


@cache
def _load_file(path: Path, spec_given: str) -> ModuleType:
    """The module of a file, run once in a process however often it is asked for."""
    if not path.is_file():
        raise ControllerError(f"the controller file {spec_given.partition(':')[0]} does not exist")
    name = f"real_bench_user_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ControllerError(f"the controller file {path} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # so that its classes can be copied and its dataclasses resolved
    folder = str(path.parent.resolve())
    if folder not in sys.path:  # a file may import its neighbours
        sys.path.append(folder)
    try:
        spec.loader.exec_module(module)
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, KeyboardInterrupt):
            raise
        raise ControllerError(
            f"controller {spec_given} cannot be loaded: {blame(error, str(path))}"
        ) from error
    return module


def _pick_class(module: ModuleType, class_name: str, spec: str) -> type[Any]:
    if class_name:
        if not hasattr(module, class_name):
            raise ControllerError(f"controller {spec}: there is no class {class_name} in it")
        return _checked(getattr(module, class_name), spec)
    own = [
        value
        for value in vars(module).values()
        if inspect.isclass(value) and value.__module__ == module.__name__ and _plays(value)
    ]
    own = list(dict.fromkeys(own))  # a class may have two names
    if len(own) != 1:
        found = ", ".join(value.__name__ for value in own) or "none"
        raise ControllerError(
            f"controller {spec}: exactly one class with step() or next_action() was expected, "
            f"found {found}; name it as {spec}:Class"
        )
    return _checked(own[0], spec)


def _checked(loaded: Any, spec: str) -> type[Any]:
    if not inspect.isclass(loaded):
        raise ControllerError(f"controller {spec} is not a class")
    if not _plays(loaded):
        raise ControllerError(f"controller {spec} has neither step() nor next_action()")
    return loaded


def _plays(value: type[Any]) -> bool:
    step = getattr(value, "step", None)
    return is_action_level(value) or (callable(step) and step is not BasePolicy.step)


def _offer_official_import() -> None:
    """Let a controller say ``from real_robots.policy import BasePolicy``.

    The official package no longer imports, so its name is free for this one class.
    """
    if "real_robots" in sys.modules:
        return
    package, policy = ModuleType("real_robots"), ModuleType("real_robots.policy")
    policy.BasePolicy = BasePolicy  # type: ignore[attr-defined]
    package.policy = policy  # type: ignore[attr-defined]
    package.__path__ = []
    sys.modules |= {"real_robots": package, "real_robots.policy": policy}
