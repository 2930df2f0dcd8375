from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from real_bench.scoring import GoalOutcome, summarise

OUTCOMES = st.lists(
    st.builds(
        GoalOutcome,
        challenge=st.sampled_from(["2D", "2.5D", "3D"]),
        score=st.floats(0.001, 3),
        distances=st.tuples(st.floats(0, 2), st.floats(0, 2)),
    ),
    min_size=1,
    max_size=12,
)


def test_a_summary_by_hand() -> None:
    rows = summarise(
        [
            GoalOutcome("3D", 0.1, (0.3, 0.5)),
            GoalOutcome("2D", 1.0, (0.0, 0.2)),
            GoalOutcome("2D", 0.4, (0.1, 0.1)),
        ]
    )
    assert [(row.name, row.n_goals) for row in rows] == [("2D", 2), ("3D", 1), ("total", 3)]
    assert [row.score for row in rows] == pytest.approx([0.7, 0.1, 0.5])
    assert [row.distance for row in rows] == pytest.approx([0.1, 0.4, 0.2])
    assert rows[0].interval is not None
    assert (rows[0].interval.low, rows[0].interval.high) == pytest.approx((0.4, 1.0))
    assert rows[1].interval is None


@settings(max_examples=25, deadline=None)
@given(OUTCOMES, st.randoms(use_true_random=False))
def test_classes_come_in_the_papers_order_and_add_up(
    outcomes: list[GoalOutcome], random: object
) -> None:
    *classes, total = summarise(outcomes)
    names = [row.name for row in classes]
    assert names == [
        name
        for name in ("2D", "2.5D", "3D")
        if any(outcome.challenge == name for outcome in outcomes)
    ]
    assert total.name == "total"
    assert total.n_goals == len(outcomes) == sum(row.n_goals for row in classes)
    weights = [row.n_goals for row in classes]
    assert total.score == pytest.approx(np.average([row.score for row in classes], weights=weights))
    assert total.score == pytest.approx(np.mean([outcome.score for outcome in outcomes]))
    far = np.average([row.distance for row in classes], weights=weights)
    assert total.distance == pytest.approx(far)


def test_nothing_has_no_summary() -> None:
    assert summarise([]) == []
