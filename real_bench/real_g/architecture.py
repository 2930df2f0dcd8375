"""REAL-G: plays with its own goals, learns what its actions do to objects, and plans with that."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from real_bench.actions import Action
from real_bench.controller import Controller, ControllerState
from real_bench.errors import ControllerError
from real_bench.explanation import Explanation
from real_bench.lengths import TRIAL_STEPS
from real_bench.real_g.arrays import Array
from real_bench.real_g.babble import MotorBabbling
from real_bench.real_g.hand import Primitive
from real_bench.real_g.model_planner import ModelPlanner, PlannerSettings
from real_bench.real_g.perception import Perception
from real_bench.real_g.planner import Choice, Planner
from real_bench.real_g.play import Play, PlaySettings
from real_bench.real_g.replay import ReplayPlanner
from real_bench.recording import Experience

Wander = Callable[[np.random.Generator], Action]

MAX_IDLE = 20
"""After so many actions that changed nothing, one by one, it does something else."""


class RealG(Controller):
    """Plays, learns and plans; a subclass chooses the perception.

    Args:
        action_space, observation_space: of the condition.
        primitive: the form of its actions.
        perception: where objects are.
        play: how it plays.
        planner: how it plans with a model.
        wander: an action that may move an object wherever it is, for when its own do not; None: it
            has no such action.
    """

    def __init__(
        self,
        action_space: Any,
        observation_space: Any,
        primitive: Primitive,
        perception: Perception,
        play: PlaySettings,
        planner: PlannerSettings,
        wander: Wander | None = None,
    ) -> None:
        super().__init__(action_space, observation_space)
        self._primitive, self._wander = primitive, wander
        self._perception, self._play_settings, self._planner_settings = perception, play, planner
        self._planners: list[Planner] = []  # one per object, once play is over
        self._n_left: int | None = None  # actions that a trial has left; None: at play
        self._decision: tuple[int, Choice] | None = None
        self._acted: tuple[int, Array, Array] | None = None  # object, its row, action of a trial
        self._has_learned = False  # play is over, and everything was learned
        self.seed(0)

    def seed(self, seed: int) -> None:
        """Begin the random sequence of this seed; what was learned stays."""
        self._random = np.random.default_rng(seed)
        if not self._has_learned:
            self._perception.seed(seed)
            self._begin(seed)

    def get_state(self) -> ControllerState:
        """Its place in its random sequence, and what it learned at the end of play."""
        return {
            "random": self._random.bit_generator.state,
            "seed": self._seed,
            "perception": self._perception.get_state(),
            "lesson": self._play.n_learned if self._has_learned else None,
            "skills": [skill.get_state() for skill in self._play.skills]
            if self._has_learned
            else [],
            "planners": [planner.get_state() for planner in self._planners],
        }

    def set_state(self, state: ControllerState) -> None:
        """Go on from there."""
        self._begin(state["seed"])
        self._random.bit_generator.state = state["random"]
        self._perception.set_state(state["perception"])
        if state["lesson"] is not None:
            self._play.restore(state["skills"], state["lesson"])
            self._planners = self._new_planners(len(state["planners"]))
            for planner, learned in zip(self._planners, state["planners"], strict=True):
                planner.set_state(learned)
            self._has_learned = True

    def resume_intrinsic_phase(self, experience: Experience) -> None:
        """Remember what was done before the interruption, and learn it again."""
        self._recall(experience)
        if lesson_due := self._play.lesson_due(len(self._outcomes)):
            self._learn(lesson_due)

    def use_experience(self, experience: Experience) -> None:
        """Learn from all of it, if not done yet and if there is anything."""
        n = len(experience)
        if n == 0 or (self._has_learned and self._play.n_learned == n):
            return
        self._recall(experience)
        self._learn(len(self._outcomes))
        self._learn_to_plan()
        self._has_learned = True

    def start_extrinsic_phase(self) -> None:
        """The tests begin; raises ControllerError where it has learned nothing."""
        if not self._has_learned:
            raise ControllerError(
                "it plans with what it learned at play: give a recording with --run, of one "
                "action at least"
            )

    def start_extrinsic_trial(self) -> None:
        """All of a trial's actions are left."""
        self._n_left = TRIAL_STEPS // self._primitive.steps
        self._acted = None
        for planner in self._planners:
            planner.start_trial()

    def next_action(self, observation: Mapping[str, Any]) -> Action:
        """At play: an action that an object may follow. In a trial: the one that helps most."""
        if self._n_left is None:
            return self._explore(observation)
        self._n_left = max(0, self._n_left - 1)
        rows, goals = self._perception.state(observation), self._perception.goal(observation)
        self._observe_trial(rows)
        self._decision = self._best(rows, goals, self._n_left)
        if self._decision is None or self._decision[1].gain <= 0:
            return self._primitive.rest()
        number, choice = self._decision
        self._acted = number, rows[number], choice.parameters
        return self._primitive.action(choice.parameters)

    def explain(self) -> Explanation | None:
        """Why it chose the last action."""
        if self._decision is None:
            return None
        number, choice = self._decision
        facts = {
            "object": number,
            "distance": choice.distance_now,
            "expected_at_last": choice.expected_distance,
            "expected_end": choice.expected_end.tolist(),
            "numbers": choice.parameters.tolist(),
        }
        sentence = (
            f"{choice.distance_now:.3f} m from its goal, "
            f"{choice.expected_distance:.3f} m expected in the end"
        )
        if choice.gain <= 0:
            return Explanation(f"nothing improves: rests; object {number} is {sentence}", facts)
        return Explanation(
            f"object {number}: {sentence}", facts, (self._primitive.action(choice.parameters),)
        )

    def _observe_trial(self, rows: Array) -> None:
        """Show a planner what the last action of the trial did."""
        if self._acted is not None:
            number, before, parameters = self._acted
            if np.isfinite(rows[number]).all():
                self._planners[number].observe(before, rows[number], parameters)
        self._acted = None

    def _best(self, rows: Array, goals: Array, n_left: int) -> tuple[int, Choice] | None:
        """The object and the action with the largest gain."""
        choices = [
            (number, self._choose(number, row, goal, n_left))
            for number, (planner, row, goal) in enumerate(
                zip(self._planners, rows, goals, strict=False)
            )
            if planner.has_learned and np.isfinite(row).all() and np.isfinite(goal).all()
        ]
        return max(choices, key=lambda choice: choice[1].gain, default=None)

    def _choose(self, number: int, row: Array, goal: Array, n_left: int) -> Choice:
        def propose(row: Array, ends: Array) -> Array:
            return self._play.propose(number, row, ends, self._random)

        return self._planners[number].choose(row, goal, n_left, propose, self._random)

    def _explore(self, observation: Mapping[str, Any]) -> Action:
        self._see(observation)
        n = len(self._outcomes)
        if self._play.lesson_due(n) > self._play.n_learned:
            self._learn(self._play.lesson_due(n))
        if self._wander is not None and self._n_idle >= MAX_IDLE:
            action = self._wander(self._random)
        else:
            rows = self._perception.rows(self._n_seen - 1)[0]
            action = self._primitive.action(self._next_parameters(rows))
        parameters = self._parameters_of(action)
        self._perception.act(self._path(parameters))
        self._parameters.append(parameters)
        self._preconditions.append(self._n_seen - 1)
        return action

    def _next_parameters(self, rows: Array) -> Array:
        if np.isnan(rows).all():  # nothing is seen, or nothing known to look for
            return self._babbling.next_parameters(self._random)
        return self._play.next_parameters(rows, self._random)

    def _parameters_of(self, action: Action) -> Array:
        """Its parameters as a recording tells them, (P,); NaN if it has another form.

        They may differ from those that made it: without a way to rise, nothing tells its share.
        """
        parameters = self._primitive.parameters(action)
        return np.full(len(self._primitive.low), np.nan) if parameters is None else parameters

    def _begin(self, seed: int) -> None:
        """Begin with an empty memory; the seed is of all that is learned."""
        self._seed = seed
        self._play = Play(self._primitive, self._play_settings, seed)
        self._planners = []
        self._babbling = MotorBabbling(self._primitive)
        self._parameters: list[Array] = []
        self._preconditions: list[int] = []
        self._outcomes: list[int] = []
        self._n_seen = 0  # moments of the play
        self._n_idle = 0  # latest actions that changed nothing
        self._has_learned = False

    def _see(self, observation: Mapping[str, Any]) -> None:
        self._perception.see(observation)
        self._n_seen += 1
        if len(self._preconditions) > len(self._outcomes):  # it acted: this is the outcome
            self._outcomes.append(self._n_seen - 1)
            self._n_idle += 1
            if self._perception.changed():
                self._n_idle = 0
                self._babbling.record_effective(self._parameters[-1])
            self._observe_outcome(self._perception.rows(self._n_seen - 2), -1)

    def _observe_outcome(self, rows: Array, action: int) -> None:
        """Learn for its goals from an action; the rows are those of its two moments."""
        self._play.observe(rows[0], rows[1], self._parameters[action])

    def _learn(self, n: int) -> None:
        """Learn again from the first n actions what objects follow."""
        self._play.learn(*self._known(n))

    def _known(self, n: int) -> tuple[Array, Array, Array]:
        """Of the first n actions: all objects' rows before and after, and parameters."""
        rows = self._perception.rows()
        before, after = self._preconditions[:n], self._outcomes[:n]
        return rows[before], rows[after], np.array(self._parameters[:n])

    def _learn_to_plan(self) -> None:
        """Learn from all actions what they do."""
        samples = self._play.samples(*self._known(len(self._outcomes)))
        self._planners = self._new_planners(len(samples))
        for planner, sample in zip(self._planners, samples, strict=True):
            planner.learn(*sample)

    def _new_planners(self, n: int) -> list[Planner]:
        """One for each of n objects."""
        relation = self._play.relation
        if self._primitive.place_scale is not None:
            return [ReplayPlanner(relation) for _ in range(n)]
        steps, settings = self._play_settings.last_steps, self._planner_settings
        return [ModelPlanner(relation, self._seed + o, steps, settings) for o in range(n)]

    def _recall(self, experience: Experience) -> None:
        """Remember a whole play, and the goals that follow from it."""
        self._begin(self._seed)
        actions = map(experience.action, range(len(experience)))
        self._parameters = list(map(self._parameters_of, actions))
        self._preconditions = experience.preconditions.tolist()
        self._outcomes = experience.outcomes.tolist()
        self._n_seen = experience.n_states
        self._perception.recall(experience, self._path_of)
        rows = self._perception.rows()
        for action, moments in enumerate(zip(self._preconditions, self._outcomes, strict=True)):
            self._observe_outcome(rows[list(moments)], action)

    def _path_of(self, action: Action) -> Array | None:
        return self._path(self._parameters_of(action))

    def _path(self, parameters: Array) -> Array | None:
        return None if np.isnan(parameters).any() else self._primitive.path(parameters)
