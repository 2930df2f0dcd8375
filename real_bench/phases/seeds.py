"""Seeds that follow from a run's seed."""

from __future__ import annotations

import numpy as np


def derived_seed(*numbers: int) -> int:
    """A seed that depends on all of the numbers and on their order, below 2**32."""
    return int(np.random.SeedSequence(list(numbers)).generate_state(1)[0])
