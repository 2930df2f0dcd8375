"""Whether a copy of a controller is independent of it."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from real_bench.controller_code.independence import shared_through

Load = Callable[[str, str], ModuleType]
HELD = "class Keeper:\n    held = None\n"


class Odd:
    """An object that says nothing of itself."""

    def __getattribute__(self, name: str) -> object:
        raise RuntimeError("nobody asks me")


@pytest.fixture
def load(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Load:
    def imported(name: str, code: str) -> ModuleType:
        file = tmp_path / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(code)
        spec = importlib.util.spec_from_file_location(file.stem, file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, file.stem, module)
        spec.loader.exec_module(module)
        return module

    return imported


def test_a_class_that_holds_the_controller_is_named(load: Load, tmp_path: Path) -> None:
    controller = object()
    load("mine/helper_of_mine.py", HELD).Keeper.held = [controller]
    assert shared_through(controller, tmp_path / "mine") == "Keeper.held"
    assert shared_through(object(), tmp_path / "mine") is None


@pytest.mark.parametrize("folder", ["venv/lib", ".hidden"])
def test_virtual_environments_and_hidden_folders_are_ignored(
    load: Load, tmp_path: Path, folder: str
) -> None:
    controller = object()
    load(f"mine/{folder}/another_library.py", HELD).Keeper.held = controller
    (tmp_path / "mine/venv").mkdir(exist_ok=True)
    (tmp_path / "mine/venv/pyvenv.cfg").touch()
    assert shared_through(controller, tmp_path / "mine") is None


def test_object_that_cannot_be_inspected_is_skipped(load: Load, tmp_path: Path) -> None:
    controller = object()
    module = load("mine/odd_of_mine.py", HELD)
    module.Keeper.held = [Odd(), controller]
    assert shared_through(controller, tmp_path / "mine") == "Keeper.held"
