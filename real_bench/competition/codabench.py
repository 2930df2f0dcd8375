"""A competition as a bundle for Codabench: code submissions, ingested and scored by this package.

The format is that of https://docs.codabench.org (YAML structure, version 2; bundle structure). The
programs run in the image of our Dockerfile, target ``platform``.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from datetime import datetime, timezone
from itertools import pairwise
from pathlib import Path
from typing import Any

from real_bench.competition.spec import MOMENT, Competition, Round
from real_bench.competition.template import make_template
from real_bench.controller_code.packing import pack, zip_files
from real_bench.errors import ExperimentError
from real_bench.files.atomic import write_atomically
from real_bench.files.locks import temporary_folder
from real_bench.goal_sets import GoalSet, load_goal_set
from real_bench.goal_sets.goal import CHALLENGES
from real_bench.inputs.yaml_files import as_yaml
from real_bench.simulation.scene import shipped_scenes
from real_bench.text.counting import counted

STEPS_A_SECOND, SPARE_S = 500, 600
"""How slow a platform's machine may simulate, and what else takes time."""
ROUND_FILE, GOALS_FILE = "round.yaml", "goals.npy"
SCORE, LOW, HIGH, VERIFIED = "score", "low", "high", "verified"

_PROGRAM = '''\
"""Runs in the image, as the platform calls it."""

import sys
from pathlib import Path

from real_bench.competition.platform import {function}

{function}(*map(Path, sys.argv[1:]))
'''
_INGESTION = "/app/ingested_program /app/input_data /app/output"
_SCORING = "/app/input /app/output"

_TERMS = """\
# Terms

Submissions are code that plays and is tested. They must not bring knowledge of the goals or
objects, or weights trained elsewhere, unless the organisers allow it.
"""
_OVERVIEW = """\
# {title}

The REAL benchmark (Robot open-Ended Autonomous Learning): a simulated robot plays freely, without
goal or reward, and is then tested on goals that it has never seen.

Submit the archive that `realbench submission pack` writes. Check it first with
`realbench submission check`.
"""
_EVALUATION = """\
# Evaluation

The score of an object is exp(-c d), 1 at its goal and 0.25 at 10 cm; the mean over all goals
counts. The 95% interval is over the goals, and over the plays as well from three on. The scoring
program replays every trial, so a score is what its commands lead to.

{rounds}
"""


def class_key(name: str) -> str:
    """The key of a class's scores."""
    return f"score_{name.replace('.', '_')}"


def write_bundle(competition: Competition, out: Path, image: str) -> list[str]:
    """Write the bundle; returns the names of its files.

    Raises:
        ExperimentError: the rounds overlap in time, or one would end before it starts.
        RealBenchError: a file of a round cannot be read.
    """
    files = dict(bundle_files(competition, image))
    write_atomically(out, zip_files(files.items()), is_secret=True)
    return list(files)


def bundle_files(competition: Competition, image: str) -> Iterator[tuple[str, bytes]]:
    """Every file of the bundle, by name."""
    goals = {name: load_goal_set(competition.goals(name)) for name in competition.rounds}
    described = as_yaml(_describe(competition, image, goals), indent=1)
    yield "competition.yaml", f"{described}\n".encode()
    yield "logo.png", _logo()
    yield "terms.md", _TERMS.encode()
    yield "overview.md", _OVERVIEW.format(title=competition.title).encode()
    rounds = "\n".join(_summary(name, one) for name, one in competition.rounds.items())
    yield "evaluation.md", _EVALUATION.format(rounds=rounds).encode()
    yield "ingestion_program.zip", _program("ingestion.py", "ingest", _INGESTION)
    yield "scoring_program.zip", _program("scoring.py", "score", _SCORING)
    for name in competition.rounds:
        yield f"input_data_{name}.zip", zip_files(_input_data(competition, name).items())
        yield f"reference_data_{name}.zip", zip_files(_reference_data(competition, name).items())
    first = next(iter(competition.rounds.values()))
    yield "starting_kit.zip", _starting_kit(first)


def _describe(competition: Competition, image: str, goals: Mapping[str, GoalSet]) -> dict[str, Any]:
    """The platform's ``competition.yaml``, with the goals of each round."""
    now = datetime.now(timezone.utc).strftime(MOMENT)
    _check_order(competition, now)
    return {
        "version": 2,
        "title": competition.title,
        "description": "REAL benchmark: open-ended learning of a simulated robot",
        "image": "logo.png",
        "terms": "terms.md",
        "docker_image": image,
        "registration_auto_approve": False,
        "make_programs_available": True,
        "make_input_data_available": False,
        "enable_detailed_results": False,
        "pages": [
            {"title": "Overview", "file": "overview.md"},
            {"title": "Evaluation", "file": "evaluation.md"},
        ],
        "tasks": [
            {
                "index": index,
                "name": f"{competition.title}: {name}",
                "description": _summary(name, one),
                "input_data": f"input_data_{name}.zip",
                "reference_data": f"reference_data_{name}.zip",
                "ingestion_program": "ingestion_program.zip",
                "scoring_program": "scoring_program.zip",
                "ingestion_only_during_scoring": False,
            }
            for index, (name, one) in enumerate(competition.rounds.items())
        ],
        "solutions": [
            {
                "index": 0,
                "path": "starting_kit.zip",
                "tasks": list(range(len(competition.rounds))),
            }
        ],
        "phases": list(_phases(competition, now, goals)),
        "leaderboards": [
            {
                "title": "Results",
                "key": "main",
                "submission_rule": "Force_Last",
                "hidden": False,
                "columns": [
                    {
                        "title": heading,
                        "key": key,
                        "index": index,
                        "sorting": "desc",
                        "precision": 0 if key == VERIFIED else 4,
                        "hidden": False,
                    }
                    for index, (key, heading) in enumerate(_columns(goals).items())
                ],
            }
        ],
    }


def _columns(goals: Mapping[str, GoalSet]) -> dict[str, str]:
    """What the scoring program writes, and its headings: only classes that have goals."""
    there = {each for goal_set in goals.values() for each in goal_set.classes}
    classes = {class_key(name): name for name in CHALLENGES if name in there}
    return {SCORE: "Score", LOW: "95% from", HIGH: "95% to", **classes, VERIFIED: "Verified"}


def _phases(
    competition: Competition, now: str, goals: Mapping[str, GoalSet]
) -> Iterator[dict[str, Any]]:
    for index, (name, one) in enumerate(competition.rounds.items()):
        phase: dict[str, Any] = {
            "index": index,
            "name": name,
            "description": _summary(name, one),
            "start": one.start or now,
            "execution_time_limit": _seconds(one, len(goals[name])),
            "max_submissions_per_day": 1,
            "hide_output": True,
            "hide_prediction_output": True,
            "hide_score_output": False,
            "tasks": [index],
        }
        yield {**phase, **({"end": one.end} if one.end else {})}


def _check_order(competition: Competition, now: str) -> None:
    """The platform's phases must not overlap, and only the last may have no end."""
    for name, each in competition.rounds.items():
        if each.end and each.end <= (each.start or now):
            raise ExperimentError(
                f"round {name} has no start, so it would start now, after its end ({each.end}): "
                "give its start, or another end"
            )
    for (one, before), (other, after) in pairwise(competition.rounds.items()):
        if not (before.end and after.start) or after.start < before.end:
            raise ExperimentError(
                f"on the platform round {other} must begin after the end of {one}: give both "
                "start and end, e.g. 2027-01-31 12:00:00"
            )


def _seconds(one: Round, n_goals: int) -> int:
    """What the platform allows: the limits of all jobs, and time to simulate."""
    plays = len(one.seeds) if one.play == "own" else 0
    tests = len(one.seeds)
    steps = plays * one.steps + tests * n_goals * one.trial_steps
    return int((plays + tests) * one.limits.total_s + steps / STEPS_A_SECOND) + SPARE_S


def _summary(name: str, one: Round) -> str:
    play = {
        "own": f"{one.steps:,} steps of play",
        "given": "a given play",
        "none": "no play",
    }[one.play]
    return f"Round {name}: REAL_{one.condition}, {counted(one.objects, 'object')}, {play}."


def _input_data(competition: Competition, name: str) -> dict[str, bytes]:
    """What the ingestion program needs: the round, its goals, and recordings if given.

    The platform does not show it to participants, and their code runs where it cannot read it.
    """
    one = competition.rounds[name]
    recordings = competition.recordings(name)
    fields = one.model_dump(mode="json", exclude_defaults=True)
    fields |= {"goals": GOALS_FILE}
    if recordings:
        fields["recordings"] = [f"recording{number}.h5" for number in range(len(recordings))]
    one_round = {"title": competition.title, "scene": competition.scene, "rounds": {name: fields}}
    files = {ROUND_FILE: as_yaml(one_round, indent=1).encode()}
    files |= _reference_data(competition, name)
    for number, recording in enumerate(recordings):
        files[f"recording{number}.h5"] = recording.read_bytes()
    if competition.scene not in shipped_scenes():
        raise ExperimentError("on the platform the scene must be one of the image's, given by name")
    return files


def _reference_data(competition: Competition, name: str) -> dict[str, bytes]:
    return {GOALS_FILE: competition.goals(name).read_bytes()}


def _program(file: str, function: str, paths: str) -> bytes:
    code = _PROGRAM.format(function=function)
    metadata = f"command: python3 /app/program/{file} {paths}\n"
    return zip_files([("metadata.yaml", metadata.encode()), (file, code.encode())])


def _starting_kit(first: Round) -> bytes:
    with temporary_folder("realbench-kit-") as folder:
        make_template(folder / "kit", "Random", "Organisers", first.condition)
        pack(folder / "kit", folder / "kit.zip")
        return (folder / "kit.zip").read_bytes()


def _logo() -> bytes:
    """A square with the benchmark's name."""
    from PIL import Image, ImageDraw, ImageFont

    picture = Image.new("RGB", (256, 256), "#0072b2")
    ImageDraw.Draw(picture).text(
        (128, 128), "REAL", "white", ImageFont.load_default(80), anchor="mm"
    )
    stream = io.BytesIO()
    picture.save(stream, "png")
    return stream.getvalue()
