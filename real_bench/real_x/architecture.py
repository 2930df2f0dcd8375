"""The blueprint of all REAL-X controllers (paper, section REAL-X blueprint, algorithm 1).

It explores while the benchmark records; then it turns the triplets into states, abstracts them,
and plans for each goal, again after every action.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from real_bench.actions import ACTION_STEPS, Action
from real_bench.controller import Controller, ControllerState
from real_bench.controls import control_of
from real_bench.errors import ControllerError
from real_bench.explanation import Explanation
from real_bench.lengths import TRIAL_STEPS
from real_bench.real_x.abstraction import N_LEVELS, DynamicAbstraction
from real_bench.real_x.explorer import RandomExplorer
from real_bench.real_x.home import plannable
from real_bench.real_x.perception import Perception
from real_bench.real_x.planner import DEPTH, Plan, Planner
from real_bench.real_x.triplets import Triplets
from real_bench.recording import Experience
from real_bench.settings import Settings
from real_bench.text.counting import counted

if TYPE_CHECKING:  # torch is only needed for curiosity
    from real_bench.real_x.curiosity import Curiosity

Abstractor = Callable[[Triplets], DynamicAbstraction]


class AbstractionSettings(Settings):
    """Settings of the Dynamic Abstraction.

    Attributes:
        levels: L, the number of levels of abstraction.
    """

    levels: int = Field(default=N_LEVELS, ge=2, le=100_000)


class PlannerSettings(Settings):
    """Settings of the planner.

    Attributes:
        depth: the most actions in a plan; never more than the trial has left of its ten.
    """

    depth: int = Field(DEPTH, ge=1, le=DEPTH)


class RealX(Controller):
    """Explorer, Abstractor and Planner, put together by a subclass.

    Args:
        action_space, observation_space: of the condition.
        perception: what states are made of.
        abstractor: makes levels of abstraction from triplets.
        depth: the most actions in a plan.
        curiosity: chooses among random actions at play; without it the first one is taken.
    """

    def __init__(
        self,
        action_space: Any,
        observation_space: Any,
        perception: Perception,
        abstractor: Abstractor,
        depth: int = DEPTH,
        curiosity: Curiosity | None = None,
    ) -> None:
        super().__init__(action_space, observation_space)
        self._perception, self._abstractor, self._depth = perception, abstractor, depth
        self._curiosity = curiosity
        self._planner: Planner | None = None
        self._actions_left: int | None = None  # of a trial; None: at play
        self._decision: tuple[NDArray[np.float64], NDArray[np.float64], Plan] | None = None
        self.seed(0)

    def seed(self, seed: int) -> None:
        """Begin the random sequence of this seed."""
        self._random = np.random.default_rng(seed)
        self._explorer = RandomExplorer(self.action_space, self._random)
        self._perception.seed(seed)
        if self._curiosity is not None:
            self._curiosity.seed(seed)

    def get_state(self) -> ControllerState:
        """Its place in its random sequence, and what it has learned to see."""
        state: ControllerState = {
            "random": self._random.bit_generator.state,
            "perception": self._perception.get_state(),
        }
        if self._curiosity is not None:
            state["curiosity"] = self._curiosity.get_state()
        return state

    def set_state(self, state: ControllerState) -> None:
        """Go on from there."""
        self._random.bit_generator.state = state["random"]
        self._perception.set_state(state["perception"])
        if self._curiosity is not None:
            self._curiosity.set_state(state["curiosity"])

    def resume_intrinsic_phase(self, experience: Experience) -> None:
        """Remember what was done before the interruption."""
        if self._curiosity is not None:
            self._curiosity.recall(experience)

    def use_experience(self, experience: Experience) -> None:
        """Abstract the triplets, and make a planner from those that can be planned with."""
        self._experience = experience
        self._plannable = plannable(experience)
        triplets = self._perception.triplets(experience)
        usable = Triplets(triplets.states[self._plannable], triplets.outcomes[self._plannable])
        self._planner = Planner(usable, self._abstractor(usable))

    def start_extrinsic_phase(self) -> None:
        """The tests begin; raises ControllerError if there is nothing to plan with."""
        if self._planner is None:
            raise ControllerError("it plans with recorded experience: give a recording with --run")

    def start_extrinsic_trial(self) -> None:
        """All of a trial's actions are left."""
        self._actions_left = TRIAL_STEPS // ACTION_STEPS

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        """At play: an action of the explorer. In a trial: the first action of a new plan."""
        if self._planner is None or self._actions_left is None:
            return self._explore(observation)
        state, goal = self._perception.state(observation), self._perception.goal(observation)
        depth = min(self._depth, max(1, self._actions_left))
        plan = self._planner.plan(state, goal, depth)
        self._decision = (state, goal, plan)
        self._actions_left -= 1
        return self._action(plan.triplets[0]) if plan.triplets else self._rest()

    def explain(self) -> Explanation | None:
        """Why it chose the last action."""
        if self._planner is None or self._decision is None:
            return None
        state, goal, plan = self._decision
        predicted = self._planner.triplets.outcomes[list(plan.triplets)]
        levels = self._planner.abstraction.thresholds
        facts = {
            "level": plan.level,
            "thresholds": None if plan.level is None else levels[plan.level].tolist(),
            "plan": self._plannable[list(plan.triplets)].tolist(),
            "plan_length": len(plan.triplets),
            "nodes_expanded": plan.n_expanded,
            "state": state.tolist(),
            "goal": goal.tolist(),
            "predicted": predicted.tolist(),
        }
        actions = tuple(map(self._action, plan.triplets))
        return Explanation(_title(plan), facts, actions, self._perception.positions(predicted))

    def _explore(self, observation: Mapping[str, Any]) -> Action:
        if self._curiosity is None:
            return self._explorer.next_action()
        return self._curiosity.choose(observation, self._explorer.next_action)

    def _action(self, triplet: int) -> Action:
        return self._experience.action(int(self._plannable[triplet]))

    def _rest(self) -> Action:
        """No command for one action."""
        return control_of(self.action_space).rest()


def _title(plan: Plan) -> str:
    if plan.level is None:
        return "no plan at any level: rests"
    if plan.is_at_goal:
        return f"at the goal on level {plan.level}: rests"
    n = len(plan.triplets)
    return f"level {plan.level}: {counted(n, 'action')}, {plan.n_expanded} nodes"
