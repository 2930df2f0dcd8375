"""Scripts that results were made with, under evaluation/."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from evaluation.held_out import CANDIDATES, follow, perception_of
from real_bench.errors import RealBenchError
from real_bench.inputs.yaml_files import read_mapping

PAPER = Path(CANDIDATES).with_name("paper-vae.yaml")


def candidates() -> dict[str, object]:
    return read_mapping(CANDIDATES, "candidates", RealBenchError)


@pytest.mark.parametrize("name", candidates())
def test_every_candidate_can_be_made(name: str) -> None:
    assert perception_of(candidates()[name])  # type: ignore[arg-type]


def test_the_papers_candidate_is_the_one_that_users_get() -> None:
    assert candidates()["the paper's"] == {"codes": read_mapping(PAPER, "settings", RealBenchError)}


def test_a_plan_is_followed_by_the_ways_of_its_triplets() -> None:
    random = np.random.default_rng(0)
    before, ways = random.uniform(-1, 1, (5, 2, 3)), random.uniform(-1, 1, (5, 2, 3))
    start = random.uniform(-1, 1, (2, 3))
    goals = np.array([start + ways[3] + ways[1], start, start + ways[2]])
    plans = [(3, 1), (), (4,)]
    followed = follow(plans, np.array([start] * 3), goals, before, before + ways)
    np.testing.assert_allclose(followed.left[:2], 0, atol=1e-12)
    np.testing.assert_allclose(followed.left[2], np.linalg.norm(ways[4] - ways[2], axis=-1))
    begins = [np.linalg.norm(before[each] - start, axis=-1).max() for each in (3, 4)]
    np.testing.assert_allclose(followed.begin, begins)
    ends = [
        np.linalg.norm(before[last] + ways[last] - goal, axis=-1).max()
        for last, goal in ((1, goals[0]), (4, goals[2]))
    ]
    np.testing.assert_allclose(followed.end, ends)
