from __future__ import annotations

import numpy as np
import pytest

from real_bench.real_g.hand import Primitive
from real_bench.real_g.relation import Relation
from real_bench.real_g.trial_evidence import TrialEvidence
from tests.real_g.deeds import HAND, PUSH, drawn


@pytest.mark.parametrize("primitive", [PUSH, HAND], ids=["push", "hand"])
def test_an_action_tells_of_itself_and_of_others_the_less_the_more_they_differ(
    primitive: Primitive,
) -> None:
    row, way = np.array([-0.1, 0.1, 0.3]), np.array([0.1, 0.2, 0.05])
    done, other = drawn(primitive, 2)
    evidence = TrialEvidence(Relation(primitive))
    evidence.add(row, row + way, done)
    between = np.array([done + share * (other - done) for share in (0, 0.05, 0.1, 0.2)])
    shares, ends = evidence.of(row, between)
    assert shares.shape == (4, 1)
    assert shares[0, 0] == pytest.approx(1)
    assert (np.diff(shares[:, 0]) < 0).all()
    np.testing.assert_allclose(ends, [row + way])


def test_with_the_object_elsewhere_it_tells_little() -> None:
    row, done = np.array([-0.1, 0.1, 0.3]), drawn(PUSH, 1)[0]
    evidence = TrialEvidence(Relation(PUSH))
    evidence.add(row, row, done)
    evidence.add(row + 0.2, row, done)
    assert len(evidence) == 2
    moved = np.array([0.0, 0.3, 0.0])
    action = done + np.tile(moved[:2], 2)  # the same action, where the object is
    shares, ends = evidence.of(row + moved, action[None])
    assert shares[0, 0] < 0.02
    np.testing.assert_allclose(ends[0], row + moved)
