"""What a platform's ingestion and scoring programs call, with the folders that it gives them."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

from real_bench.competition.codabench import (
    GOALS_FILE,
    HIGH,
    LOW,
    ROUND_FILE,
    SCORE,
    VERIFIED,
    class_key,
)
from real_bench.competition.ranking import ZERO
from real_bench.competition.round_file import RoundFacts, load_round
from real_bench.competition.running import RoundRun
from real_bench.competition.spec import read_competition
from real_bench.competition.standing import SCORED, WAITING, Standing
from real_bench.errors import ExperimentError
from real_bench.files.locks import temporary_folder
from real_bench.goal_sets import load_goal_set
from real_bench.scoring.repeats import by_goal, summarise_repeats
from real_bench.scoring.result import load_result
from real_bench.verification import ResultVerification

HANDED_IN = "submission"


def ingest(submission: Path, data: Path, output: Path) -> None:
    """Play and test a submission, isolated; leave its results and its standing.

    Args:
        submission: its folder, as it was unpacked.
        data: with the round and its goals.
        output: where results go.

    Raises:
        ExperimentError: it failed through no fault of the submission.
        RealBenchError: the round cannot be held here.
    """
    competition = read_competition(data / ROUND_FILE)
    (name,) = competition.rounds
    with temporary_folder("realbench-platform-") as folder:
        shutil.copytree(submission, folder / "submissions" / HANDED_IN, symlinks=True)
        for goals in data.iterdir():
            shutil.copy(goals, folder / goals.name)
        round_run = RoundRun(
            read_competition(folder / ROUND_FILE), name, folder / "submissions", n_at_once=1
        )
        (standing,), broken = round_run.hold()
        if broken:
            raise ExperimentError("; ".join(failure.detail for failure in broken.values()))
        (kept,) = round_run.folder.glob(f"*/{Standing.FILE}")
        output.mkdir(parents=True, exist_ok=True)
        for file in (*kept.parent.glob("seed*.json"), kept):
            shutil.copy(file, output / file.name)
        shutil.copy(round_run.folder / RoundFacts.FILE, output / RoundFacts.FILE)
    print(f"{standing.name}: {standing.status}{f', {standing.detail}' if standing.detail else ''}")


def score(inputs: Path, output: Path) -> None:
    """Verify what ingestion left, by replay, and write the platform's ``scores.json``.

    A class without goals has no score there, and one goal alone no interval.

    Args:
        inputs: with ``res``, what ingestion left, and ``ref``, the goals.
        output: where the scores go.

    Exits with 1 if there is nothing to score; counts a failed submission as its round says.
    """
    left, goals = inputs / "res", inputs / "ref" / GOALS_FILE
    standing = Standing.load(left)
    if standing is None:
        sys.exit("no standing found: the ingestion program did not finish")
    facts = load_round(left)
    output.mkdir(parents=True, exist_ok=True)
    if standing.status != SCORED:
        message = f"{standing.status}: {facts.shown(standing).detail}"
        if facts.failure != ZERO or standing.status == WAITING:
            sys.exit(message)
        print(message)
        classes = map(class_key, set(load_goal_set(goals).classes))
        return _write(output, dict.fromkeys([SCORE, LOW, HIGH, *classes, VERIFIED], 0.0))
    files = sorted(left.glob("seed*.json"))
    for file in files:
        verdict = ResultVerification(file, goals=goals).verify(lambda done, total: None)
        if verdict.holds or not facts.hidden:  # else it could tell how far a goal is
            print(f"{file.name}: {verdict.lines()[-1]}")
        if not verdict.holds:
            sys.exit(f"{file.name} does not verify")
    summary = summarise_repeats(by_goal([load_result(file) for file in files])).score
    scores = {SCORE: summary.mean, VERIFIED: 1.0}
    scores |= {class_key(name): mean for name, mean in summary.by_class.items()}
    if summary.interval:
        scores |= {LOW: summary.interval.low, HIGH: summary.interval.high}
    _write(output, scores)


def _write(output: Path, scores: dict[str, float]) -> None:
    (output / "scores.json").write_text(json.dumps(scores))
