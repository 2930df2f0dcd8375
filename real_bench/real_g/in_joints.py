"""REAL-G in joints: watches its own hand first, then plays with pushes through what it learned."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from real_bench.actions import Action
from real_bench.controller import Controller, ControllerState
from real_bench.errors import ControllerError
from real_bench.explanation import Explanation
from real_bench.real_g.architecture import RealG
from real_bench.real_g.joint_push import JointPush
from real_bench.real_g.model_planner import PlannerSettings
from real_bench.real_g.play import PlaySettings
from real_bench.real_g.seen_images import ImagePerception
from real_bench.real_g.watching import Watching, WatchingSettings
from real_bench.recording import Experience


class RealGInJoints(Controller):
    """Watches its hand, then hands over to REAL-G with pushes in the coordinates of what it saw.

    Objects are always found in images, since positions in metres are not the hand's coordinates.

    Args:
        action_space, observation_space: of a condition with joints.
        watching: how much it watches its hand first.
        play: how it plays.
        planner: how it plans.
    """

    uses_images = True

    def __init__(
        self,
        action_space: Any,
        observation_space: Any,
        watching: WatchingSettings,
        play: PlaySettings,
        planner: PlannerSettings,
    ) -> None:
        super().__init__(action_space, observation_space)
        self._spaces = action_space, observation_space
        self._watching_settings, self._play_settings, self._planner_settings = (
            watching,
            play,
            planner,
        )
        self._play: RealG | None = None
        self.seed(0)

    def seed(self, seed: int) -> None:
        """Begin the random sequence of this seed; what was learned stays."""
        self._seed = seed
        if self._play is None:
            self._watching = self._new_watching(seed)
        else:
            self._play.seed(seed)

    def get_state(self) -> ControllerState:
        """What it has watched, and the state of REAL-G once that plays."""
        return {
            "seed": self._seed,
            "watching": self._watching.get_state(),
            "play": None if self._play is None else self._play.get_state(),
        }

    def set_state(self, state: ControllerState) -> None:
        """Go on from there."""
        self._seed, self._play = state["seed"], None
        self._watching = self._new_watching(self._seed)
        self._watching.set_state(state["watching"])
        if state["play"] is not None:
            self._play = self._new_play()
            self._play.set_state(state["play"])

    def resume_intrinsic_phase(self, experience: Experience) -> None:
        """Remember what was done after it had watched; what it watched is in its state."""
        if self._play is not None:
            self._play.resume_intrinsic_phase(experience.since(self._watching.n_actions))

    def use_experience(self, experience: Experience) -> None:
        """Learn from what was done after it had watched, if not done yet."""
        if self._play is not None:
            self._play.use_experience(experience.since(self._watching.n_actions))

    def start_extrinsic_phase(self) -> None:
        """The tests begin; raises ControllerError where it has not watched its hand to the end."""
        if self._play is None:
            raise ControllerError(
                "it needs its own whole play, in which it watched its hand to the end: give that "
                "with --run, without --run-steps or --relearn"
            )
        self._play.start_extrinsic_phase()

    def start_extrinsic_trial(self) -> None:
        """All of a trial's actions are left."""
        if self._play is not None:
            self._play.start_extrinsic_trial()

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        """A posture to watch; later what REAL-G does."""
        if self._play is None:
            action = self._watching.next_action(observation)
            if action is not None:
                return action
            self._play = self._new_play()
            self._play.seed(self._seed)
        return self._play.next_action(observation)

    def explain(self) -> Explanation | None:
        """Why it chose the last action."""
        return None if self._play is None else self._play.explain()

    def _new_watching(self, seed: int) -> Watching:
        return Watching(self._spaces[0], self._watching_settings, seed)

    def _new_play(self) -> RealG:
        primitive = JointPush(self._watching.planes())
        ends = list(primitive.end)
        perception = ImagePerception(
            primitive.low[ends], primitive.high[ends], self._watching.image_map
        )
        return RealG(
            *self._spaces,
            primitive,
            perception,
            self._play_settings,
            self._planner_settings,
            self._watching.sweep,
        )
