"""Goals drawn by the rules of the official sets.

Each state, start and goal alike, is drawn, dropped and left to settle. Where the official rules
are silent, we interpret them as follows:

- Distances between objects are between their centres in 3D; a start is apart from its goal in
  x, y. All distances are respected before and after settling.
- An object is on the shelf where it has come to rest beyond ``shelf_drop_from_x``: nothing that
  stands on the table reaches beyond that line. A 2D goal has no object there, in the start or
  in the goal; a 2.5D or 3D goal has at least one, in either.
- Drift of a fixed orientation is the length of the difference of the two quaternions (of the
  nearer sign), from the orientation in which the scene starts the object.
- A draw is given up if it does not settle in time, or if an object fell off and was put back.

One rule is ours. In a 3D draw an object may balance on an edge for as long as settling is watched
(about one such state in 300), and a trial would begin with its fall. So what settled in a 3D draw
must also stay where it is when a trial begins from there.

Every settling begins in a fresh world, and every goal has random numbers of its own: the k-th goal
of a class is the same, whatever else is drawn with the same seed, scene and number of objects.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.random import Generator, SeedSequence
from numpy.typing import NDArray

from real_bench.errors import GoalSetError, PhysicsError
from real_bench.goal_sets.goal import CHALLENGES, Goal, GoalSet, check_size
from real_bench.inputs.whole import whole
from real_bench.lengths import LARGEST
from real_bench.simulation import HOME, Scene, Simulation
from real_bench.simulation.manifest import GoalRegion
from real_bench.text.counting import counted

GENERATOR = "realbench-1"
OFFICIAL_COUNTS: Mapping[str, int] = MappingProxyType({"2D": 25, "2.5D": 15, "3D": 10})

MIN_OBJECT_DISTANCE_M = 0.25
MIN_START_TO_GOAL_M = 0.2
MAX_DRIFT = 0.041

SETTLED_POSITION_M = 1e-4
SETTLED_QUATERNION = 1e-3
SETTLED_STEPS = 20
MAX_STEPS = 1000
STAYS_WITHIN_M = 0.02
STAYS_STEPS = 1000

MAX_DRAWS = 20_000  # of positions, for one settling; three objects take about 60
MAX_SETTLINGS = 300  # of drawn positions, for one goal; it takes about 3

Poses = NDArray[np.float64]
Quaternions = NDArray[np.float64]


def generate_goal_set(
    scene: Scene,
    n_objects: int,
    seed: int,
    counts: Mapping[str, int] = OFFICIAL_COUNTS,
    progress: Callable[[int, int], None] = lambda n_done, n_goals: None,
) -> GoalSet:
    """Draw goals, in the order 2D, 2.5D, 3D.

    Args:
        scene: the scene; its manifest gives the region.
        n_objects: how many of the scene's objects.
        seed: the same seed gives the same goals.
        counts: how many of each challenge; 0 for those not named.
        progress: called with the number of goals done and of all goals, after each.

    Raises:
        GoalSetError: an impossible count or seed, or a region in which no goal can be found.
        SceneError: the scene has fewer objects.
    """
    seed = whole(seed, "seed", 0, LARGEST, GoalSetError)
    _check_request(scene, counts)
    wanted = [(challenge, k) for challenge in CHALLENGES for k in range(counts.get(challenge, 0))]
    goals = []
    with Simulation(scene, n_objects) as simulation:
        rest = simulation.object_poses()[:, 3:]
        for n_done, (challenge, k) in enumerate(wanted, start=1):
            key = (CHALLENGES.index(challenge), k)
            rng = np.random.default_rng(SeedSequence(seed, spawn_key=key))
            goals.append(_Drawing(simulation, rest, challenge, rng).goal())
            progress(n_done, len(wanted))
    return GoalSet(
        goals=tuple(goals),
        object_names=scene.object_names(n_objects),
        scene=scene.name,
        scene_sha256=scene.sha256,
        generator=GENERATOR,
        seed=seed,
    )


class _Drawing:
    """The search for one goal."""

    def __init__(
        self, simulation: Simulation, rest: Quaternions, challenge: str, rng: Generator
    ) -> None:
        self._simulation = simulation
        self._rest = rest
        self._challenge = challenge
        self._rng = rng
        self._region = simulation.scene.manifest.goals
        self._may_use_shelf = challenge != "2D"
        self._any_orientation = challenge == "3D"

    def goal(self) -> Goal:
        for _ in range(MAX_SETTLINGS):
            drawn = self._draw()
            if (start := self._drop(drawn[0])) is None:
                continue
            if (end := self._drop(drawn[1])) is None:
                continue
            if self._is_acceptable(start, end):
                return self._render_goal(start, end)
        raise GoalSetError(
            f"{self._describe_request()}: none of {MAX_SETTLINGS} draws settled as required"
        )

    def _draw(self) -> tuple[Poses, Poses]:
        """Poses to drop from; they already respect the distances."""
        for _ in range(MAX_DRAWS):
            start, end = self._drop_poses(), self._drop_poses()
            if self._are_apart(start) and self._are_apart(end) and self._is_acceptable(start, end):
                return start, end
        raise GoalSetError(f"{self._describe_request()}: no room in {MAX_DRAWS} draws")

    def _describe_request(self) -> str:
        return (
            f"scene {self._simulation.scene.name} has no {self._challenge} goal "
            f"for {counted(len(self._rest), 'object')} within its goal region"
        )

    def _drop_poses(self) -> Poses:
        region, n = self._region, len(self._rest)
        low, high = region.table_low, region.table_high
        x_high = region.shelf_x_high if self._may_use_shelf else high[0]
        x = self._rng.uniform(low[0], x_high, n)
        y = self._rng.uniform(low[1], high[1], n)
        over_shelf = _is_over_shelf(x, region) if self._may_use_shelf else np.zeros(n, bool)
        z = np.where(over_shelf, region.shelf_drop_height, region.table_drop_height)
        orientations = _random_quaternions(self._rng, n) if self._any_orientation else self._rest
        return np.column_stack([x, y, z, orientations])

    def _drop(self, poses: Poses) -> Poses | None:
        """Where objects dropped from these poses come to rest; None if that is not acceptable."""
        try:
            settled = _settle(self._simulation, poses)
        except PhysicsError:  # objects of a 3D draw may begin inside one another
            return None
        if settled is None or not self._are_apart(settled):
            return None
        if self._any_orientation:
            return settled if _stays(self._simulation, settled) else None
        drift = _quaternion_distance(settled[:, 3:], self._rest)
        return settled if drift.max() <= MAX_DRIFT else None

    def _are_apart(self, poses: Poses) -> bool:
        """Whether the objects of one state keep their distance from one another."""
        if self._any_orientation:
            return True
        first, second = np.triu_indices(len(poses), k=1)
        between = poses[first, :3] - poses[second, :3]
        return bool((np.linalg.norm(between, axis=1) >= MIN_OBJECT_DISTANCE_M).all())

    def _is_acceptable(self, start: Poses, end: Poses) -> bool:
        """Whether start and goal differ enough, and use the shelf as the challenge says."""
        way = np.linalg.norm(start[:, :2] - end[:, :2], axis=1)
        uses_shelf = bool(_is_over_shelf(np.append(start[:, 0], end[:, 0]), self._region).any())
        return bool((way >= MIN_START_TO_GOAL_M).all()) and uses_shelf == self._may_use_shelf

    def _render_goal(self, start: Poses, end: Poses) -> Goal:
        self._simulation.reset(start)
        before = self._simulation.image()
        self._simulation.set_object_poses(end)  # no step was taken: the world is as good as fresh
        after = self._simulation.image()
        return Goal(self._challenge, start, end, before.retina, after.retina, after.mask)


def _settle(simulation: Simulation, poses: Poses) -> Poses | None:
    """Where objects dropped from these poses come to rest; None if they do not, or fall off."""
    simulation.reset(poses)
    now, n_quiet = poses, 0
    for _ in range(MAX_STEPS):
        simulation.hold(HOME, 1)
        before, now = now, simulation.object_poses()
        if simulation.n_put_back:
            return None
        moved = np.linalg.norm(now[:, :3] - before[:, :3], axis=1).max()
        turned = _quaternion_distance(now[:, 3:], before[:, 3:]).max()
        quiet = moved < SETTLED_POSITION_M and turned < SETTLED_QUATERNION
        n_quiet = n_quiet + 1 if quiet else 0
        if n_quiet == SETTLED_STEPS:
            return now
    return None


def _stays(simulation: Simulation, poses: Poses) -> bool:
    """Whether objects put at these poses, at rest, remain there."""
    simulation.reset(poses)
    simulation.hold(HOME, STAYS_STEPS)
    moved = np.linalg.norm(simulation.object_poses()[:, :3] - poses[:, :3], axis=1)
    return bool(moved.max() <= STAYS_WITHIN_M)


def _is_over_shelf(x: NDArray[np.float64], region: GoalRegion) -> NDArray[np.bool_]:
    return x > region.shelf_drop_from_x


def _quaternion_distance(a: Quaternions, b: Quaternions) -> NDArray[np.float64]:
    """Length of the difference of each pair; q and -q are the same orientation."""
    same, opposite = np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1)
    nearer: NDArray[np.float64] = np.minimum(same, opposite)
    return nearer


def _random_quaternions(rng: Generator, count: int) -> Quaternions:
    """Uniformly distributed orientations."""
    quaternions = rng.normal(size=(count, 4))
    unit: Quaternions = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    return unit


def _check_request(scene: Scene, counts: Mapping[str, int]) -> None:
    """Refuse impossible requests before anything is simulated."""
    if unknown := set(counts) - set(CHALLENGES):
        raise GoalSetError(
            f"unknown challenge {min(unknown)!r}: use one of {', '.join(CHALLENGES)}"
        )
    if min(counts.values(), default=0) < 0 or sum(counts.values()) < 1:
        raise GoalSetError(f"cannot draw {dict(counts)} goals: ask for at least one, none below 0")
    camera = scene.manifest.camera
    check_size(sum(counts.values()), camera.height, camera.width)
