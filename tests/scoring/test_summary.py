from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.scoring import METRICS, summarise
from real_bench.scoring.result import TrialResult

OUTCOMES = st.lists(
    st.tuples(st.sampled_from(["2D", "2.5D", "3D"]), st.tuples(st.floats(0, 2), st.floats(0, 2))),
    min_size=1,
    max_size=12,
)


def trials(outcomes: list[tuple[str, tuple[float, ...]]]) -> list[TrialResult]:
    """Trials that ended so, by class and distances (m)."""
    pose = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    return [
        TrialResult(
            goal=goal,
            challenge=challenge,
            distances=away,
            final_poses=(pose,) * len(away),
            actions_sha256="4" * 64,
        )
        for goal, (challenge, away) in enumerate(outcomes)
    ]


def test_summary_matches_a_hand_calculation() -> None:
    """Scores at 0, 10 and 20 cm are 1, 1/4 and 1/16."""
    rows = summarise(
        trials([("3D", (0.3, 0.5)), ("2D", (0.0, 0.2)), ("2D", (0.1, 0.1)), ("2D", (0.02, 0.03))])
    )
    assert [(row.name, row.n_goals) for row in rows] == [("2D", 3), ("3D", 1), ("total", 4)]
    told = {name: [row.means[name].value for row in rows] for name in METRICS}
    by_hand = [4**-3 + 4**-5, 1 + 1 / 16, 1 / 2, 4**-0.2 + 4**-0.3]
    assert told["score"] == pytest.approx([np.mean(by_hand[1:]), by_hand[0], np.mean(by_hand)])
    assert told["distance"] == pytest.approx([0.225 / 3, 0.4, 0.625 / 4])
    assert told["success"] == pytest.approx([1 / 3, 0, 1 / 4])
    assert told["actions"] == [None] * 3  # their commands were not kept
    interval = rows[0].means["score"].interval
    assert interval is not None
    assert interval.over == "goals"
    assert rows[1].means["score"].interval is None


@settings(max_examples=25, deadline=None)
@given(OUTCOMES)
def test_classes_are_in_the_papers_order_and_add_up(
    outcomes: list[tuple[str, tuple[float, ...]]],
) -> None:
    made = trials(outcomes)
    *classes, total = summarise(made)
    names = [row.name for row in classes]
    assert names == [
        name for name in ("2D", "2.5D", "3D") if any(challenge == name for challenge, _ in outcomes)
    ]
    assert total.name == "total"
    assert total.n_goals == len(outcomes) == sum(row.n_goals for row in classes)
    weights = [row.n_goals for row in classes]
    for name in ("score", "distance", "success"):
        by_class = np.array([row.means[name].value for row in classes], np.float64)
        assert total.means[name].value == pytest.approx(np.average(by_class, weights=weights))
    score = total.means["score"].value
    assert score == pytest.approx(np.mean([trial.score for trial in made]))


def test_empty_result_has_no_summary() -> None:
    assert summarise([]) == []
