"""Every way to write a value, wherever YAML is read: as people read it, and each name once."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from real_bench.errors import ControllerError, ExperimentError, RealBenchError, SceneError
from real_bench.experiments import read_spec
from real_bench.inputs.yaml_files import read_mapping
from real_bench.settings import read_settings
from real_bench.simulation.scene import load_scene, read_manifest

VALUES: dict[str, Any] = {
    "50": 50,
    "'50'": "50",
    '"50"': "50",
    "'2e-2'": "2e-2",
    "2e-2": 0.02,
    "2E+2": 200.0,
    "1.": 1.0,
    ".5": 0.5,
    "-.5": -0.5,
    "+5": 5,
    "010": 10,
    "-010": -10,
    "0o10": 8,
    "0x1F": 31,
    "0b11": "0b11",
    "1_000": "1_000",
    "12:30:00": "12:30:00",
    "1:30": "1:30",
    "2026-01-01": "2026-01-01",
    "2026-13-45": "2026-13-45",
    "2026-01-01T12:00:00Z": "2026-01-01T12:00:00Z",
    "null": None,
    "~": None,
    "": None,
    "'null'": "null",
    "nil": "nil",
    "true": True,
    "False": False,
    "yes": "yes",
    "no": "no",
    "on": "on",
    "=": "=",
    "<<": "<<",
    ".inf": math.inf,
    "[1, 2e-2, 010, no]": [1, 0.02, 10, "no"],
    "{a: 010, b: 1e3}": {"a": 10, "b": 1000.0},
    "!!str 010": "010",
    "!!int '010'": 10,
    "!!float 1": 1.0,
}
REFUSED = {
    "{a: 1, a: 2}": "a is given twice",
    "{a: {b: 1, b: 1}}": "b is given twice",
    "{1: a, 1.0: b}": "1.0 is given twice",
    "{a: 1, 'a': 2}": "a is given twice",
    "{[a]: 1}": "a name is not text",
    "*x": "aliases",
    "!!timestamp 2026-01-01": "could not determine a constructor",
    "!!binary aGk=": "could not determine a constructor",
    "!!python/object:os.system x": "could not determine a constructor",
    "!!int four": "four",
    "[1, 2": "expected ',' or ']'",
}

Read = Callable[[Path, str], Any]


def from_file(folder: Path, text: str) -> Any:
    (folder / "s.yaml").write_text(f"other: 1\nvalue: {text}\n", encoding="utf-8")
    return read_settings(folder / "s.yaml", ())["value"]


def from_line(folder: Path, text: str) -> Any:
    return read_settings(None, [f"a.value={text}"])["a"]["value"]


def from_experiment(folder: Path, text: str) -> Any:
    cell = "controller: real_t\n  condition: OM\n  settings:"
    (folder / "e.yaml").write_text(f"cells:\n- {cell}\n    value: {text}\n", encoding="utf-8")
    return read_spec(folder / "e.yaml").cells[0].settings["value"]


def from_scene(folder: Path, text: str) -> Any:
    (folder / "scene.yaml").write_text(f"name: x\nvalue: {text}\n", encoding="utf-8")
    return read_mapping(folder / "scene.yaml", "the scene", SceneError)["value"]


PLACES: dict[str, Read] = {
    "settings": from_file,
    "--set": from_line,
    "experiment": from_experiment,
    "scene": from_scene,
}


@pytest.mark.parametrize("text", VALUES)
@pytest.mark.parametrize("place", PLACES)
def test_value_has_the_expected_type(tmp_path: Path, place: str, text: str) -> None:
    found = PLACES[place](tmp_path, text)
    assert (type(found), found) == (type(VALUES[text]), VALUES[text])


@pytest.mark.parametrize("text", REFUSED)
@pytest.mark.parametrize("place", PLACES)
def test_bad_value_is_refused_in_one_line(tmp_path: Path, place: str, text: str) -> None:
    with pytest.raises((ControllerError, ExperimentError, SceneError)) as caught:
        PLACES[place](tmp_path, text)
    told = str(caught.value)
    assert REFUSED[text] in told
    assert told.isprintable()  # one line


TWICE = "seed: 3\nsteps: 1\nseed: 5\n"


@pytest.mark.parametrize(
    "read",
    [
        lambda path: read_settings(path, ()),
        read_spec,
        read_manifest,
        lambda path: load_scene(path),
    ],
    ids=["settings", "experiment", "manifest", "scene"],
)
def test_duplicate_name_is_refused_with_its_line(
    tmp_path: Path, read: Callable[[Path], Any]
) -> None:
    path = tmp_path / "x.yaml"
    path.write_text(TWICE)
    with pytest.raises(RealBenchError, match="seed is given twice, the second time in line 3"):
        read(path)


def test_byte_order_mark_is_ignored(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + json.dumps({"a": 1}).encode())
    assert read_settings(path, ()) == {"a": 1}
