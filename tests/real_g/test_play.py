"""How it plays follows its settings."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from real_bench.controllers.real_g import RealGSettings

from real_bench.errors import ControllerError
from real_bench.real_g.memory import ActionMemory, sample_near_object
from real_bench.real_g.play import Play, PlaySettings
from real_bench.real_g.relation import Relation
from real_bench.real_g.skill import Skill
from real_bench.settings import validated
from tests.real_g.deeds import HAND, drawn, rows

Array = NDArray[np.float64]


def practised(fresh: float) -> Skill:
    """A skill that remembers actions and has learned from them."""
    relation = Relation(HAND)
    skill = Skill(relation, ActionMemory(relation), 0, fresh)
    before, parameters = rows(100), drawn(HAND, 100, 0)
    for row, action in zip(before, parameters, strict=True):
        skill.memory.record(row, action, 0.5)
    skill.memory.record(before[0], drawn(HAND, 1, 1)[0], 1.0)
    skill.learn(before, rows(100, 1), parameters, 10)
    assert skill.has_learned
    assert skill.memory.families
    return skill


@pytest.mark.parametrize("fresh", [0.0, 0.3, 1.0])
def test_a_share_of_proposals_does_not_come_from_memory(fresh: float) -> None:
    skill, row, goals = practised(fresh), rows(1)[0], drawn(HAND, 10, 3)[:, list(HAND.goal)]
    proposed = skill.propose(row, goals, np.random.default_rng(5))
    random, n = np.random.default_rng(5), round(10 * fresh)
    np.testing.assert_array_equal(
        proposed[:n], sample_near_object(skill.relation, row, goals[:n], random)
    )
    if n < len(goals):
        remembered = skill.memory.sample_variations(row, goals[n:], random)
        np.testing.assert_array_equal(proposed[n:], remembered)


def ends_of(settings: PlaySettings) -> Array:
    """Where 300 random actions go, of a play that saw an object in one corner alone."""
    play, random = Play(HAND, settings, 0), np.random.default_rng(0)
    row = np.array([*HAND.low[list(HAND.end)], 0.3])
    play.observe(row[None], row[None], np.full(16, np.nan))
    actions = [play.next_parameters(row[None], random) for _ in range(300)]
    return np.array(actions)[:, list(HAND.end)]


def test_goals_are_where_objects_have_been_or_anywhere() -> None:
    low, high = HAND.low[list(HAND.end)], HAND.high[list(HAND.end)]
    near = ends_of(PlaySettings(near=0))
    assert (near <= low + 3 / 8 * (high - low)).all()
    anywhere = ends_of(PlaySettings(near=0, anywhere=1))
    assert (np.quantile(anywhere, 0.9, axis=0) > low + 0.8 * (high - low)).all()


def test_half_of_the_goals_of_a_hand_say_how_high_it_carries() -> None:
    play, random = Play(HAND, PlaySettings(), 0), np.random.default_rng(0)
    heights = play.relation.goals(np.zeros((2000, 2)), random, 0.5)[:, 2]
    assert np.isnan(heights).mean() == pytest.approx(0.5, abs=0.05)
    heights = heights[~np.isnan(heights)]
    assert np.quantile(heights, [0.1, 0.9]) == pytest.approx([0.1, 0.9], abs=0.05)


@pytest.mark.parametrize("shares", [("random", "bred"), ("near", "anywhere")])
def test_shares_of_more_than_the_whole_are_refused(shares: tuple[str, str]) -> None:
    play = dict.fromkeys(shares, 0.6)
    with pytest.raises(ControllerError, match=f"{' and '.join(shares)} together"):
        validated(RealGSettings, {"play": play}, "controller real_g")
