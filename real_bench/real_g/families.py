"""Actions that went well, told from the object, and what came of others like them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.real_g.memory import pushed_from
from real_bench.real_g.relation import Relation, turned

Array = NDArray[np.float64]

NEAREST, FARTHEST = 0.005, 0.1
SITUATION = 5
RIVALS = 4


class Family:
    """An action that went well, and the latest that were like it."""

    def __init__(self, founder: Array, situation: Array, success: float, latest: int) -> None:
        self.founder, self._latest = founder, latest
        self.members, self.situations, self.successes = [founder], [situation], [success]

    def add(self, member: Array, situation: Array, success: float) -> None:
        """One more; the oldest is forgotten."""
        self.members.append(member)
        self.situations.append(situation)
        self.successes.append(success)
        if len(self.members) > self._latest:
            worst = 0
            for values in (self.members, self.situations, self.successes):
                del values[worst]

    @property
    def counts(self) -> tuple[float, float]:
        good = float(sum(self.successes))
        return 1 + good, 1 + len(self.successes) - good


class Families:
    """Families of actions; each is judged by what came of its latest members.

    Args:
        relation: of actions to objects.
        most: families that are kept.
        latest: members of a family that count.
        like: actions nearer to a family's founder than this, in ranges of the numbers, belong to it.
        surprise: an action founds a family where this share of the latest actions did worse.
    """

    def __init__(
        self,
        relation: Relation,
        most: int = 60,
        latest: int = 40,
        like: float = 0.5,
        surprise: float = 0.95,
        recent: int = 300,
    ) -> None:
        self._relation, self._most, self._latest_n = relation, most, latest
        self._like, self._surprise, self._recent_n = like, surprise, recent
        deed = relation.deed
        self._range = deed.high - deed.low
        same = np.ones(len(deed.low), bool)
        same[list(deed.end)] = False
        if deed.turn is not None:
            same[deed.turn] = False
        self._same = same
        self.families: list[Family] = []
        self._recent: list[float] = []

    def did(self, row: Array, numbers: Array, success: float) -> None:
        """An action on an object at a row, (3 or 7,), went so well, 0 to 1."""
        told = self._relation.told(row[None], numbers[None])[0]
        situation = np.concatenate([row[:3], numbers[list(self._relation.deed.end)]])
        family = self._nearest(told)
        if family is not None:
            family.add(told, situation, success)
        elif success > self._bar():
            self.families.append(Family(told, situation, success, self._latest_n))
            if len(self.families) > self._most:
                means = [f.counts[0] / sum(f.counts) for f in self.families[:-1]]
                del self.families[int(np.argmin(means))]
        self._recent.append(success)
        del self._recent[: -self._recent_n]

    def varied(self, row: Array, ends: Array, random: np.random.Generator) -> Array:
        """Actions like those that went well, at an object's row, to (n, 2) ends; (n, P) numbers."""
        n, deed = len(ends), self._relation.deed
        good, bad = np.array([family.counts for family in self.families]).T
        chosen = random.beta(good[:, None], bad[:, None], (len(good), n)).argmax(axis=0)
        told = np.empty((n, len(deed.low)))
        here = np.column_stack([np.tile(row[:3], (n, 1)), ends])
        unit = np.concatenate([np.full(2, 0.5), [0.1], np.full(2, 0.5)])
        for number in np.unique(chosen):
            mine = np.flatnonzero(chosen == number)
            family = self.families[number]
            weights = np.array(family.successes) + 1e-3
            drawn = random.choice(len(weights), (len(mine), RIVALS), p=weights / weights.sum())
            away = (np.array(family.situations)[drawn] - here[mine, None]) / unit
            best = (away**2).sum(axis=2).argmin(axis=1)
            told[mine] = np.array(family.members)[drawn[np.arange(len(mine)), best]]
        shares = np.exp(random.uniform(np.log(NEAREST), np.log(FARTHEST), n))
        far = shares[:, None] * (random.random(told.shape) < 0.5)
        told += random.normal(size=told.shape) * far * self._range
        if deed.turn is not None:
            anew = random.random(n) < 0.5
            told[anew, deed.turn] = random.uniform(
                deed.low[deed.turn], deed.high[deed.turn], n
            )[anew]
        told[:, deed.end] = ends
        return self.placed(row, told)

    def placed(self, row: Array, told: Array) -> Array:
        """Numbers of actions that are told from an object, at its row."""
        deed = self._relation.deed
        numbers = told.copy()
        if deed.height is not None:
            numbers[:, deed.height] += row[2]
        offset = told[:, deed.start]
        if deed.turn is None:
            numbers[:, deed.start] = pushed_from(row[:2], offset, told[:, deed.end])
        else:
            angle = told[:, deed.turn]
            low, high = deed.low[deed.turn], deed.high[deed.turn]
            numbers[:, deed.turn] = low + (angle - low) % (high - low)
            numbers[:, deed.start] = row[:2] + turned(offset, angle)
        return np.clip(numbers, deed.low, deed.high)

    def _bar(self) -> float:
        return float(np.quantile(self._recent, self._surprise)) if len(self._recent) > 20 else 0.05

    def _nearest(self, told: Array) -> Family | None:
        if not self.families:
            return None
        away = np.array([family.founder for family in self.families]) - told
        distance = np.linalg.norm((away / self._range)[:, self._same], axis=1)
        number = int(distance.argmin())
        return self.families[number] if distance[number] < self._like else None

    def get_state(self) -> dict[str, Any]:
        return {
            "families": [
                {"founder": f.founder, "members": np.array(f.members),
                 "situations": np.array(f.situations), "successes": np.array(f.successes)}
                for f in self.families
            ],
        }

    def set_state(self, state: Mapping[str, Any]) -> None:
        self.families = []
        for each in state["families"]:
            f = Family(each["founder"], each["situations"][0], 0.0, self._latest_n)
            f.members, f.situations = list(each["members"]), list(each["situations"])
            f.successes = [float(s) for s in each["successes"]]
            self.families.append(f)
