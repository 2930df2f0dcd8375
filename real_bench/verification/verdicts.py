"""What came of a verification."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from real_bench.verification.differences import Difference


@dataclass(frozen=True)
class TrialCheck:
    """What came of replaying one trial.

    Attributes:
        goal: its number.
        challenge: its class, as recorded.
        differences: nothing where it ended as recorded, to the last bit.
    """

    goal: int
    challenge: str
    differences: tuple[Difference, ...]

    def __str__(self) -> str:
        told = "; ".join(map(str, self.differences))
        return f"goal {self.goal:3d}  {self.challenge:4}  {told or 'ok'}"

    def to_json(self) -> dict[str, Any]:
        """Its fields."""
        differences = [difference.to_json() for difference in self.differences]
        return {"goal": self.goal, "challenge": self.challenge, "differences": differences}


@dataclass(frozen=True)
class ResultVerdict:
    """What came of verifying a result.

    Attributes:
        path: the result.
        score: as recorded.
        n_trials: how many trials were asked for.
        checks: of the trials that there are, by goal.
        faults: whatever else does not hold.
        notes: what could not be checked, or should be known.
        may_be_incomplete: whether it passes without all trials.
    """

    path: Path
    score: float
    n_trials: int
    checks: tuple[TrialCheck, ...]
    faults: tuple[str, ...]
    notes: tuple[str, ...]
    may_be_incomplete: bool = False

    @property
    def different(self) -> list[TrialCheck]:
        """The trials that did not end as recorded."""
        return [check for check in self.checks if check.differences]

    @property
    def is_complete(self) -> bool:
        """Whether every trial has been made."""
        return len(self.checks) == self.n_trials

    @property
    def holds(self) -> bool:
        """Whether the result is proved."""
        enough = self.is_complete or self.may_be_incomplete
        return enough and not self.different and not self.faults

    def to_json(self) -> dict[str, Any]:
        """The whole verdict."""
        different = self.different
        return {
            "file": str(self.path),
            "kind": "result",
            "verified": self.holds,
            "complete": self.is_complete,
            "score": self.score,
            "trials": [check.to_json() for check in self.checks],
            "first_difference": different[0].to_json() if different else None,
            "faults": list(self.faults),
            "notes": list(self.notes),
        }

    def lines(self) -> list[str]:
        """The verdict for a person; the last line is the sum of it."""
        return [*map(str, self.checks), *_asides(self.notes, self.faults), self._sum()]

    def _sum(self) -> str:
        trials = f"{len(self.checks)} of {self.n_trials} trials"
        if self.holds:
            return f"verified: {trials} replay bit for bit, score {self.score:.4f}"
        if self.different:
            first = self.different[0]
            return (
                f"does not verify: {len(self.different)} of {len(self.checks)} trials differ, "
                f"first goal {first.goal}: {first.differences[0]}"
            )
        if self.faults:
            return f"does not verify: the trials replay bit for bit, but {self.faults[0]}"
        return (
            f"does not verify: it is incomplete, {trials}; these replay bit for bit "
            "(--allow-incomplete accepts that)"
        )


@dataclass(frozen=True)
class RecordingVerdict:
    """What came of verifying a recording.

    Attributes:
        path: the recording.
        n_actions, n_steps, n_states: how much was replayed and compared.
        total_steps: how many steps it holds.
        images: whether images were compared, too.
        where: the first state that differs, in words; empty where there is none.
        differences: between that state and the replayed one.
        faults: what in the file contradicts itself; where it cannot be replayed, it is not.
        notes: what could not be checked, or should be known.
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

    @property
    def holds(self) -> bool:
        """Whether all that was replayed is as recorded."""
        return not self.differences and not self.faults

    def to_json(self) -> dict[str, Any]:
        """The whole verdict."""
        first = {
            "where": self.where,
            "differences": [difference.to_json() for difference in self.differences],
        }
        return {
            "file": str(self.path),
            "kind": "recording",
            "verified": self.holds,
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
        return [*_asides(self.notes, self.faults), self._sum()]

    def _sum(self) -> str:
        if self.differences:
            return f"does not verify: {self.where}: {'; '.join(map(str, self.differences))}"
        if self.faults:
            done = "it replays bit for bit, but" if self.n_states else "it was not replayed:"
            return f"does not verify: {done} {self.faults[0]}"
        what = "joints, touch, poses and images" if self.images else "joints, touch and poses"
        return (
            f"verified: {self.n_steps:,} of {self.total_steps:,} steps replay bit for bit "
            f"({self.n_actions:,} actions, {self.n_states:,} states: {what})"
        )


def _asides(notes: Sequence[str], faults: Sequence[str]) -> list[str]:
    return [*(f"note: {note}" for note in notes), *(f"fault: {fault}" for fault in faults)]
