"""Goals that nobody can know before they are tested, and everybody can check afterwards.

The seed is drawn from 2**63 and is not in the set, so the set's hash, which results publish, cannot
be searched. A commitment, a hash over the set's hash, the seed and a salt, is published before;
salt and seed, the opening, after.
"""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from pydantic import ValidationError

from real_bench.errors import GoalSetError, faults
from real_bench.fields import Seed
from real_bench.goal_sets.generator import generate_goal_set
from real_bench.goal_sets.goal import SECRET, UNKNOWN_SEED, GoalSet
from real_bench.inputs.records import Record
from real_bench.inputs.spelling import Sha256
from real_bench.lengths import LARGEST
from real_bench.simulation import Scene


class Opening(Record):
    """The opening of a commitment, secret until the goals may be known.

    Attributes:
        seed: of the goals.
        salt: 256 random bits.
        goals_sha256: hash of the set.
    """

    seed: Seed
    salt: Sha256
    goals_sha256: Sha256

    @property
    def commitment(self) -> str:
        """A hash that may be published before: it fixes the goals and reveals nothing of them."""
        content = f"realbench goals {self.goals_sha256} {self.seed} {self.salt}"
        return hashlib.sha256(content.encode()).hexdigest()

    def check(self, goal_set: GoalSet, commitment: str) -> None:
        """Raise GoalSetError unless it opens this commitment, for this set."""
        if self.commitment != commitment.strip().lower():
            raise GoalSetError(f"this opening belongs to another commitment: {self.commitment}")
        if self.goals_sha256 != goal_set.sha256:
            raise GoalSetError("these are not the goals that were committed to")

    def to_json(self) -> str:
        """The content of its file."""
        return json.dumps({**self.model_dump(), "commitment": self.commitment}, indent=1) + "\n"


def draw_secret_goals(
    scene: Scene,
    n_objects: int,
    counts: Mapping[str, int],
    progress: Callable[[int, int], None] = lambda n_done, n_goals: None,
) -> tuple[GoalSet, Opening]:
    """Draw goals from an unguessable seed; returns them without it, and their opening."""
    seed = secrets.randbelow(LARGEST + 1)
    goal_set = _without_seed(generate_goal_set(scene, n_objects, seed, counts, progress))
    return goal_set, Opening(seed=seed, salt=secrets.token_hex(32), goals_sha256=goal_set.sha256)


def is_reproduced(
    goal_set: GoalSet,
    opening: Opening,
    scene: Scene,
    progress: Callable[[int, int], None] = lambda n_done, n_goals: None,
) -> bool:
    """Whether the opened seed gives the same goals, so that nobody chose them."""
    drawn = generate_goal_set(scene, goal_set.n_objects, opening.seed, goal_set.counts, progress)
    return _without_seed(drawn).sha256 == goal_set.sha256


def opening_of(goals: Path) -> Path:
    """Where the opening of a goal set lies: beside it."""
    return goals.with_name(f"{goals.name.removesuffix('.npy')}.opening.json")


def read_opening(path: Path) -> Opening:
    """Read an opening; raises GoalSetError."""
    try:
        fields = json.loads(path.read_text(encoding="utf-8"))
        commitment = fields.pop("commitment", None)
        opening = Opening.model_validate(fields)
    except FileNotFoundError as error:
        raise GoalSetError(f"opening not found: {path}") from error
    except ValidationError as error:
        raise GoalSetError(f"{path} is not an opening: {faults(error)}") from error
    except (ValueError, AttributeError, TypeError, RecursionError) as error:
        raise GoalSetError(f"{path} is not an opening: {error}") from error
    if commitment != opening.commitment:
        raise GoalSetError(f"{path} was altered: its commitment does not match its content")
    return opening


def _without_seed(goal_set: GoalSet) -> GoalSet:
    return replace(goal_set, seed=UNKNOWN_SEED, generator=goal_set.generator + SECRET)
