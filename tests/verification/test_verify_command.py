"""The real command in a real process."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import h5py
import pytest

from real_bench.simulation import Scene
from tests.cli.shell import realbench
from tests.verification.conftest import play

EVALUATION = Path(__file__).parents[2] / "evaluation"


@pytest.fixture(scope="module")
def place(
    honest: Path, goals_path: Path, builtin_scene: Scene, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A folder with a result of two goals, an altered one, and a recording."""
    folder = tmp_path_factory.mktemp("place")
    shutil.copy(goals_path, folder / "goals.npy")
    shutil.copy(honest, folder / "score.json")
    content = json.loads(honest.read_text())
    content["trials"][1]["final_poses"][0][2] += 0.125
    (folder / "altered.json").write_text(json.dumps(content))
    play(builtin_scene, folder / "run.h5", 2000)
    return folder


def test_an_honest_result_verifies(place: Path) -> None:
    printed = realbench(place, "verify", "score.json", "--goals", "goals.npy").stdout.splitlines()
    assert [line.split() for line in printed[:2]] == [
        ["goal", "0", "2D", "ok"],
        ["goal", "1", "2D", "ok"],
    ]
    assert printed[-1].startswith("verified: 2 of 2 trials replay bit for bit, score 0.")


def test_altered_result_does_not_verify(place: Path) -> None:
    arguments = ("altered.json", "--goals", "goals.npy", "--json")
    told = json.loads(realbench(place, "verify", *arguments, code=4).stdout)
    assert not told["verified"]
    assert told["first_difference"]["goal"] == 1
    assert told["first_difference"]["differences"][0]["what"] == "position of cube"
    assert "altered" in told["faults"][0]
    assert "was altered" in realbench(place, "inspect", "altered.json", code=1).stderr


def test_a_recording_verifies_until_it_is_altered(place: Path) -> None:
    printed = realbench(place, "verify", "run.h5").stdout
    assert printed.startswith("verified: 2,000 of 2,000 steps replay bit for bit")
    (place / "altered.h5").write_bytes((place / "run.h5").read_bytes())
    with h5py.File(place / "altered.h5", "r+") as file:
        file["commands"][1:] = file["commands"][:1]
    assert realbench(place, "verify", "altered.h5", "--steps", "1000", "--json").returncode == 0
    told = realbench(place, "verify", "altered.h5", code=4).stdout.splitlines()
    assert told[-1].startswith("does not verify: action 1 (steps 1,000 to 2,000): joint angle")


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (("none.json",), 1, "result not found: none.json"),
        (("none.h5",), 1, "recording not found: none.h5"),
        (("goals.npy",), 1, "goals.npy cannot be read"),
        (("score.json",), 1, "not on the shipped ones"),
        (("score.json", "--steps", "5"), 2, "--steps is not for a result"),
        (("run.h5", "--goals", "goals.npy"), 2, "--goals is not for a recording"),
        ((str(EVALUATION / "results" / "real_r-OM-1.json"),), 1, "it keeps no commands"),
    ],
)
def test_bad_verify_arguments_give_a_one_line_error(
    place: Path, arguments: tuple[str, ...], code: int, message: str
) -> None:
    done = realbench(place, "verify", *arguments, code=code)
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
