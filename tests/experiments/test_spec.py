from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from real_bench.errors import ExperimentError
from real_bench.experiments import Spec, read_spec
from real_bench.simulation.scene import manifest_path
from tests.experiments.conftest import WriteSpec

EVALUATION = Path(__file__).parents[2] / "evaluation"
RANDOM = {"controller": "real_r", "condition": "OM"}


def test_spec_is_read_as_written(spec: Spec, tmp_path: Path) -> None:
    assert [cell.name for cell in spec.cells] == ["real_r-OM-1", "real_d-OM-1", "real_r-IJ-1"]
    assert spec.results_folder == tmp_path / "results"
    assert list(spec.seeds(spec.cells[0])) == [0, 1]
    assert list(spec.seeds(spec.cells[2])) == [0]
    assert spec.goal_names(spec.cells[0]) == ("few",)
    assert spec.goal_file("few", 2) == tmp_path / "results" / "goals-few-2.npy"


def test_defaults_are_those_of_the_benchmark(write_spec: WriteSpec) -> None:
    path = write_spec()
    path.write_text("cells: [{controller: real_r, condition: IM}]")
    spec = read_spec(path)
    assert (spec.steps, spec.trial_steps, spec.scene) == (15_000_000, 10_000, "official")
    assert (spec.title, spec.results.name) == ("tiny", "tiny")
    assert spec.goal_file("shipped", 1).name == "goals-1-object.npy"
    assert spec.play_of(spec.cells[0]) is not None


def test_cells_with_their_own_play_use_their_own_settings(write_spec: WriteSpec) -> None:
    cell = {"controller": "real_t", "condition": "OM", "settings": {"thresholds": [0.1, 0.1]}}
    spec = read_spec(write_spec(cells=[cell]))
    found = spec.play_of(spec.cells[0])
    assert found is not None
    assert found[0] == "real_t-OM-1"
    assert found[1].settings == {"thresholds": [0.1, 0.1]}


def test_paths_are_relative_to_the_spec(write_spec: WriteSpec, tmp_path: Path) -> None:
    cell = {"controller": "my/mine.py:Mine", "condition": "OM"}
    spec = read_spec(write_spec(cells=[cell], scene="rooms/scene.yaml", goals={"g": "g.npy"}))
    assert spec.controller("my/mine.py:Mine") == f"{tmp_path}/my/mine.py:Mine"
    assert spec.controller("real_r") == "real_r"
    assert spec.scene_source == f"{tmp_path}/rooms/scene.yaml"
    assert spec.goal_file("g", 1) == tmp_path / "g.npy"
    assert spec.cells[0].name == "mine-Mine-OM-1"


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"cells": []}, "cells: .*at least 1"),
        ({"cells": [RANDOM, RANDOM]}, "two cells are named real_r-OM-1"),
        ({"cells": [{**RANDOM, "play": "other"}]}, "learns from 'other': use own, none, random"),
        ({"cells": [{**RANDOM, "play": "radnom"}]}, r"random, did you mean random\?"),
        ({"cells": [{**RANDOM, "goals": ["b"]}]}, "unknown goals b"),
        ({"cells": [{**RANDOM, "condition": "XM"}]}, "unknown condition 'XM'"),
        ({"cells": [{**RANDOM, "objects": 0}]}, "objects"),
        ({"cells": [{**RANDOM, "name": "../x"}]}, "cells.0.name: a name has no spaces: letters"),
        ({"cells": [{**RANDOM, "name": "as it is"}]}, "cells.0.name: a name has no spaces"),
        ({"cells": [{**RANDOM, "name": "one\ntwo"}]}, "cells.0.name: a name has no spaces"),
        (
            {"cells": [{**RANDOM, "publishd": 1}]},
            r"cells\.0\.publishd: unknown name, did you mean published\? \(use: "
            "controller, condition, settings, objects, name, play, goals, repeats, published, note",
        ),
        (
            {"cells": [{**RANDOM, "published": {"mean": 0.1, "standard_eror": 0.1}}]},
            r"did you mean standard_error\? \(use: mean, standard_error, repeats\)",
        ),
        ({"plays": {"a": {**RANDOM, "image": True}}}, "plays.a.image: .*did you mean images"),
        ({"goals": {"few": {"sed": 5}}}, r"use: seed, counts\)"),
        ({"step": 5}, "step: unknown name, did you mean steps"),
        ({"folder_": "x"}, r"use: title, results, run, scene"),
        (
            {"cells": [{**RANDOM, "condition": "IJ", "play": "random"}]},
            "played in OM: it needs a play in IJ",
        ),
        (
            {
                "plays": {"blind": {**RANDOM, "condition": "IM"}},
                "cells": [{**RANDOM, "play": "blind"}],
            },
            "played in IM without seeing positions: it needs a play in OM",
        ),
        ({"cells": [{"condition": "OM"}]}, "controller"),
        ({"cells": ["real_r"]}, "cells"),
        ({"steps": 0}, "steps"),
        ({"repeats": 0}, "repeats"),
        ({"trial_steps": 100_001}, "trial_steps: .*less than or equal to 100000"),
        ({"seed": 2**63 - 2, "repeats": 3}, "real_r-OM-1 has seeds of 2\\*\\*63 or more"),
        ({"goals": {}}, "goals: .*at least 1"),
        ({"plays": {"own": RANDOM}}, "a play cannot be named 'own'"),
        ({"plays": {"none": RANDOM}}, "a play cannot be named 'none'"),
        ({"cells": [{**RANDOM, "goals": ["few", "few"]}]}, "real_r-OM-1 names goals few twice"),
        ({"goals": {"few": {"seed": 5, "counts": {"4D": 2}}}}, "counts"),
        (
            {
                "plays": {"real_r-OM": RANDOM},
                "cells": [RANDOM, {**RANDOM, "name": "b", "play": "real_r-OM"}],
            },
            "share a name",
        ),
    ],
)
def test_bad_spec_is_refused(write_spec: WriteSpec, changes: dict[str, Any], told: str) -> None:
    with pytest.raises(ExperimentError, match=told):
        read_spec(write_spec(**changes))


def test_missing_and_malformed_specs_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ExperimentError, match="not found"):
        read_spec(tmp_path / "no.yaml")
    (tmp_path / "bad.yaml").write_text("a: [1")
    with pytest.raises(ExperimentError, match=r"bad\.yaml"):
        read_spec(tmp_path / "bad.yaml")


@pytest.mark.parametrize("name", ["paper", "smoke"])
def test_shipped_specs_have_every_cell_of_the_paper(name: str) -> None:
    spec = read_spec(EVALUATION / f"{name}.yaml")
    published = {
        (cell.controller, cell.condition, cell.objects): cell.published.mean
        for cell in spec.cells
        if cell.published and cell.published.standard_error
    }
    paper = {
        ("real_r", "OM", 1): 0.021,
        ("real_r", "IJ", 1): 0.038,
        ("real_t", "OM", 1): 0.212,
        ("real_d", "OM", 1): 0.216,
        ("real_ld", "IM", 1): 0.222,
        ("real_ld", "IJ", 1): 0.139,
        ("real_ild", "IM", 1): 0.234,
    }
    if name == "paper":
        paper |= {("real_r", "IM", 1): 0.021, ("real_ild", "IJ", 1): 0.149}
        assert spec.repeats == 30
        assert not spec.run
    assert published == paper


@pytest.mark.parametrize("named", ["agent:v3/mine.py", "agent:v3/mine.py:Mine", "mine.py:Mine"])
def test_controller_folder_may_contain_a_colon(spec: Spec, named: str) -> None:
    assert spec.controller(named) == f"{spec.folder}/{named}"


@pytest.mark.parametrize("named", ["real_d", "package.module:Class"])
def test_controller_named_without_a_path_is_kept_as_named(spec: Spec, named: str) -> None:
    assert spec.controller(named) == named


@pytest.mark.parametrize("form", ["mine.yaml", "mine.yml", "mine"])
def test_a_scene_beside_the_file_is_found_in_every_form(
    write_spec: WriteSpec, tmp_path: Path, form: str
) -> None:
    file = tmp_path / form if "." in form else tmp_path / form / "scene.yaml"
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(manifest_path("builtin").read_bytes())
    spec = read_spec(write_spec(scene=form))
    assert manifest_path(spec.scene_source) == file


def test_a_scene_that_ships_is_no_folder_beside_the_file(
    write_spec: WriteSpec, tmp_path: Path
) -> None:
    (tmp_path / "builtin").mkdir()
    assert read_spec(write_spec(scene="builtin")).scene_source == "builtin"
