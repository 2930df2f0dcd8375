"""The bundle, and its programs run as the platform runs them.

What the platform checks of a bundle is written down here from its documentation (YAML structure and
bundle structure at docs.codabench.org); the platform itself is not here.
"""

from __future__ import annotations

import io
import json
import shlex
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any

import pytest
import yaml
from PIL import Image

from real_bench.competition.platform import score
from real_bench.competition.spec import Round, read_competition
from real_bench.competition.standing import FailureRecord
from real_bench.controller_code.packing import pack
from real_bench.goal_sets import load_goal_set
from tests.cli.shell import realbench
from tests.competition.five import CRASHING, ROUND, derived, rounds, submission
from tests.competition.test_ranking import FACTS, row

TASK_FILES = ("input_data", "reference_data", "ingestion_program", "scoring_program")
TITLE = "Tiny 🤖"
SHORT = {"play": "none", "trial_steps": 800}


@pytest.fixture
def unpacked(place: Path) -> Path:
    """A bundle, unpacked."""
    spec = rounds(place, **SHORT, failure="zero")
    spec.write_text(spec.read_text().replace("Tiny", TITLE), encoding="utf-8")
    return written(place, spec)


def written(place: Path, spec: Path) -> Path:
    realbench(place, "round", "codabench", spec, "--image", "me/realbench:1", "--overwrite")
    with zipfile.ZipFile(place / "bundle.zip") as archive:
        archive.extractall(place / "bundle")
    return place / "bundle"


def test_bundle_has_everything_codabench_requires(unpacked: Path) -> None:
    told: dict[str, Any] = yaml.safe_load((unpacked / "competition.yaml").read_text())
    assert told["version"] == 2
    assert told["title"] == TITLE
    with zipfile.ZipFile(unpacked / "input_data_first.zip") as packed:
        packed.extract("round.yaml", unpacked)
    assert read_competition(unpacked / "round.yaml").title == TITLE
    assert {"title", "image", "terms", "docker_image"} <= set(told)
    assert told["docker_image"] == "me/realbench:1"
    Image.open(unpacked / told["image"]).verify()
    for text in (told["terms"], *(page["file"] for page in told["pages"])):
        assert (unpacked / text).read_text().strip()
    for index, task in enumerate(told["tasks"]):
        assert task["index"] == index
        assert task["name"]
        for kind in TASK_FILES:
            assert zipfile.is_zipfile(unpacked / task[kind])
    for phase in told["phases"]:
        assert {"name", "start", "tasks"} <= set(phase)
        assert phase["tasks"] == [phase["index"]]
        assert phase["execution_time_limit"] > 120
    for solution in told["solutions"]:
        assert zipfile.is_zipfile(unpacked / solution["path"])
        assert solution["tasks"] == [0]
    (board,) = told["leaderboards"]
    assert {"title", "key", "columns"} <= set(board)
    assert [column["index"] for column in board["columns"]] == list(range(len(board["columns"])))
    assert len({column["key"] for column in board["columns"]}) == len(board["columns"])


def run_program(archive: Path, app: Path) -> subprocess.CompletedProcess[str]:
    """Run a program by its metadata, with the platform's folder /app lying somewhere else."""
    with zipfile.ZipFile(archive) as packed:
        packed.extractall(app / "program")
    metadata = yaml.safe_load((app / "program" / "metadata.yaml").read_text())
    command = shlex.split(metadata["command"].replace("/app/", f"{app}/"))
    assert command[0] == "python3"
    return subprocess.run(
        [sys.executable, *command[1:]],
        cwd=app / "program",
        capture_output=True,
        text=True,
        check=False,
    )


def on_the_platform(bundle: Path, app: Path, archive: Path) -> tuple[Path, int]:
    """Prediction, then scoring; gives the folder of the scores, and how scoring ended."""
    told = yaml.safe_load((bundle / "competition.yaml").read_text())
    task = told["tasks"][0]
    for name, file in (("ingested_program", archive), ("input_data", bundle / task["input_data"])):
        with zipfile.ZipFile(file) as packed:
            packed.extractall(app / "ingestion" / name)
    (app / "ingestion" / "ingested_program" / "link").symlink_to("nowhere")
    (app / "ingestion" / "output").mkdir()
    done = run_program(bundle / task["ingestion_program"], app / "ingestion")
    assert done.returncode == 0, done.stderr
    (app / "scoring" / "input").mkdir(parents=True)
    (app / "scoring" / "output").mkdir()
    (app / "ingestion" / "output").rename(app / "scoring" / "input" / "res")
    with zipfile.ZipFile(bundle / task["reference_data"]) as packed:
        packed.extractall(app / "scoring" / "input" / "ref")
    done = run_program(bundle / task["scoring_program"], app / "scoring")
    return app / "scoring", done.returncode


def test_the_starting_kit_is_ingested_and_scored(unpacked: Path, place: Path) -> None:
    scoring, code = on_the_platform(unpacked, place / "app", unpacked / "starting_kit.zip")
    assert code == 0
    scores = json.loads((scoring / "output" / "scores.json").read_text())
    told = yaml.safe_load((unpacked / "competition.yaml").read_text())
    keys = {column["key"] for column in told["leaderboards"][0]["columns"]}
    assert set(scores) == keys
    assert {"score_2D", "score_2_5D"} < keys
    assert "score_3D" not in keys  # the goals have none
    assert all(isinstance(value, float) for value in scores.values())
    assert 0 < scores["low"] <= scores["score"] <= scores["high"]
    result = scoring / "input" / "res" / "seed0.json"
    assert (
        "verified: 3 of 3 trials"
        in realbench(place, "verify", result, "--goals", "goals.npy").stdout
    )
    from tests.competition.learner import forge

    forge(result, lambda content: content["trials"][0].update(distances=[0.0]))
    (scoring / "output" / "scores.json").unlink()
    done = run_program(unpacked / "scoring_program.zip", scoring)
    assert done.returncode == 1
    assert "does not verify" in done.stderr
    assert not (scoring / "output" / "scores.json").exists()


@pytest.mark.parametrize(("failure", "code"), [("zero", 0), ("excluded", 1)])
def test_a_failure_counts_as_the_round_says(place: Path, failure: str, code: int) -> None:
    bundle = written(place, rounds(place, **SHORT, failure=failure))
    mine = submission(place / "mine", derived(CRASHING), entry="controller.py:Crashing")
    pack(mine, place / "mine.zip")
    scoring, ended = on_the_platform(bundle, place / "app", place / "mine.zip")
    assert ended == code
    file = scoring / "output" / "scores.json"
    assert file.exists() == (code == 0)
    if code == 0:
        assert set(json.loads(file.read_text()).values()) == {0.0}


def test_scoring_program_does_not_tell_what_a_controller_says_of_secret_goals(
    tmp_path: Path,
) -> None:
    left = tmp_path / "in" / "res"
    left.mkdir(parents=True)
    FACTS.model_copy(update={"hidden": True, "failure": "excluded"}).save(left)
    failed = {"mine-test0": FailureRecord(status="crashed", detail="test, goal 0: it is at 0.1, 0")}
    row("mine", None, "crashed").standing.with_failures(failed).save(left)
    with pytest.raises(SystemExit, match=r"^crashed: test, goal 0 \(why is not told"):
        score(tmp_path / "in", tmp_path / "out")


def test_goals_are_only_in_data_hidden_from_participants(unpacked: Path, place: Path) -> None:
    told = yaml.safe_load((unpacked / "competition.yaml").read_text())
    assert told["make_input_data_available"] is False
    goals = load_goal_set(place / "goals.npy").sha256
    for file in unpacked.glob("*.zip"):
        with zipfile.ZipFile(file) as packed:
            names = packed.namelist()
            if "goals.npy" in names:
                (place / "found.npy").write_bytes(packed.read("goals.npy"))
                assert load_goal_set(place / "found.npy").sha256 == goals
        assert ("goals.npy" in names) == file.name.startswith(("input_data", "reference_data"))
    with zipfile.ZipFile(io.BytesIO((place / "bundle.zip").read_bytes())) as packed:
        assert all(name == Path(name).name for name in packed.namelist())


def test_rounds_must_follow_one_another_in_time(place: Path) -> None:
    fields = {"title": "Two", "scene": "builtin", "rounds": {"a": ROUND, "b": ROUND}}
    (place / "two.yaml").write_text(json.dumps(fields))
    done = realbench(place, "round", "codabench", "two.yaml", code=1)
    assert "round b must begin after the end of a" in done.stderr
    times = {"start": "2027-01-01 00:00:00", "end": "2027-02-01 00:00:00"}
    later = {"start": "2027-02-01 00:00:00"}
    fields["rounds"] = {"a": {**ROUND, **times}, "b": {**ROUND, **later}}
    (place / "two.yaml").write_text(json.dumps(fields))
    realbench(place, "round", "codabench", "two.yaml")
    fields["rounds"] = {"a": {**ROUND, "start": "tomorrow"}}
    (place / "two.yaml").write_text(json.dumps(fields))
    done = realbench(place, "round", "codabench", "two.yaml", "--overwrite", code=1)
    assert "write it like 2027-01-31 12:00:00" in done.stderr


def written_rounds(place: Path, *times: tuple[str, str], code: int = 0) -> str:
    """Write a bundle of rounds with these starts and ends; gives what is printed of errors."""
    fields = [{"start": start, "end": end} for start, end in times]
    named = {f"r{number}": {**ROUND, **each} for number, each in enumerate(fields)}
    spec = {"title": "Times", "scene": "builtin", "rounds": named}
    (place / "times.yaml").write_text(json.dumps(spec))
    done = realbench(place, "round", "codabench", "times.yaml", "--overwrite", code=code)
    return done.stderr


def test_moments_are_compared_as_moments_however_they_are_written(place: Path) -> None:
    first, second = ("2027-9-1 0:00:00", "2027-9-30 00:00:00"), ("2027-10-1 00:00:00", "")
    written_rounds(place, first, second)
    with zipfile.ZipFile(place / "bundle.zip") as packed:
        phases = json.loads(packed.read("competition.yaml"))["phases"]
    assert (phases[0]["start"], phases[0]["end"]) == ("2027-09-01 00:00:00", "2027-09-30 00:00:00")
    late = ("2027-9-1 0:00:00", "2027-10-1 0:00:01")
    assert "must begin after" in written_rounds(place, late, second, code=1)


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ("2027-10-01 00:00:00", "2027-01-01 00:00:00"),
        ("2027-10-01 00:00:00", "2027-10-01 00:00:00"),
        ("", "2020-01-01 00:00:00"),
    ],
)
def test_round_that_ends_before_it_starts_is_refused(place: Path, start: str, end: str) -> None:
    told = written_rounds(place, (start, end), code=1)
    assert "it ends (" in told or "after its end" in told
    assert not (place / "bundle.zip").exists()


def test_a_round_is_over_when_its_end_has_passed() -> None:
    assert Round(goals="goals.npy", end="2020-01-31 12:00:00").is_over
    assert not Round(goals="goals.npy", end="2120-01-31 12:00:00").is_over
    assert not Round(goals="goals.npy").is_over
