"""Free play: its own goals, actions that objects are expected to follow, and their outcomes.

Everything it learns follows from the seed and from what happened. So when a run is resumed, its
memory comes from the recording.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from real_bench.real_g.arrays import Array
from real_bench.real_g.goals import SelfGeneratedGoals
from real_bench.real_g.hand import Primitive
from real_bench.real_g.memory import ActionMemory, sample_near_object, sample_scales
from real_bench.real_g.relation import Relation
from real_bench.real_g.skill import Skill
from real_bench.settings import Settings

log = logging.getLogger(__name__)

MEMORY_EXPONENT = 2
"""Memory uses this power of an action's contingency, to repeat only what went all the way."""


class PlaySettings(Settings):
    """How it plays.

    Attributes:
        first: actions before the first lesson; also the fewest between two lessons.
        growth: it learns again when it has this share more actions than at the last lesson.
        random: the share of actions drawn at random near an object.
        bred: the share of actions that are variations of remembered ones, whatever is expected.
        near: the share of goals near the object.
        anywhere: the share of goals drawn anywhere, whether or not there is anything to learn.
        high: the share of goals that say how high to carry the object there, if the hand can.
        candidates: actions considered before one is taken.
        fresh: the share of these that do not come from memory.
        steps: of training in a lesson, per action that it learns from.
        fewest_steps, most_steps: of training in a lesson, however many actions there are.
        last_steps: of training at the end of play.
    """

    first: int = Field(200, ge=1)
    growth: float = Field(0.15, ge=0)
    random: float = Field(0.1, ge=0, le=1)
    bred: float = Field(0.45, ge=0, le=1)
    near: float = Field(0.25, ge=0, le=1)
    anywhere: float = Field(0.0, ge=0, le=1)
    high: float = Field(0.5, ge=0, le=1)
    candidates: int = Field(500, ge=1)
    fresh: float = Field(0.3, ge=0, le=1)
    steps: float = Field(1.0, gt=0)
    fewest_steps: int = Field(300, ge=10)
    most_steps: int = Field(3000, ge=10)
    last_steps: int = Field(6000, ge=10)

    @model_validator(mode="after")
    def _shares_of_a_whole(self) -> PlaySettings:
        for one, other in (("random", "bred"), ("near", "anywhere")):
            if getattr(self, one) + getattr(self, other) > 1:
                raise ValueError(f"{one} and {other} together must be at most 1")
        return self


class Play:
    """What was done, its outcomes, and how to continue playing.

    Args:
        primitive: the form of the actions.
        settings: how it plays.
        seed: of all that is learned.
    """

    def __init__(self, primitive: Primitive, settings: PlaySettings, seed: int) -> None:
        self.primitive, self._settings, self._seed = primitive, settings, seed
        self.relation = Relation(primitive)
        ends = list(primitive.end)
        self._low, self._high = primitive.low[ends], primitive.high[ends]
        self.skills: list[Skill] = []
        self._memories: list[ActionMemory] = []
        self.n_learned = 0  # the actions that it has learned from
        self.goals = SelfGeneratedGoals(self._low, self._high)

    def _memory(self, o: int) -> ActionMemory:
        while len(self._memories) <= o:
            self._memories.append(ActionMemory(self.relation))
        return self._memories[o]

    def _skill(self, o: int) -> Skill:
        return Skill(self.relation, self._memory(o), self._seed + o, self._settings.fresh)

    def lesson_due(self, n: int) -> int:
        """From how many of n actions it should have learned.

        Lessons come at the same numbers whether or not a run was interrupted.
        """
        last, following = 0, self._settings.first
        while following <= n:
            last = following
            following = last + max(self._settings.first, int(self._settings.growth * last))
        return last

    def learn(self, before: Array, after: Array, parameters: Array) -> None:
        """Learn again from n actions, as :meth:`samples` takes them, what objects follow."""
        self.n_learned = len(parameters)
        log.info("learning from %d actions", len(parameters))
        samples, settings = self.samples(before, after, parameters), self._settings
        self.skills = [self._skill(o) for o in range(len(samples))]
        for skill, sample in zip(self.skills, samples, strict=True):
            steps = settings.steps * len(sample[0])
            skill.learn(*sample, int(np.clip(steps, settings.fewest_steps, settings.most_steps)))

    def samples(
        self, before: Array, after: Array, parameters: Array
    ) -> list[tuple[Array, Array, Array]]:
        """For each object its rows before and after the actions about it, and their parameters.

        Args:
            before: all objects' rows, (n, n_objects, 3 or 7); unknown ones are left out.
            after: their rows after each.
            parameters: of the actions, (n, P); NaN where they are not of the primitive's form.
        """
        nearest_objects = self.nearest_objects(before, parameters)
        samples = []
        for o in range(before.shape[1]):
            known = ~np.isnan(before[:, o]).any(axis=1) & ~np.isnan(after[:, o]).any(axis=1)
            relevant = (nearest_objects == o) & known & ~np.isnan(parameters).any(axis=1)
            samples.append((before[relevant, o], after[relevant, o], parameters[relevant]))
        return samples

    def restore(self, skills: Sequence[Mapping[str, Any]], n_learned: int) -> None:
        """Restore what was learned from ``n_learned`` actions."""
        self.n_learned = n_learned
        self.skills = [self._skill(o) for o in range(len(skills))]
        for skill, state in zip(self.skills, skills, strict=True):
            skill.set_state(state)

    def nearest_objects(self, before: Array, parameters: Array) -> NDArray[np.int64]:
        """Which object each action is about, (n,): that nearest to where it begins."""
        if before.shape[1] == 0:
            return np.zeros(len(before), np.int64)
        start = parameters[:, None, list(self.primitive.start)]
        distances = np.linalg.norm(before[:, :, :2] - start, axis=2)
        return np.asarray(np.where(np.isnan(distances), np.inf, distances).argmin(axis=1))

    def observe(self, before: Array, after: Array, parameters: Array) -> None:
        """Learn for its own goals from one action: where objects were, how well it went.

        Args:
            before: all objects' rows, (n_objects, 3 or 7).
            after: their rows after it.
            parameters: of the action, (P,), NaN where they are not known.
        """
        positions = np.concatenate([before[:, :2], after[:, :2]])
        self.goals.observe(positions[~np.isnan(positions).any(axis=1)])
        if len(before) == 0 or np.isnan(parameters).any():
            return
        o = int(self.nearest_objects(before[None], parameters[None])[0])
        success = self.relation.contingency(before[None, o], after[None, o], parameters[None])[0]
        if np.isfinite(success):
            self._memory(o).record(before[o], parameters, float(success) ** MEMORY_EXPONENT)
            self.goals.record_attempt(parameters[list(self.primitive.end)], float(success))

    def propose(self, number: int, row: Array, ends: Array, random: np.random.Generator) -> Array:
        """Actions for an object at a row, (n, P), that end the hand at (n, 2) positions."""
        goals = self.relation.goals(ends, random, self._settings.high)
        return self.skills[number].propose(row, goals, random)

    def next_parameters(self, rows: Array, random: np.random.Generator) -> Array:
        """Of the next action, (P,).

        Args:
            rows: of the objects now, (n_objects, 3 or 7); none or NaN where nothing is seen.
            random: draws.
        """
        visible = np.flatnonzero(~np.isnan(rows).any(axis=1)) if len(rows) else np.empty(0, int)
        if not len(visible):
            return random.uniform(self.primitive.low, self.primitive.high)
        settings = self._settings
        number = int(random.choice(visible))
        row = rows[number]
        goal = self.goals.draw(random)
        kind = random.random()
        if kind < settings.near:
            reach = float((self._high - self._low).mean())
            goal = row[:2] + random.normal(size=2) * reach * sample_scales(1, random)
        elif kind < settings.near + settings.anywhere:
            goal = random.uniform(self._low, self._high)
        ends = np.clip(goal, self._low, self._high)[None]
        goals = self.relation.goals(ends, random, settings.high).repeat(settings.candidates, axis=0)
        skill = self.skills[number] if number < len(self.skills) else None
        chance = random.random()
        if skill is None or not skill.has_learned or chance < settings.random:
            return np.asarray(sample_near_object(self.relation, row, goals[:1], random)[0])
        if chance < settings.random + settings.bred and skill.memory.families:
            return np.asarray(skill.memory.sample_variations(row, goals[:1], random)[0])
        parameters = skill.propose(row, goals, random)
        return np.asarray(parameters[skill.most_contingent(row, parameters, random)])
