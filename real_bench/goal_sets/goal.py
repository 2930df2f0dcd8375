"""A goal and a set of goals, as records that check themselves.

Lengths are metres, quaternions (x, y, z, w).
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from real_bench.errors import GoalSetError
from real_bench.lengths import LARGEST
from real_bench.text.counting import counted

if TYPE_CHECKING:
    from real_bench.simulation.scene import Scene

CHALLENGES = ("2D", "2.5D", "3D")
NO_BODY = -1  # in a mask: no body in this pixel
MAX_BODY_ID = 254  # a mask must fit in eight bits beside "no body"
UNKNOWN_SEED = -1
SECRET = "-secret"
"""Suffix of the generator's name for secret goals."""
MAX_PIXELS = 2**26  # of all goals together; their three images take ten bytes per pixel
QUATERNION_TOLERANCE = 1e-3

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,31}")
_GENERATOR = re.compile(r"[A-Za-z0-9][A-Za-z0-9._+-]{0,31}")
_SHA256 = re.compile(r"[0-9a-f]{64}")


@dataclass(frozen=True, eq=False)
class Goal:
    """The poses from and to which the objects are to be moved, and images of both.

    The arrays are copied and made read-only.

    Attributes:
        challenge: ``2D`` on the table, ``2.5D`` also on the shelf, ``3D`` in any orientation too.
        initial_poses: where the objects start, (n_objects, 7): position, quaternion.
        final_poses: where they should end, (n_objects, 7).
        retina_before: camera image of the start, (height, width, 3) uint8.
        retina: camera image of the goal, (height, width, 3) uint8.
        mask: body id of each pixel of the goal image, (height, width) int32; -1 where none.

    Raises:
        GoalSetError: the values contradict the above.
    """

    challenge: str
    initial_poses: NDArray[np.float64]
    final_poses: NDArray[np.float64]
    retina_before: NDArray[np.uint8] = field(repr=False)
    retina: NDArray[np.uint8] = field(repr=False)
    mask: NDArray[np.int32] = field(repr=False)

    def __post_init__(self) -> None:
        if self.challenge not in CHALLENGES:
            raise GoalSetError(
                f"unknown challenge {self.challenge!r}: use one of {', '.join(CHALLENGES)}"
            )
        self._keep("initial_poses", _checked_poses("initial_poses", self.initial_poses))
        self._keep("final_poses", _checked_poses("final_poses", self.final_poses))
        if self.initial_poses.shape != self.final_poses.shape:
            raise GoalSetError(
                f"initial_poses are of shape {self.initial_poses.shape}, "
                f"final_poses of {self.final_poses.shape}: they must agree"
            )
        self._keep("mask", _checked_mask(self.mask))
        self._keep("retina", _checked_retina("retina", self.retina, self.mask.shape))
        self._keep(
            "retina_before", _checked_retina("retina_before", self.retina_before, self.mask.shape)
        )

    @property
    def n_objects(self) -> int:
        """How many objects it places."""
        return len(self.initial_poses)

    @property
    def sha256(self) -> str:
        """A hash of its content, independent of the file."""
        digest = hashlib.sha256(f"{self.challenge} {self.n_objects} {self.mask.shape}".encode())
        for poses in (self.initial_poses, self.final_poses):
            digest.update(poses.astype("<f8").tobytes())
        for image in (self.retina_before, self.retina):
            digest.update(image.tobytes())
        digest.update(self.mask.astype("<i4").tobytes())
        return digest.hexdigest()

    def _keep(self, field: str, value: NDArray[Any]) -> None:
        value.setflags(write=False)
        object.__setattr__(self, field, value)


@dataclass(frozen=True, eq=False)
class GoalSet:
    """Goals for one scene and number of objects, with their origin.

    Attributes:
        goals: at least one.
        object_names: the objects that the rows of every goal's poses describe.
        scene: the name of the scene the goals were made in.
        scene_sha256: that scene's hash (:attr:`real_bench.simulation.Scene.sha256`).
        generator: what made the goals, with its version, e.g. ``realbench-1``.
        seed: the seed they were drawn from; -1 if unknown.

    Raises:
        GoalSetError: the goals do not fit together, or a value is malformed.
    """

    goals: tuple[Goal, ...]
    object_names: tuple[str, ...]
    scene: str
    scene_sha256: str
    generator: str
    seed: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "goals", tuple(self.goals))
        object.__setattr__(self, "object_names", tuple(self.object_names))
        self._check_origin()
        if not self.goals:
            raise GoalSetError("a goal set needs at least one goal")
        shape = self.goals[0].mask.shape
        check_size(len(self), *shape)
        for index, goal in enumerate(self.goals):
            if goal.n_objects != self.n_objects:
                raise GoalSetError(
                    f"goal {index} places {counted(goal.n_objects, 'object')}, "
                    f"but the set names {self.n_objects}"
                )
            if goal.mask.shape != shape:
                raise GoalSetError(f"goal {index}: images of {goal.mask.shape}, others of {shape}")

    def __len__(self) -> int:
        return len(self.goals)

    def __repr__(self) -> str:
        listed = ", ".join(f"{n} {challenge}" for challenge, n in self.counts.items() if n)
        names = ", ".join(self.object_names)
        return f"<GoalSet: {counted(len(self), 'goal')} ({listed}), {names}, scene {self.scene}>"

    @property
    def n_objects(self) -> int:
        """How many objects every goal places."""
        return len(self.object_names)

    @property
    def is_secret(self) -> bool:
        """Whether it is secret until it is opened."""
        return self.generator.endswith(SECRET)

    @property
    def classes(self) -> tuple[str, ...]:
        """The challenge of each goal."""
        return tuple(goal.challenge for goal in self.goals)

    @property
    def counts(self) -> dict[str, int]:
        """How many goals there are of each challenge."""
        return {challenge: self.classes.count(challenge) for challenge in CHALLENGES}

    @property
    def facts(self) -> Mapping[str, object]:
        """What holds for all its goals, fit for JSON."""
        return {
            "objects": list(self.object_names),
            "scene": self.scene,
            "scene_sha256": self.scene_sha256,
            "generator": self.generator,
            "seed": self.seed,
        }

    @property
    def sha256(self) -> str:
        """A hash of its content, independent of the file's compression."""
        content = {**self.facts, "goals": [goal.sha256 for goal in self.goals]}
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    def check_fits(self, scene: Scene, n_objects: int) -> None:
        """Raise GoalSetError unless made for this very scene and number of objects."""
        if n_objects != self.n_objects:
            raise GoalSetError(
                f"the goals are for {counted(self.n_objects, 'object')} "
                f"({', '.join(self.object_names)}), the run has {n_objects}: "
                f"use --objects {self.n_objects}, or other goals"
            )
        if scene.sha256 != self.scene_sha256:
            raise GoalSetError(
                f"the goals were made in scene {self.scene} ({self.scene_sha256[:12]}), "
                f"the run uses {scene.name} ({scene.sha256[:12]}): use goals of that scene "
                f"(realbench goals generate --scene {scene.source})"
            )

    def _check_origin(self) -> None:
        for name in (*self.object_names, self.scene):
            _check_text("name", name, _NAME)
        _check_text("generator", self.generator, _GENERATOR)
        _check_text("scene_sha256", self.scene_sha256, _SHA256)
        if len(set(self.object_names)) < len(self.object_names) or not self.object_names:
            raise GoalSetError(f"objects {', '.join(self.object_names) or 'none'}: name each once")
        if not UNKNOWN_SEED <= self.seed <= LARGEST:
            raise GoalSetError(f"seed {self.seed}: use 0 to 2**63 - 1, or -1 if unknown")


def check_size(n_goals: int, height: int, width: int) -> None:
    """Raise GoalSetError if so many goals with such images would not fit in memory."""
    if n_goals * height * width > MAX_PIXELS:
        raise GoalSetError(
            f"{counted(n_goals, 'goal')} with images of {width}x{height}: too many, "
            f"at most {MAX_PIXELS // (height * width)} fit"
        )


def _checked_poses(name: str, value: ArrayLike) -> NDArray[np.float64]:
    poses = np.array(value, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[0] < 1 or poses.shape[1] != 7:
        raise GoalSetError(f"{name} have shape {poses.shape}, not (n_objects, 7)")
    if not np.isfinite(poses).all():
        raise GoalSetError(f"{name} must be finite: {poses.tolist()}")
    with np.errstate(over="ignore"):  # a length beyond all numbers is refused like any other
        norms = np.linalg.norm(poses[:, 3:], axis=1)
    if (np.abs(norms - 1) > QUATERNION_TOLERANCE).any():
        raise GoalSetError(f"{name}: quaternions must have length 1, not {norms.tolist()}")
    return poses


def _checked_retina(
    name: str, value: NDArray[np.uint8], shape: tuple[int, ...]
) -> NDArray[np.uint8]:
    if value.dtype != np.uint8 or value.shape != (*shape, 3):
        raise GoalSetError(
            f"{name} is {value.dtype} of shape {value.shape}: it must be uint8 of {(*shape, 3)}"
        )
    return np.array(value)


def _checked_mask(value: NDArray[np.integer[Any]]) -> NDArray[np.int32]:
    if value.dtype.kind not in "iu" or value.ndim != 2 or value.size == 0:
        raise GoalSetError(
            f"mask is {value.dtype} of shape {value.shape}: it must be integers (height, width)"
        )
    lowest, highest = int(value.min()), int(value.max())
    if lowest < NO_BODY or highest > MAX_BODY_ID:
        raise GoalSetError(
            f"mask holds body ids {lowest} to {highest}: they must be within "
            f"{NO_BODY} (none) to {MAX_BODY_ID}"
        )
    return np.array(value, dtype=np.int32)


def _check_text(what: str, value: str, pattern: re.Pattern[str]) -> None:
    if not pattern.fullmatch(value):
        raise GoalSetError(f"{what} {value!r} must match {pattern.pattern}")
