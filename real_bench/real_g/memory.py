"""Actions that went well, relative to the object, so that they apply wherever it is.

A rare action that works well beats one that usually works a little only after practice: the second
attempt at it mostly fails. So whatever goes surprisingly well founds a family, and a family is
tried again, varied a little, as long as its latest members do well (local adaptation: Kim, Coninx
and Doncieux 2021).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.real_g.relation import Relation, turned

Array = NDArray[np.float64]

FARTHEST, NEAREST = 0.5, 0.005
"""How near to an object random actions begin, in shares of a range."""

MOST_VARIED = 0.1
"""Remembered actions are varied by shares of a number's range from ``NEAREST`` to this."""

REDRAWN = 0.5
"""On average, this many numbers of a remembered action are drawn anew from their whole range."""

RECENT, FEWEST = 300, 20
"""Success is surprising relative to this many earlier actions; with fewer nothing is."""

NEAR = 0.3
"""Situations this far apart, in ranges of their numbers, still inform each other."""

ELSEWHERE = 10.0
"""All members in all situations count as much as this many in the same situation."""

TINY = 1e-3


@dataclass
class Family:
    """An action that went surprisingly well, and the latest ones that were like it.

    Attributes:
        founder: numbers of the first one, relative to the object, (P,).
        members: such numbers, the latest last.
        situations: where the object was and where it should go, for each.
        successes: how well each went, 0 to 1.
    """

    founder: Array
    members: list[Array] = field(default_factory=list)
    situations: list[Array] = field(default_factory=list)
    successes: list[float] = field(default_factory=list)

    def add(self, member: Array, situation: Array, success: float, latest: int) -> None:
        """One more; only the latest are kept."""
        self.members.append(member)
        self.situations.append(situation)
        self.successes.append(success)
        for values in (self.members, self.situations, self.successes):
            del values[:-latest]

    @property
    def mean(self) -> float:
        """The success of its members, with one success and one failure added."""
        return (1 + sum(self.successes)) / (2 + len(self.successes))

    def counts(self, situations: Array) -> Array:
        """Successes and failures in n situations, (2, n).

        The less similar a member's situation is, the less the member counts. All members in all
        situations together count as much as ``ELSEWHERE`` members.
        """
        near, success = self._nearness(situations), np.array(self.successes)
        prior = ELSEWHERE * np.array([[self.mean], [1 - self.mean]])
        return np.asarray(prior + np.stack([near @ success, near @ (1 - success)]))

    def drawn(self, situations: Array, random: np.random.Generator) -> Array:
        """A member for each of n situations, (n, P).

        Better ones, and ones in more similar situations, are drawn more often.
        """
        weights = self._nearness(situations) * self.successes + TINY
        totals = weights.cumsum(axis=1)
        ticket = random.random((len(situations), 1)) * totals[:, -1:]
        return np.asarray(np.array(self.members)[(totals <= ticket).sum(axis=1)])

    def _nearness(self, situations: Array) -> Array:
        """Similarity of n situations to each of m members', (n, m): 1 if they are the same."""
        away = situations[:, None] - np.array(self.situations)
        return np.asarray(np.exp(-(away**2).sum(axis=2) / (2 * NEAR**2)))


class DeedMemory:
    """Families of actions that went well on an object.

    Args:
        relation: of actions to objects.
        most: families that are kept.
        latest: how many of its latest members a family is judged by.
        like: a family includes everything nearer to its founder than this share of the distance
            of two random actions.
        surprise: an action better than this share of the latest ones founds a family.
    """

    def __init__(
        self,
        relation: Relation,
        most: int = 60,
        latest: int = 100,
        like: float = 1 / 3,
        surprise: float = 0.95,
    ) -> None:
        self._relation, self._most, self._latest = relation, most, latest
        self._surprise = surprise
        deed = relation.deed
        self._range = deed.high - deed.low
        free = {*deed.end, deed.turn}  # these depend on the goal or the object
        self._form = [i for i in range(len(deed.low)) if i not in free]
        self._radius = like * np.sqrt(len(self._form) / 6)  # of uniform numbers, ranges 1
        self._recent: list[float] = []
        self.families: list[Family] = []

    def did(self, row: Array, numbers: Array, success: float) -> None:
        """Rate an action, (P,), on an object at a row, (3 or 7,), from 0 to 1."""
        told = self._relation.told(row[None], numbers[None])[0]
        family = self._family_of(told)
        if family is None and self._is_surprising(success):
            family = Family(told)
            self.families.append(family)
        if family is not None:
            ends = numbers[None, self._relation.deed.end]
            family.add(told, self._situations(row, ends)[0], success, self._latest)
        self._recent = [*self._recent[1 - RECENT :], success]
        if len(self.families) > self._most:
            del self.families[int(np.argmin([family.mean for family in self.families[:-1]]))]

    def varied(self, row: Array, ends: Array, random: np.random.Generator) -> Array:
        """Remembered actions, varied, at an object's row, to (n, 2) ends; (n, P) numbers.

        Families are drawn by what they may be worth there (Thompson sampling). Each number of an
        action is varied or not; how far is drawn for each action. Now and then a number is drawn
        anew from its whole range, so that a grasp learned by dragging is also lifted high. Raises
        RealBenchError if there is no family.
        """
        if not self.families:
            raise RealBenchError("nothing went well yet: no actions to vary")
        told = self._remembered(self._situations(row, ends), random)
        n, deed = len(ends), self._relation.deed
        far = scale(n, random, MOST_VARIED)[:, None] * (random.random(told.shape) < 0.5)
        told += random.normal(size=told.shape) * far * self._range
        anew = random.random(told.shape) < REDRAWN / told.shape[1]
        anew[:, deed.start] = False
        if deed.turn is not None:  # the object may be turned otherwise than it was
            anew[:, deed.turn] = random.random(n) < 0.5
        told = np.where(anew, self._anywhere(n, random), told)
        told[:, deed.end] = ends
        return self.placed(row, told)

    def _remembered(self, situations: Array, random: np.random.Generator) -> Array:
        """A member of the family that is drawn for each of n situations, (n, P)."""
        # mostly they are all the same
        different, which = np.unique(situations, axis=0, return_inverse=True)
        counts = np.stack([family.counts(different) for family in self.families])[:, :, which]
        chosen = random.beta(counts[:, 0], counts[:, 1]).argmax(axis=0)
        told = np.empty((len(situations), len(self._range)))
        for number in np.unique(chosen):
            mine = chosen == number
            told[mine] = self.families[number].drawn(situations[mine], random)
        return told

    def _anywhere(self, n: int, random: np.random.Generator) -> Array:
        """Random actions relative to an object, (n, P)."""
        deed = self._relation.deed
        told = random.uniform(deed.low, deed.high, (n, len(deed.low)))
        if deed.height is not None:
            told[:, deed.height] -= deed.low[deed.height]
        return told

    def placed(self, row: Array, told: Array) -> Array:
        """Numbers of actions given relative to an object, at its row."""
        deed = self._relation.deed
        numbers = told.copy()
        offset = told[:, deed.start]
        if deed.height is not None:
            numbers[:, deed.height] += row[2]
        if deed.turn is None:  # the direction of the push follows from where it begins
            numbers[:, deed.start] = pushed_from(row[:2], offset, told[:, deed.end])
        else:
            angle = told[:, deed.turn]
            low, high = deed.low[deed.turn], deed.high[deed.turn]
            numbers[:, deed.turn] = low + (angle - low) % (high - low)
            numbers[:, deed.start] = row[:2] + turned(offset, angle)
        return np.clip(numbers, deed.low, deed.high)

    def get_state(self) -> dict[str, Any]:
        """What it remembers."""
        return {
            "recent": np.array(self._recent),
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
        self._recent = np.asarray(state["recent"]).tolist()
        self.families = [
            Family(
                np.asarray(each["founder"]),
                list(np.asarray(each["members"])),
                list(np.asarray(each["situations"])),
                np.asarray(each["successes"]).tolist(),
            )
            for each in state["families"]
        ]

    def _is_surprising(self, success: float) -> bool:
        known = len(self._recent) >= FEWEST
        return known and success > float(np.quantile(self._recent, self._surprise))

    def _family_of(self, told: Array) -> Family | None:
        """The family of the nearest founder, if it is near enough."""
        if not self.families:
            return None
        away = (np.array([family.founder for family in self.families]) - told) / self._range
        distances = np.linalg.norm(away[:, self._form], axis=1)
        nearest = int(distances.argmin())
        return self.families[nearest] if distances[nearest] < self._radius else None

    def _situations(self, row: Array, ends: Array) -> Array:
        """Where an object is and where it is to go, in ranges of the action, (n, 4 or 5)."""
        deed = self._relation.deed
        parts = [row[:2] / self._range[list(deed.start)]]
        if deed.height is not None:
            parts.append(row[2:3] / self._range[deed.height])
        here = np.tile(np.concatenate(parts), (len(ends), 1))
        return np.column_stack([here, ends / self._range[list(deed.end)]])


def pushed_from(place: Array, offsets: Array, ends: Array) -> Array:
    """Where pushes to (n, 2) ends begin, that come by a place at (n, 2) offsets in their frame.

    The push's direction d solves place + R(d) offset + s d = end with s > 0.
    """
    to_end = ends - place
    distance = np.linalg.norm(to_end, axis=1)
    across = np.clip(offsets[:, 1], -distance, distance)
    angle = np.arctan2(to_end[:, 1], to_end[:, 0]) - np.arcsin(
        across / np.maximum(distance, np.finfo(float).tiny)
    )
    return np.asarray(place + turned(np.column_stack([offsets[:, 0], across]), angle))


def aimed(relation: Relation, row: Array, ends: Array, random: np.random.Generator) -> Array:
    """Random actions to (n, 2) ends that begin near an object, (n, P).

    How near is drawn with equal chances for each order of magnitude, and so is how upright the hand
    is; it comes as low as the object is, or higher; all other numbers are uniform in their ranges.
    """
    deed, n = relation.deed, len(ends)
    numbers = random.uniform(deed.low, deed.high, (n, len(deed.low)))
    for lean in deed.leans:
        numbers[:, lean] = scale(n, random) * deed.high[lean]
    if deed.height is not None:
        numbers[:, deed.height] += row[2] - deed.low[deed.height]
    direction = random.uniform(-np.pi, np.pi, n)
    reach = scale(n, random)[:, None] * (deed.high - deed.low)[list(deed.start)].mean()
    numbers[:, deed.start] = row[:2] + reach * np.column_stack(
        [np.cos(direction), np.sin(direction)]
    )
    numbers[:, deed.end] = ends
    return np.clip(numbers, deed.low, deed.high)


def scale(n: int, random: np.random.Generator, farthest: float = FARTHEST) -> Array:
    """N shares of a range, each order of magnitude as likely."""
    return np.asarray(np.exp(random.uniform(np.log(NEAREST), np.log(farthest), n)))
