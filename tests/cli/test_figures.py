"""`realbench figures` in real processes."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest
from PIL import Image

from real_bench.figures import FIGURES
from real_bench.goal_sets import save_goal_set
from real_bench.scoring.result import load_result
from real_bench.simulation import Scene
from tests.cli.shell import realbench, tiny_goals
from tests.figures.pusher import __file__ as PUSHER  # noqa: N812

PLAY = ("intrinsic", "--scene", "builtin", "--condition", "OM", "--images", "--steps", "4000")
TEST = (
    *("extrinsic", "--controller", "real_d"),
    *("--goals", "goals.npy", "--trials", "1", "--trial-steps", "2000"),
)
FAST = ("--set", "vae.steps=5")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory, builtin_scene: Scene) -> Path:
    """A recording with images, results after all and after half of it, and odd files."""
    folder = tmp_path_factory.mktemp("figures")
    save_goal_set(tiny_goals(builtin_scene), folder / "goals.npy")
    realbench(folder, *PLAY, "--controller", PUSHER)
    realbench(folder, *TEST, "--out", "all.json")
    realbench(folder, *TEST, "--run-steps", "2000", "--out", "half.json")
    change(folder / "all.json", folder / "others.json", goals_sha256="0" * 64)
    change(folder / "all.json", folder / "some.json", goal_numbers=(0, 1))
    (folder / "copy.json").write_bytes((folder / "all.json").read_bytes())
    (folder / "cut.h5").write_bytes((folder / "run.h5").read_bytes()[:5000])
    (folder / "note.json").write_text('{"a": "note"}')
    (folder / "note.txt").write_text("a note")
    (folder / "full").mkdir()
    (folder / "full" / "coverage.csv").write_text("mine")
    return folder


def change(path: Path, out: Path, **setting: object) -> None:
    """The same result with another setting."""
    result = load_result(path)
    changed = result.setting.model_copy(update=setting)
    result.model_copy(update={"setting": changed}).save(out)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_every_figure_is_drawn_reproducibly(place: Path) -> None:
    files = ("all.json", "run.h5", "half.json")
    done = realbench(place, "figures", *files, *FAST, "--out", "one")
    realbench(place, "figures", *files[::-1], *FAST, "--out", "sub/two", "--json")
    every = {f"{kind.name}.{suffix}" for kind in FIGURES for suffix in ("png", "svg", "csv")}
    assert names(place / "one") == every | {"figures.json"}
    for name in sorted(names(place / "one")):
        first, second = ((place / folder / name).read_bytes() for folder in ("one", "sub/two"))
        if name == "figures.json":
            one, two = json.loads(first), json.loads(second)
            assert [one.pop("results"), one] == [two.pop("results")[::-1], two]
        else:
            assert first == second, name
    for kind in FIGURES:
        with Image.open(place / "one" / f"{kind.name}.png") as picture:
            assert picture.width > 600
        ElementTree.parse(place / "one" / f"{kind.name}.svg")
        assert f"{kind.name}: one/{kind.name}.png, .svg, .csv" in done.stdout
    assert "VAE: epoch 5 of 5" in done.stderr


def test_figures_of_results_alone_report_what_others_need(place: Path) -> None:
    realbench(place, "figures", "all.json", "half.json", "--out", "scores")
    assert "score-by-length.png" in names(place / "scores")
    again = ("figures", "all.json", "./all.json", "--out", "scores", "--overwrite")
    done = realbench(place, *again)
    assert "score-by-length: not drawn, it needs results of one controller after" in done.stdout
    assert "coverage: not drawn, it needs a recording" in done.stdout
    made = {f"score-by-goal.{suffix}" for suffix in ("png", "svg", "csv")}
    assert names(place / "scores") == made | {"figures.json"}  # nothing old remains
    (place / "scores" / "logged.csv").write_text("of an export")
    realbench(place, "figures", "all.json", "--out", "scores", "--overwrite")
    assert (place / "scores" / "logged.csv").read_text() == "of an export"


def test_json_prints_summary_and_skips_incomplete_results(place: Path) -> None:
    done = realbench(place, "figures", "some.json", "all.json", "--out", "left", "--json")
    assert "some.json is in no figure: its test is not finished (1 of 2 trials)" in done.stderr
    told = json.loads(done.stdout)
    assert told == json.loads((place / "left" / "figures.json").read_text())
    assert list(told["drawn"]) == ["score-by-goal"]
    (result,) = told["results"]
    assert result["score"] == load_result(place / "all.json").score


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("run.h5", "--run-steps", "4001"), 1, "run.h5 has 4,000 steps, 4,001 were asked for"),
        (("run.h5", "--set", "vae.wait=1"), 1, "bad settings: vae.wait"),
        (("goals.npy",), 2, "goals.npy: recording or result expected, not goal set"),
        (("note.txt",), 2, "note.txt is none of: recording, goal set, result, experiment"),
        (("none.txt",), 2, "file not found: none.txt"),
        (("none.h5",), 1, "recording not found: none.h5"),
        (("cut.h5",), 1, "cut.h5 cannot be read"),
        (("note.json",), 1, "note.json is not a result of realbench"),
        (("all.json", "others.json"), 1, "results of different goals cannot be drawn together"),
        (("all.json", "copy.json"), 1, "all.json and copy.json are of the same test: give one"),
        (("all.json", "--out", "note.txt"), 1, "cannot write into note.txt"),
        (("all.json", "--out", "full"), 1, "full/coverage.csv exists: use --overwrite"),
    ],
)
def test_bad_input_gives_a_one_line_error(
    place: Path, arguments: tuple[str, ...], code: int, message: str
) -> None:
    out = () if "--out" in arguments else ("--out", "new")
    done = realbench(place, "figures", *arguments, *out, code=code)
    assert message in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert done.stdout == ""
    assert (place / "full" / "coverage.csv").read_text() == "mine"
