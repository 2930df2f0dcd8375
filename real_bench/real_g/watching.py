"""The robot watches its own hand at the beginning of its play, until it knows how to place it.

First the gripper opens and closes in random postures, which shows what the hand looks like. Then
random postures are tried. Those that take little effort and are near the ground become the first of
inverse maps, which goal babbling extends; the one that reaches most is kept, and refined where
pushes need it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from real_bench.actions import Action
from real_bench.real_g.arrays import Array
from real_bench.real_g.hand_sight import HandSight
from real_bench.real_g.reach import Planes, Reach, Refinement
from real_bench.settings import Settings

N_ARM = 7
"""The joints of the arm; the other two are the gripper's, of which the first one opens it."""

SETTLE, GRIP, RETURN = 100, 70, 320
"""Steps that a posture, the gripper, and the way home take."""

N_SWEEP = 6
"""Random postures in a sweep."""

BENT_SHARE = 0.5
"""Of the joints in a random posture; the others are straight."""

MAX_DEVIATION = 0.15
"""An arm that is blocked is farther than this from its posture, radians."""

CLOSENESS = 4.0
"""What a ground's distance costs a first posture; one joint bent all the way costs 1."""

GROUND_STEP = 4


class WatchingSettings(Settings):
    """How much it watches its hand.

    Attributes:
        grips: random postures in which the gripper opens and closes.
        random: random postures after that.
        starts: of these, the ones from which maps are begun.
        tried: postures that extend each of these maps.
        reached: postures that then extend the one that reaches most.
        grid: nodes along each side of the grid of postures that pushes use.
        refined: how often each of these is tried and corrected.
    """

    grips: int = Field(60, ge=1)
    random: int = Field(600, ge=1)
    starts: int = Field(12, ge=1)
    tried: int = Field(150, ge=1)
    reached: int = Field(2500, ge=1)
    grid: int = Field(11, ge=4)
    refined: int = Field(4, ge=1)


class Watching:
    """Decides which postures to watch.

    Args:
        action_space: of a condition with joints.
        settings: how much it watches.
        seed: of its random draws.
    """

    def __init__(self, action_space: Any, settings: WatchingSettings, seed: int) -> None:
        self._settings = settings
        box = action_space.spaces["joint_command"]
        self._low, self._high = box.low[:N_ARM], box.high[:N_ARM]
        self._closed, self._open = box.low[N_ARM:], np.array([box.high[N_ARM], box.low[N_ARM + 1]])
        self._random = np.random.default_rng(seed)
        self._reaches: list[Reach] = []
        self._refinement: Refinement | None = None
        self._image_map = np.zeros((3, 2))
        self._sight: HandSight | None = None
        self._ground = np.zeros((0, 3))
        self._first = np.zeros((0, 3 + N_ARM))  # points and random postures
        self._posture = np.zeros(N_ARM)  # the last one
        self._target: Array | None = None
        self._image, self._depth = np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.float32)
        self._stage, self._count = "begin", 0
        self.n_actions = 0

    def next_action(self, observation: Mapping[str, Any]) -> Action | None:
        """Looks at what came of the last action; the next one, or None if all is watched."""
        self._look(observation)
        action = self._act()
        self.n_actions += action is not None
        return action

    def sweep(self, random: np.random.Generator) -> Action:
        """Through random postures, and home: it may meet an object that no push reaches."""
        arm = np.array([self._random_posture(random) for _ in range(N_SWEEP)])
        commands = np.zeros((N_SWEEP + 1, N_ARM + 2))
        commands[:-1, :N_ARM], commands[:-1, N_ARM:] = arm, self._closed
        n_steps = np.array([SETTLE] * N_SWEEP + [RETURN])
        return Action(commands, n_steps, np.zeros(len(commands), bool))

    def _random_posture(self, random: np.random.Generator) -> Array:
        bent = random.random(N_ARM) < BENT_SHARE
        return np.asarray(random.uniform(self._low, self._high) * bent)

    def planes(self) -> Planes:
        """Where postures put the hand."""
        assert self._refinement is not None
        return self._refinement.planes()

    @property
    def image_map(self) -> Array:
        """Where things are that are seen, as :attr:`HandSight.image_map`."""
        return self._image_map

    def get_state(self) -> dict[str, Any]:
        """All of it."""
        return {
            "random": self._random.bit_generator.state,
            "reaches": [reach.get_state() for reach in self._reaches],
            "refinement": None if self._refinement is None else self._refinement.get_state(),
            "image_map": self._image_map,
            "sight": None if self._sight is None else self._sight.get_state(),
            "first": self._first,
            "posture": self._posture,
            "target": self._target,
            "image": self._image,
            "depth": self._depth,
            "stage": self._stage,
            "count": self._count,
            "actions": self.n_actions,
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Go on from there."""
        self._random.bit_generator.state = state["random"]
        self._reaches = [Reach(self._low, self._high) for _ in state["reaches"]]
        for reach, reached in zip(self._reaches, state["reaches"], strict=True):
            reach.set_state(reached)
        self._refinement = None
        if state["refinement"] is not None:
            self._refinement = Refinement(self._reaches[0], self._settings.grid)
            self._refinement.set_state(state["refinement"])
        self._image_map = np.asarray(state["image_map"], np.float64)
        if state["sight"] is not None:
            self._begin_sight(HandSight.from_state(state["sight"]))
        self._first = np.asarray(state["first"], np.float64).reshape(-1, 3 + N_ARM)
        self._posture = np.asarray(state["posture"], np.float64)
        self._target = None if state["target"] is None else np.asarray(state["target"], np.float64)
        self._image = np.asarray(state["image"], np.uint8)
        self._depth = np.asarray(state["depth"], np.float32)
        self._stage, self._count = state["stage"], state["count"]
        self.n_actions = state["actions"]

    def _begin_sight(self, sight: HandSight) -> None:
        self._sight, self._ground = sight, sight.ground_points(GROUND_STEP)
        self._image_map = sight.image_map

    def _look(self, observation: Mapping[str, Any]) -> None:
        """Learn from what the last action led to, and decide what is next."""
        if self._stage == "ground":
            self._begin_sight(HandSight(observation["depth"]))
            self._stage = "closed"
        elif self._stage == "closed":
            self._image, self._depth = observation["retina"], observation["depth"]
            self._stage = "open"
        elif self._stage == "open":
            self._compare(observation["depth"])
        elif self._stage == "random":
            self._observe_random(observation)
        elif self._stage == "reach":
            self._observe_reach(observation)
        elif self._stage == "refine":
            self._observe_refined(observation)
        elif self._stage == "home":
            self._stage, self._sight = "over", None

    def _act(self) -> Action | None:
        """The action of this stage."""
        if self._stage == "begin":
            self._stage = "ground"
            return Action.rest(N_ARM + 2, RETURN)
        if self._stage == "open":
            return self._hold(self._open, GRIP)
        if self._stage in ("closed", "random"):
            self._posture = self._random_posture(self._random)
            return self._hold(self._closed, SETTLE)
        if self._stage == "reach":
            reach = self._reaches[self._current]
            self._target = reach.next_target(self._ground, self._random)
            self._posture = reach.explore(self._target, self._random)
            return self._hold(self._closed, SETTLE)
        if self._stage == "refine":
            assert self._refinement is not None
            self._posture = self._refinement.posture(self._count % len(self._refinement))
            return self._hold(self._closed, SETTLE)
        return Action.rest(N_ARM + 2, RETURN) if self._stage == "home" else None

    def _hold(self, gripper: Array, n_steps: int) -> Action:
        return Action.hold(np.concatenate([self._posture, gripper]), n_steps)

    def _compare(self, wide: NDArray[Any]) -> None:
        assert self._sight is not None
        self._sight.compare(self._image, self._depth, wide)
        self._image, self._depth = np.zeros((0, 0, 3), np.uint8), np.zeros((0, 0), np.float32)
        self._count += 1
        self._stage = "closed" if self._count < self._settings.grips else "random"

    def _observe_random(self, observation: Mapping[str, Any]) -> None:
        point = self._find(observation)
        if point is not None:
            self._first = np.vstack([self._first, [*point, *self._posture]])
        self._count += 1
        if self._count >= self._settings.grips + self._settings.random and len(self._first):
            self._begin_maps()
            self._count, self._stage = 0, "reach"

    def _observe_reach(self, observation: Mapping[str, Any]) -> None:
        point, reach = self._find(observation), self._reaches[self._current]
        if point is not None and reach.is_near(point, self._target):
            reach.add(point, self._posture)
        self._count += 1
        if len(self._reaches) > 1:
            if self._count == self._settings.tried * len(self._reaches):
                self._reaches = [max(self._reaches, key=lambda reach: reach.coverage)]
                self._count = self._settings.tried
        elif self._count == self._settings.tried + self._settings.reached:
            self._refinement = Refinement(reach, self._settings.grid)
            self._count, self._stage = 0, "refine"

    def _observe_refined(self, observation: Mapping[str, Any]) -> None:
        assert self._refinement is not None
        number = self._count % len(self._refinement)
        self._refinement.observe(number, self._find(observation), self._posture)
        self._count += 1
        if self._count == self._settings.refined * len(self._refinement):
            self._stage = "home"

    @property
    def _current(self) -> int:
        """Which map is being extended."""
        return self._count // self._settings.tried if len(self._reaches) > 1 else 0

    def _find(self, observation: Mapping[str, Any]) -> Array | None:
        """Where the hand is seen; None if it is not, or the arm is blocked."""
        assert self._sight is not None
        deviation = np.abs(observation["joint_positions"][:N_ARM] - self._posture).max()
        if deviation > MAX_DEVIATION:
            return None
        return self._sight.find(observation["retina"], observation["depth"])

    def _begin_maps(self) -> None:
        """From the random postures that take the least effort and are near the ground."""
        points, postures = self._first[:, :3], self._first[:, 3:]
        effort = ((postures / self._high) ** 2).sum(axis=1)
        offsets = points[:, None] - self._ground[None]
        effort += CLOSENESS * np.linalg.norm(offsets, axis=2).min(axis=1)
        for number in np.argsort(effort, kind="stable")[: self._settings.starts]:
            reach = Reach(self._low, self._high)
            reach.add(points[number], postures[number])
            self._reaches.append(reach)
