"""Verify a bundle as a whole: that its parts hold, and that each follows from the others."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from real_bench.controller_code.source import ControllerSource
from real_bench.errors import (
    ActionError,
    ControllerError,
    GoalSetError,
    OutOfMemoryError,
    OutOfTimeError,
    PhysicsError,
    RealBenchError,
    RecordingError,
    ResultError,
)
from real_bench.files.hashing import file_sha256
from real_bench.recording import Recording
from real_bench.sandbox import Limits
from real_bench.scoring.result import Result, load_result
from real_bench.verification.bundles import Bundle
from real_bench.verification.doing_again import check_actions, check_play
from real_bench.verification.parts import (
    DISPUTED,
    FAILS,
    HOLDS,
    IN_PART,
    NOT_CHECKED,
    UNDECIDED,
    Part,
    PartOutcome,
)
from real_bench.verification.recordings import RecordingVerification
from real_bench.verification.results import NotGivenError, ResultVerification

OnReplay = Callable[[int, int], None]

PLAY = "play"

FAULTS = (ActionError, ControllerError, GoalSetError, PhysicsError, RecordingError, ResultError)
EXCUSED = (NotGivenError, OutOfMemoryError, OutOfTimeError)
"""Errors that a bundle is to blame for: the first, but not the second. For any other it is this
machine (its temporary files, packages, processes), or what was not given."""


@dataclass(frozen=True)
class BundleVerdict:
    """The outcome of verifying a bundle.

    Attributes:
        bundle: what was verified.
        result_sha256: hash of the result's file as it was verified; empty if it cannot be opened.
        score: as recorded; None if the result cannot be read.
        parts: the verdicts on its parts.
    """

    bundle: Bundle
    result_sha256: str
    score: float | None
    parts: tuple[Part, ...]

    @property
    def holds(self) -> bool:
        """Whether all that could be checked holds."""
        return all(part.verdict in (HOLDS, IN_PART, NOT_CHECKED) for part in self.parts)

    @property
    def unchecked(self) -> tuple[str, ...]:
        """The parts that were not checked, or not to the end; play is checked on request only."""
        return tuple(
            part.what
            for part in self.parts
            if part.verdict in (IN_PART, NOT_CHECKED) and part.what != PLAY
        )

    @property
    def is_undecided(self) -> bool:
        """Whether nothing fails but something cannot be judged here."""
        verdicts = {part.verdict for part in self.parts}
        return FAILS not in verdicts and UNDECIDED in verdicts

    @property
    def detail(self) -> str:
        """The verdict in a line."""
        wrong = [part for part in self.parts if part.verdict in (FAILS, UNDECIDED)]
        if wrong:
            first = min(wrong, key=lambda part: part.verdict != FAILS)
            return f"{first.what}: {first.detail}"
        by_verdict = {
            verdict: ", ".join(part.what for part in self.parts if part.verdict == verdict)
            for verdict in (HOLDS, IN_PART, NOT_CHECKED)
        }
        rest = [f"{verdict}: {by_verdict[verdict]}" for verdict in (IN_PART, NOT_CHECKED)]
        rest = [each for each in rest if not each.endswith(": ")]
        return f"verified: {by_verdict[HOLDS]}" + (f" ({'; '.join(rest)})" if rest else "")

    def to_json(self) -> dict[str, Any]:
        """All of it."""
        return {
            "result": str(self.bundle.result),
            "recording": None if self.bundle.recording is None else str(self.bundle.recording),
            "submission": None if self.bundle.submission is None else str(self.bundle.submission),
            "score": self.score,
            "verified": self.holds,
            "undecided": self.is_undecided,
            "unchecked": list(self.unchecked),
            "detail": self.detail,
            "parts": [asdict(part) for part in self.parts],
        }


@dataclass(frozen=True)
class BundleVerification:
    """A bundle to be verified.

    Attributes:
        bundle: what belongs together.
        goals, scene: of the result; None: the shipped ones.
        may_be_incomplete: whether a result with missing trials passes.
        jobs: number of processes, for the trials.
        n_steps: how many steps of the recording to replay; None: all.
        n_again: how many goals the submission is tested on again; 0: it is not run.
        play_again: whether it also plays again.
        limits: what it may use up.
    """

    bundle: Bundle
    goals: Path | None = None
    scene: str | None = None
    may_be_incomplete: bool = False
    jobs: int = 1
    n_steps: int | None = None
    n_again: int = 2
    play_again: bool = False
    limits: Limits = field(default_factory=Limits)

    def __post_init__(self) -> None:
        """Let both verifications check their options, which are no fault of the bundle."""
        self._of_trials()
        self._of_recording(self.bundle.recording or Path())

    def verify(self) -> BundleVerdict:
        """Check part by part; a part that cannot be read fails, if the bundle is to blame.

        Raises:
            Interrupted: the user stopped it.
        """
        try:
            result = load_result(self.bundle.result)
            score, sha256 = result.score, file_sha256(self.bundle.result)
        except RealBenchError as error:
            detail = _without_folder(str(error), self.bundle)
            sha256 = ""
            with suppress(OSError):
                sha256 = file_sha256(self.bundle.result)
            return BundleVerdict(self.bundle, sha256, None, (Part("result", FAILS, detail),))
        parts: list[Part] = []
        checks: dict[str, Callable[[], PartOutcome]] = {
            "trials": self._check_trials,
            "recording": lambda: self._check_recording(result),
            "code": lambda: self._check_code(result),
            "settings": lambda: self._check_settings(result),
            "state": lambda: self._check_state(result, parts),
            PLAY: lambda: self._check_play(parts),
        }
        for what, check in checks.items():
            try:
                verdict, detail = check()
            except RealBenchError as error:
                is_fault = isinstance(error, FAULTS) and not isinstance(error, EXCUSED)
                verdict, detail = FAILS if is_fault else UNDECIDED, str(error)
            parts.append(Part(what, verdict, _without_folder(detail, self.bundle)))
        return BundleVerdict(self.bundle, sha256, score, tuple(_with_state_decided(parts)))

    def _of_trials(self) -> ResultVerification:
        return ResultVerification(
            self.bundle.result,
            goals=self.goals,
            scene=self.scene,
            run=self.bundle.recording,
            may_be_incomplete=self.may_be_incomplete,
            jobs=self.jobs,
        )

    def _of_recording(self, recording: Path) -> RecordingVerification:
        return RecordingVerification(recording, scene=self.scene, n_steps=self.n_steps)

    def _check_trials(self) -> PartOutcome:
        verdict = self._of_trials().verify(lambda done, total: None)
        return _verdict_of(verdict.holds, verdict.is_undecided), verdict.lines()[-1]

    def _check_recording(self, result: Result) -> PartOutcome:
        if not result.setting.run_steps:
            return HOLDS, "it learned from none"
        if self.bundle.recording is None:
            return NOT_CHECKED, "no recording found"
        verdict = self._of_recording(self.bundle.recording).verify(lambda done, total: None)
        outcome = _verdict_of(verdict.holds, verdict.is_undecided)
        if outcome == HOLDS and verdict.n_steps < verdict.total_steps:
            outcome = IN_PART
        return outcome, verdict.lines()[-1]

    def _check_code(self, result: Result) -> PartOutcome:
        if self.bundle.submission is None:
            return NOT_CHECKED, "no submission found"
        here = ControllerSource.of(str(self.bundle.submission)).code_sha256
        if here != result.setting.controller_sha256:
            return FAILS, "the submission is not the code that was tested"
        learned = result.setting.learned
        if learned is not None and here != learned.code_sha256:
            return FAILS, "what it learned was learned with other code"
        if self.bundle.recording is not None:
            with Recording(self.bundle.recording) as recording:
                played = recording.code_sha256
            if played != here and learned is not None:
                return FAILS, "the submission is not the code that played"
            if played == here:
                return HOLDS, f"{here[:12]} played and was tested"
        return HOLDS, f"{here[:12]} was tested"

    def _check_settings(self, result: Result) -> PartOutcome:
        learned = result.setting.learned
        if learned is not None and learned.settings != result.setting.settings:
            return FAILS, "what it learned was learned with other settings"
        if self.bundle.recording is None or learned is None:
            return HOLDS, "those of the result"
        with Recording(self.bundle.recording) as recording:
            played = recording.header.settings
        if played != result.setting.settings:
            return FAILS, "it played with other settings than it was tested with"
        return HOLDS, "it played and was tested with the same"

    def _check_state(self, result: Result, before: Sequence[Part]) -> PartOutcome:
        if self.bundle.submission is None or self.n_again < 1:
            return NOT_CHECKED, "the submission was not run"
        if _any_failed(before):
            return NOT_CHECKED, "other parts do not hold"
        return check_actions(result, self.bundle, self.goals, self.scene, self.n_again, self.limits)

    def _check_play(self, before: Sequence[Part]) -> PartOutcome:
        if not self.play_again or self.bundle.submission is None:
            return NOT_CHECKED, "it did not play again"
        if _any_failed(part for part in before if part.what != "state"):
            return NOT_CHECKED, "other parts do not hold"
        return check_play(self.bundle, self.scene, self.limits)


def _with_state_decided(parts: Sequence[Part]) -> Iterator[Part]:
    """The parts; a disputed state holds if the play that was repeated does, or else fails."""
    plays = any(part.what == PLAY and part.verdict == HOLDS for part in parts)
    for part in parts:
        if part.verdict != DISPUTED:
            yield part
        elif plays:
            yield Part(part.what, HOLDS, "it acts the same again, and plays to the same state")
        else:
            yield Part(part.what, FAILS, part.detail)


def _any_failed(parts: Iterable[Part]) -> bool:
    return any(part.verdict in (FAILS, UNDECIDED) for part in parts)


def _verdict_of(holds: bool, is_undecided: bool) -> str:
    return HOLDS if holds else UNDECIDED if is_undecided else FAILS


def _without_folder(detail: str, bundle: Bundle) -> str:
    """A detail without the bundle's folder."""
    return detail.replace(f"{bundle.result.parent}/", "")
