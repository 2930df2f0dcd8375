"""Actions that went well, relative to the object, so that they apply wherever it is.

A rare action that works well beats one that usually works a little only after practice: the second
attempt at it mostly fails. So whatever goes surprisingly well founds a family, and a family is
tried again, varied a little, as long as its latest members do well (local adaptation: Kim, Coninx
and Doncieux 2021).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from real_bench.errors import RealBenchError
from real_bench.real_g.arrays import Array
from real_bench.real_g.hand import Primitive
from real_bench.real_g.relation import Relation, random_distance, rotate

MAX_SCALE, MIN_SCALE = 0.5, 0.005
"""How near to an object random actions begin, in shares of a range."""

MAX_VARIATION = 0.1
"""Remembered actions are varied by shares of a parameter's range from ``MIN_SCALE`` to this."""

N_REDRAWN = 0.5
"""On average, this many parameters of a remembered action are drawn anew from their whole range."""

RECENT, N_ALIKE = 2000, 40
"""Of so many latest actions, success is surprising relative to so many in the most similar
situations; with fewer nothing is."""

NEAR = 0.3
"""Situations this far apart, in ranges of their parameters, still inform each other."""

PRIOR_WEIGHT = 10.0
"""All members in all situations count as much as this many in the same situation."""

EPSILON = 1e-3


@dataclass
class Family:
    """An action that went surprisingly well, and the latest ones that were like it.

    Attributes:
        founder: parameters of the first one, relative to the object, (P,).
        members: such parameters, the latest last.
        situations: where the object was and where it should go, for each.
        successes: how well each went, 0 to 1.
    """

    founder: Array
    members: list[Array] = field(default_factory=list)
    situations: list[Array] = field(default_factory=list)
    successes: list[float] = field(default_factory=list)

    def add(self, member: Array, situation: Array, success: float, n_members: int) -> None:
        """One more; when there are too many, an older one goes."""
        self.members.append(member)
        self.situations.append(situation)
        self.successes.append(success)
        if len(self.members) > n_members:
            self._forget()

    def _forget(self) -> None:
        """Of the older half, one goes whose situation is like most others': rare ones stay."""
        older = np.array(self.situations[: len(self.situations) // 2])
        crowded = int(self._nearness(older).sum(axis=1).argmax())
        for values in (self.members, self.situations, self.successes):
            del values[crowded]

    @property
    def mean(self) -> float:
        """The success of its members, with one success and one failure added."""
        return (1 + sum(self.successes)) / (2 + len(self.successes))

    def counts(self, situations: Array) -> Array:
        """Successes and failures in n situations, (2, n).

        The less similar a member's situation is, the less the member counts. All members in all
        situations together count as much as ``PRIOR_WEIGHT`` members.
        """
        near, success = self._nearness(situations), np.array(self.successes)
        prior = PRIOR_WEIGHT * np.array([[self.mean], [1 - self.mean]])
        return np.asarray(prior + np.stack([near @ success, near @ (1 - success)]))

    def draw_members(self, situations: Array, random: np.random.Generator) -> Array:
        """A member for each of n situations, (n, P).

        Better ones, and ones in more similar situations, are drawn more often.
        """
        weights = self._nearness(situations) * self.successes + EPSILON
        totals = weights.cumsum(axis=1)
        ticket = random.random((len(situations), 1)) * totals[:, -1:]
        return np.asarray(np.array(self.members)[(totals <= ticket).sum(axis=1)])

    def _nearness(self, situations: Array) -> Array:
        """Similarity of n situations to each of m members', (n, m): 1 if they are the same.

        What a goal leaves open (NaN) makes no difference.
        """
        offsets = situations[:, None] - np.array(self.situations)
        return np.asarray(np.exp(-np.nansum(offsets**2, axis=2) / (2 * NEAR**2)))


class ActionMemory:
    """Families of actions that went well on an object.

    Args:
        relation: of actions to objects.
        max_families: families that are kept.
        n_members: how many of its members a family is judged by.
        like: a family includes everything nearer to its founder than this share of the distance
            of two random actions.
        surprise: an action better than this share of the latest ones in such situations founds a
            family.
    """

    def __init__(
        self,
        relation: Relation,
        max_families: int = 60,
        n_members: int = 100,
        like: float = 1 / 3,
        surprise: float = 0.95,
    ) -> None:
        self._relation, self._max_families, self._n_members = relation, max_families, n_members
        self._surprise = surprise
        primitive = relation.primitive
        self._range = primitive.high - primitive.low
        free = {*primitive.goal, primitive.yaw}  # these depend on the goal or the object
        self._free_indices = [i for i in range(len(primitive.low)) if i not in free]
        self._radius = like * random_distance(len(self._free_indices))
        self._recent: deque[tuple[Array, float]] = deque(maxlen=RECENT)
        self.families: list[Family] = []

    def record(self, row: Array, parameters: Array, success: float) -> None:
        """Rate an action, (P,), on an object at a row, (3 or 7,), from 0 to 1."""
        relative = self._relation.relative(row[None], parameters[None])[0]
        situation = self._situations(row, parameters[None, self._relation.primitive.goal])[0]
        family = self._family_of(relative)
        if family is None and self._is_surprising(situation, success):
            family = Family(relative)
            self.families.append(family)
        if family is not None:
            family.add(relative, situation, success, self._n_members)
        self._recent.append((situation, success))
        if len(self.families) > self._max_families:
            del self.families[int(np.argmin([family.mean for family in self.families[:-1]]))]

    def sample_variations(self, row: Array, goals: Array, random: np.random.Generator) -> Array:
        """Remembered actions, varied, at an object's row, for (n, G) goals; (n, P) parameters.

        Families are drawn by what they may be worth there (Thompson sampling). Each parameter of
        an action is varied or not; how far is drawn for each action. Now and then one is drawn
        anew from its whole range, so that a grasp learned by dragging is also lifted high. Raises
        RealBenchError if there is no family.
        """
        if not self.families:
            raise RealBenchError("nothing went well yet: no actions to vary")
        relative = self._draw_members(self._situations(row, goals), random)
        n, primitive = len(goals), self._relation.primitive
        far = sample_scales(n, random, MAX_VARIATION)[:, None] * (
            random.random(relative.shape) < 0.5
        )
        relative += random.normal(size=relative.shape) * far * self._range
        redrawn = random.random(relative.shape) < N_REDRAWN / relative.shape[1]
        redrawn[:, primitive.start] = False
        if primitive.yaw is not None:  # the object may be turned otherwise than it was
            redrawn[:, primitive.yaw] = random.random(n) < 0.5
        relative = np.where(redrawn, self._draw_uniform(n, random), relative)
        return self.absolute(row, _with_goals(primitive, relative, goals))

    def _draw_members(self, situations: Array, random: np.random.Generator) -> Array:
        """A member of the family that is drawn for each of n situations, (n, P)."""
        # mostly they are all the same
        keys = np.nan_to_num(situations, nan=np.inf)
        _, first, inverse = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        distinct = situations[first]
        counts = np.stack([family.counts(distinct) for family in self.families])[:, :, inverse]
        chosen = random.beta(counts[:, 0], counts[:, 1]).argmax(axis=0)
        relative = np.empty((len(situations), len(self._range)))
        for number in np.unique(chosen):
            mine = chosen == number
            relative[mine] = self.families[number].draw_members(situations[mine], random)
        return relative

    def _draw_uniform(self, n: int, random: np.random.Generator) -> Array:
        """Random actions relative to an object, (n, P)."""
        primitive = self._relation.primitive
        relative = random.uniform(primitive.low, primitive.high, (n, len(primitive.low)))
        if primitive.height is not None:
            relative[:, primitive.height] -= primitive.low[primitive.height]
        return relative

    def absolute(self, row: Array, relative: Array) -> Array:
        """Parameters of actions given relative to an object, at its row."""
        primitive = self._relation.primitive
        parameters = relative.copy()
        offset = relative[:, primitive.start]
        if primitive.height is not None:
            parameters[:, primitive.height] += row[2]
        if primitive.yaw is None:  # the direction of the push follows from where it begins
            parameters[:, primitive.start] = push_starts(
                row[:2], offset, relative[:, primitive.end]
            )
        else:
            angle = relative[:, primitive.yaw]
            low, high = primitive.low[primitive.yaw], primitive.high[primitive.yaw]
            parameters[:, primitive.yaw] = low + (angle - low) % (high - low)
            parameters[:, primitive.start] = row[:2] + rotate(offset, angle)
        return np.clip(parameters, primitive.low, primitive.high)

    def get_state(self) -> dict[str, Any]:
        """Its families."""
        return {
            "families": [
                {
                    "founder": family.founder,
                    "members": np.array(family.members),
                    "situations": np.array(family.situations),
                    "successes": np.array(family.successes),
                }
                for family in self.families
            ],
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore its memory."""
        self.families = [
            Family(
                np.asarray(each["founder"]),
                list(np.asarray(each["members"])),
                list(np.asarray(each["situations"])),
                np.asarray(each["successes"]).tolist(),
            )
            for each in state["families"]
        ]

    def _is_surprising(self, situation: Array, success: float) -> bool:
        """Whether it went better than most of the latest actions in such situations."""
        if len(self._recent) < N_ALIKE:
            return False
        situations, successes = map(np.array, zip(*self._recent, strict=True))
        distances = np.linalg.norm(situations - situation, axis=1)
        alike = np.argsort(distances, kind="stable")[:N_ALIKE]
        return success > float(np.quantile(successes[alike], self._surprise))

    def _family_of(self, relative: Array) -> Family | None:
        """The family of the nearest founder, if it is near enough."""
        if not self.families:
            return None
        offsets = (np.array([family.founder for family in self.families]) - relative) / self._range
        distances = np.linalg.norm(offsets[:, self._free_indices], axis=1)
        nearest = int(distances.argmin())
        return self.families[nearest] if distances[nearest] < self._radius else None

    def _situations(self, row: Array, goals: Array) -> Array:
        """Where an object is and where it is to go, in ranges of the action, (n, 4 or 5)."""
        primitive = self._relation.primitive
        parts = [row[:2] / self._range[list(primitive.start)]]
        if primitive.height is not None:
            parts.append(row[2:3] / self._range[primitive.height])
        here = np.tile(np.concatenate(parts), (len(goals), 1))
        return np.column_stack([here, goals / self._range[list(primitive.goal)]])


def push_starts(position: Array, offsets: Array, ends: Array) -> Array:
    """Where pushes to (n, 2) ends begin, that come by a position at (n, 2) offsets in their frame.

    The push's direction d solves position + R(d) offset + s d = end with s > 0.
    """
    to_end = ends - position
    distance = np.linalg.norm(to_end, axis=1)
    across = np.clip(offsets[:, 1], -distance, distance)
    angle = np.arctan2(to_end[:, 1], to_end[:, 0]) - np.arcsin(
        across / np.maximum(distance, np.finfo(float).tiny)
    )
    return np.asarray(position + rotate(np.column_stack([offsets[:, 0], across]), angle))


def sample_near_object(
    relation: Relation, row: Array, goals: Array, random: np.random.Generator
) -> Array:
    """Random actions for (n, G) goals that begin near an object, (n, P).

    How near is drawn with equal chances for each order of magnitude, and so is how upright the hand
    is; it comes as low as the object is, or higher; all other parameters are uniform in their
    ranges.
    """
    primitive, n = relation.primitive, len(goals)
    parameters = random.uniform(primitive.low, primitive.high, (n, len(primitive.low)))
    for tilt in primitive.tilts:
        parameters[:, tilt] = sample_scales(n, random) * primitive.high[tilt]
    if primitive.height is not None:
        parameters[:, primitive.height] += row[2] - primitive.low[primitive.height]
    direction = random.uniform(-np.pi, np.pi, n)
    reach = (
        sample_scales(n, random)[:, None]
        * (primitive.high - primitive.low)[list(primitive.start)].mean()
    )
    parameters[:, primitive.start] = row[:2] + reach * np.column_stack(
        [np.cos(direction), np.sin(direction)]
    )
    return np.clip(_with_goals(primitive, parameters, goals), primitive.low, primitive.high)


def _with_goals(primitive: Primitive, parameters: Array, goals: Array) -> Array:
    """Actions for (n, G) goals; what these leave open (NaN) is as it was, (n, P)."""
    told = parameters.copy()
    told[:, primitive.goal] = np.where(np.isnan(goals), told[:, primitive.goal], goals)
    return told


def sample_scales(n: int, random: np.random.Generator, farthest: float = MAX_SCALE) -> Array:
    """N shares of a range, each order of magnitude as likely."""
    return np.asarray(np.exp(random.uniform(np.log(MIN_SCALE), np.log(farthest), n)))
