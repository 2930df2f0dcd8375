"""Which files of an experiment are there, and whether they fit it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from real_bench.conditions import Condition
from real_bench.controller_code.source import (
    ControllerSource,
    has_code_hash,
    is_installed,
    recorded_name,
)
from real_bench.errors import (
    ControllerError,
    ExperimentError,
    RecordingError,
    ResultError,
    in_short,
)
from real_bench.experiments.jobs import Job, PlayJob, ScoringJob
from real_bench.scoring.result import Result, load_result
from real_bench.settings import as_validated, merged
from real_bench.text.counting import counted
from real_bench.text.naming import without_folder


@dataclass(frozen=True)
class JobState:
    """The state of a job.

    Attributes:
        ended: whether its file is there and complete.
        mismatches: what in the file does not fit the job.
        result: what a test's file holds.
    """

    ended: bool
    mismatches: tuple[str, ...] = ()
    result: Result | None = None

    @property
    def is_done(self) -> bool:
        """Whether there is nothing left to do."""
        return self.ended and not self.mismatches


def state_of(job: Job) -> JobState:
    """The state of a job; reads its file. One that cannot be read does not fit."""
    if not job.out.exists():
        return JobState(ended=False)
    try:
        return _state_of_play(job) if isinstance(job, PlayJob) else _state_of_test(job)
    except (RecordingError, ResultError) as error:
        return JobState(ended=False, mismatches=(str(error),))


def _state_of_test(job: ScoringJob) -> JobState:
    result = load_result(job.out)
    mismatches = tuple(_mismatches(job, result))
    return JobState(len(result.trials) == job.n_goals, mismatches, result)


def mismatch_message(file: Path, reasons: Sequence[str]) -> str:
    """The message about a file that does not fit its experiment."""
    return f"{file.name} does not belong here: {'; '.join(reasons)}"


def mismatch_error(wrong: Sequence[str], remedy: str = "") -> ExperimentError:
    """The error for files that do not belong here, and what to do about them."""
    return ExperimentError(
        f"{in_short(wrong)}. Move them away, {remedy}or replace them with --overwrite"
    )


def _mismatches(job: ScoringJob, result: Result) -> list[str]:
    """What in a result does not fit the job."""
    from real_bench.files.hashing import file_sha256

    setting = result.setting
    names = ("condition", "objects", "seed", "trial_steps", "run_steps")
    reasons = _differences(
        {"scene": setting.scene, **{name: getattr(setting, name) for name in names}},
        {"scene": job.scene_name, **{name: getattr(job, name) for name in names}},
    )
    # a part of the goals is fine: the test goes on
    if setting.n_goals not in (None, job.n_goals) or setting.set_size > job.n_goals:
        reasons.append(f"{counted(setting.set_size, 'goal')}, not {job.n_goals}")
    reasons += _controller_mismatches(job, setting.controller, setting.controller_sha256)
    reasons += _setting_mismatches(job, setting.settings)
    if job.goals_sha256 not in ("", setting.goals_sha256):
        reasons.append(f"other goals than {job.goals.name}")
    if job.run and job.run.exists() and file_sha256(job.run) != setting.run_sha256:
        reasons.append(f"another recording than {job.run.name}")
    return reasons


def _state_of_play(job: PlayJob) -> JobState:
    from real_bench.recording import Recording

    with Recording(job.out) as recording:
        header, ended = recording.header, recording.ended
        # one killed before its first action does not know its length yet
        steps = recording.total_steps if recording.n_steps else job.steps
    names = ("condition", "objects", "seed")
    reasons = _differences(
        {"scene": header.scene, "steps": steps, **{name: getattr(header, name) for name in names}},
        {
            "scene": job.scene_name,
            "steps": job.steps,
            **{name: getattr(job, name) for name in names},
        },
    )
    condition = Condition.parse(header.condition)
    if mismatch := condition.control_mismatch(header.control_version):
        reasons.append(mismatch)
    if job.images and not header.images:
        reasons.append("no images")
    reasons += _controller_mismatches(job, header.controller, header.controller_sha256)
    reasons += _setting_mismatches(job, header.settings)
    return JobState(ended, tuple(reasons))


def _differences(found: Mapping[str, Any], wanted: Mapping[str, Any]) -> list[str]:
    return [
        f"{name.replace('_', ' ')} {found[name]}, not {wanted[name]}"
        for name in wanted
        if found[name] != wanted[name]
    ]


def _controller_mismatches(job: Job, named: str, sha256: str) -> list[str]:
    """A file is known by its name and content, since it may come from another folder."""
    wanted_name = recorded_name(job.controller)
    if without_folder(named) != without_folder(wanted_name):
        return _differences({"controller": named}, {"controller": wanted_name})
    source = ControllerSource.of(job.controller)
    if source.file is not None and not has_code_hash(source, sha256):
        remedy = "undo it, or give each controller a folder of its own"
        return [f"{source.file.name}, or other Python code in its folder, has changed ({remedy})"]
    return []


def _setting_mismatches(job: Job, found: Mapping[str, Any]) -> list[str]:
    """Settings that are given must agree; the others may have new defaults."""
    wanted, found = (json.loads(json.dumps(values)) for values in (job.settings, found))
    if merged(found, wanted) != found:
        with suppress(ControllerError):  # of one that is not here
            # "50" may be 50 to it; who only looks runs no stranger's code outside support
            walled = job.model_copy(update={"isolate": not is_installed(job.controller)})
            wanted = as_validated(walled.settings_in_full(), wanted)
    return [] if merged(found, wanted) == found else [f"settings {found}, not {wanted}"]
