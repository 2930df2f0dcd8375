"""The same bits whatever torch's number of threads."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import torch

P = ParamSpec("P")
R = TypeVar("R")

THREADS = 1


def fixed_threads(function: Callable[P, R]) -> Callable[P, R]:
    """Compute with THREADS threads: other numbers change the order of sums."""

    @functools.wraps(function)
    def wrapper(*arguments: P.args, **keywords: P.kwargs) -> R:
        before = torch.get_num_threads()
        torch.set_num_threads(THREADS)
        try:
            return function(*arguments, **keywords)
        finally:
            torch.set_num_threads(before)

    return wrapper
