"""The outcomes of verifications."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from real_bench.verification.differences import TOLERANCE_M, Difference
from real_bench.verification.versions import Physics


@dataclass(frozen=True)
class TrialCheck:
    """The outcome of replaying one trial.

    Attributes:
        goal: its number.
        challenge: its class, as recorded.
        differences: empty if it ended as recorded: to the last bit, or within a millimetre under
            different physics.
    """

    goal: int
    challenge: str
    differences: tuple[Difference, ...]

    def __str__(self) -> str:
        reasons = "; ".join(map(str, self.differences))
        return f"goal {self.goal:3d}  {self.challenge:4}  {reasons or 'ok'}"


@dataclass(frozen=True)
class ResultVerdict:
    """The outcome of verifying a result.

    Attributes:
        path: the result.
        score: as recorded.
        n_trials: how many trials were asked for.
        checks: of the trials that there are, by goal.
        faults: whatever else is wrong.
        notes: what could not be checked, or should be known.
        physics: what it was made with, and this machine's.
        may_be_incomplete: whether it passes without all trials.
    """

    path: Path
    score: float
    n_trials: int
    checks: tuple[TrialCheck, ...]
    faults: tuple[str, ...]
    notes: tuple[str, ...]
    physics: Physics
    may_be_incomplete: bool = False

    @property
    def different(self) -> list[TrialCheck]:
        """The trials that did not end as recorded."""
        return [check for check in self.checks if check.differences]

    @property
    def is_complete(self) -> bool:
        """Whether every trial has been run."""
        return len(self.checks) == self.n_trials

    @property
    def holds(self) -> bool:
        """Whether the result is proved."""
        enough = self.is_complete or self.may_be_incomplete
        return enough and not self.different and not self.faults

    @property
    def is_undecided(self) -> bool:
        """Whether other physics may be why it is not proved: it is not known to be forged."""
        found = [difference for check in self.different for difference in check.differences]
        return bool(found) and not self.faults and all(each.of_physics for each in found)

    def to_json(self) -> dict[str, Any]:
        """The whole verdict."""
        different = self.different
        return {
            "file": str(self.path),
            "kind": "result",
            "verified": self.holds,
            "undecided": self.is_undecided,
            "physics": asdict(self.physics),
            "complete": self.is_complete,
            "score": self.score,
            "trials": [asdict(check) for check in self.checks],
            "first_difference": asdict(different[0]) if different else None,
            "faults": list(self.faults),
            "notes": list(self.notes),
        }

    def lines(self) -> list[str]:
        """The verdict for a person; the last line is the sum of it."""
        return [*map(str, self.checks), *_remark_lines(self.notes, self.faults), self._summary()]

    def _summary(self) -> str:
        trials = f"{len(self.checks)} of {self.n_trials} trials"
        replay = _describe_agreement(self.physics)
        if self.holds:
            return f"verified: {trials} {replay}, score {self.score:.4f}"
        if self.is_undecided:
            n_agreeing = len(self.checks) - len(self.different)
            return (
                f"cannot be judged here, physics differs: {n_agreeing} of {len(self.checks)} "
                f"trials {replay}, and all scores follow from the recorded poses; verify it where "
                f"physics is {self.physics.then} (see `realbench doctor`)"
            )
        if self.different:
            first = next(
                check
                for check in self.different
                if self.faults or not all(each.of_physics for each in check.differences)
            )
            return (
                f"does not verify: {len(self.different)} of {len(self.checks)} trials differ, "
                f"first goal {first.goal}: {first.differences[0]}"
            )
        if self.faults:
            return f"does not verify: the trials {replay}, but {self.faults[0]}"
        return (
            f"does not verify: incomplete, {trials}; these {replay} "
            "(--allow-incomplete accepts that)"
        )


@dataclass(frozen=True)
class RecordingVerdict:
    """The outcome of verifying a recording.

    Attributes:
        path: the recording.
        n_actions, n_steps, n_states: how much was replayed and compared.
        total_steps: how many steps it holds.
        images: whether images were also compared.
        where: the first state that differs, in words; empty if there is none.
        differences: between that state and the replayed one.
        faults: contradictions in the file; if they prevent a replay, there is none.
        notes: what could not be checked, or should be known.
        physics: what it was made with, and this machine's; of several parts, the first with
            different physics.
    """

    path: Path
    n_actions: int
    n_steps: int
    n_states: int
    total_steps: int
    images: bool
    where: str
    differences: tuple[Difference, ...]
    faults: tuple[str, ...]
    notes: tuple[str, ...]
    physics: Physics

    @property
    def holds(self) -> bool:
        """Whether everything replayed as recorded."""
        return not self.differences and not self.faults

    @property
    def is_undecided(self) -> bool:
        """Whether other physics may be why it is not proved: it is not known to be forged."""
        found = self.differences
        return bool(found) and not self.faults and all(each.of_physics for each in found)

    def to_json(self) -> dict[str, Any]:
        """The whole verdict."""
        first = {
            "where": self.where,
            "differences": [asdict(difference) for difference in self.differences],
        }
        return {
            "file": str(self.path),
            "kind": "recording",
            "verified": self.holds,
            "undecided": self.is_undecided,
            "physics": asdict(self.physics),
            "actions_replayed": self.n_actions,
            "steps_replayed": self.n_steps,
            "steps_recorded": self.total_steps,
            "states_compared": self.n_states,
            "images_compared": self.images,
            "first_difference": first if self.differences else None,
            "faults": list(self.faults),
            "notes": list(self.notes),
        }

    def lines(self) -> list[str]:
        """The verdict for a person; the last line is the sum of it."""
        return [*_remark_lines(self.notes, self.faults), self._summary()]

    def _summary(self) -> str:
        replay = _describe_agreement(self.physics)
        if self.is_undecided:
            return (
                f"cannot be judged here, physics differs: {self.n_steps:,} of "
                f"{self.total_steps:,} steps {replay}; verify it where physics is "
                f"{self.physics.then} (see `realbench doctor`)"
            )
        if self.differences:
            return f"does not verify: {self.where}: {'; '.join(map(str, self.differences))}"
        if self.faults:
            done = (
                f"it {_describe_agreement(self.physics, 's')}, but"
                if self.n_states
                else "it was not replayed:"
            )
            return f"does not verify: {done} {self.faults[0]}"
        what = "joints, touch, poses and images" if self.images else "joints, touch and poses"
        return (
            f"verified: {self.n_steps:,} of {self.total_steps:,} steps {replay} "
            f"({self.n_actions:,} actions, {self.n_states:,} states: {what})"
        )


def _describe_agreement(physics: Physics, s: str = "") -> str:
    """How exactly things replay."""
    if physics.differs:
        return f"agree{s} within {TOLERANCE_M * 1e3:g} mm"
    return f"replay{s} bit for bit"


def _remark_lines(notes: Sequence[str], faults: Sequence[str]) -> list[str]:
    return [*(f"note: {note}" for note in notes), *(f"fault: {fault}" for fault in faults)]
