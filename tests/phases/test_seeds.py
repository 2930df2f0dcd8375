from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from real_bench.phases.seeds import derived_seed

NUMBERS = st.integers(0, 2**64)


@given(NUMBERS, st.lists(NUMBERS, min_size=2, max_size=50, unique=True))
def test_derived_seeds_differ_and_are_reproducible(seed: int, numbers: list[int]) -> None:
    derived = [derived_seed(seed, number) for number in numbers]
    assert derived == [derived_seed(seed, number) for number in numbers]
    assert all(0 <= value < 2**32 for value in derived)
    assert len(set(derived)) == len(derived)
    assert derived_seed(1, 2) != derived_seed(2, 1)
