from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from real_bench.real_x.search import shortest_path


@dataclass(frozen=True)
class Maze:
    """A directed graph with estimates in eighths, so that sums are exact."""

    follow: tuple[tuple[int, ...], ...]
    firsts: tuple[int, ...]
    lasts: frozenset[int]
    estimates: tuple[float, ...]
    depth: int

    def path(self) -> tuple[list[int], int]:
        def successors(node: int) -> NDArray[np.int64]:
            return np.array(self.follow[node], np.int64)

        is_last = np.array([node in self.lasts for node in range(len(self.follow))], bool)
        estimates = np.array(self.estimates, np.float64)
        return shortest_path(
            np.array(self.firsts, np.int64), is_last, estimates, successors, self.depth
        )

    def cost(self, path: list[int]) -> float:
        return len(path) + self.estimates[path[-1]]


@st.composite
def mazes(draw: st.DrawFn) -> Maze:
    n = draw(st.integers(1, 7))
    some = st.sets(st.sampled_from(range(n)), max_size=3).map(sorted)
    follow = tuple(tuple(draw(some)) for _ in range(n))
    estimates = [draw(st.integers(0, 24)) / 8 for _ in range(n)]
    for _ in range(n):  # no node more than one step farther than what follows it
        estimates = [
            min([estimates[node], *(1 + estimates[later] for later in follow[node])])
            for node in range(n)
        ]
    return Maze(
        follow,
        tuple(draw(some)),
        frozenset(draw(some)),
        tuple(estimates),
        draw(st.integers(0, 5)),
    )


def least_cost(maze: Maze) -> float | None:
    """The cost of the best path, all of them tried."""
    costs = []
    paths = [[node] for node in maze.firsts]
    for _ in range(maze.depth):
        costs += [maze.cost(path) for path in paths if path[-1] in maze.lasts]
        paths = [[*path, node] for path in paths for node in maze.follow[path[-1]]]
    return min(costs, default=None)


@settings(max_examples=250)
@given(mazes())
def test_no_path_is_cheaper_than_the_one_found(maze: Maze) -> None:
    path, n_expanded = maze.path()
    assert n_expanded >= 0
    assert (maze.cost(path) if path else None) == least_cost(maze)


@settings(max_examples=75)
@given(mazes())
def test_a_path_goes_from_a_first_node_to_a_last_one(maze: Maze) -> None:
    path, _ = maze.path()
    assert len(path) <= maze.depth
    assert len(set(path)) == len(path)
    if path:
        assert path[0] in maze.firsts
        assert path[-1] in maze.lasts
    assert all(later in maze.follow[node] for node, later in pairwise(path))


def corridor(n: int, depth: int) -> Maze:
    """From 0 to the last of n nodes, one after the other, each with its true distance."""
    follow = (*((node + 1,) for node in range(n - 1)), ())
    return Maze(follow, (0,), frozenset([n - 1]), tuple(range(n - 1, -1, -1)), depth)


@pytest.mark.parametrize("n", [1, 2, 7])
def test_path_length_is_limited_by_the_depth(n: int) -> None:
    assert corridor(n, depth=n).path() == (list(range(n)), n - 1)
    assert corridor(n, depth=n - 1).path() == ([], max(0, n - 2))


def test_node_first_reached_by_a_detour_can_be_reached_again() -> None:
    """Node 3 is first found by way of 1 and 2, which promise much; only from 4 it is in reach."""
    follow = ((1,), (2,), (3,), (5,), (3,), ())
    estimates = (0.0, 0.0, 0.0, 1.0, 2.0, 2.0)
    maze = Maze(follow, (0, 4), frozenset([5]), estimates, depth=5)
    assert maze.path() == ([4, 3, 5], 5)  # each was expanded once


def test_nodes_estimated_far_are_not_expanded() -> None:
    follow = ((2,), (3,), (4,), (4,), ())
    maze = Maze(follow, (0, 1), frozenset([4]), (2.0, 9.0, 1.0, 8.0, 0.0), depth=5)
    assert maze.path() == ([0, 2, 4], 2)


def test_without_first_or_last_nodes_there_is_no_path() -> None:
    assert Maze(((0,),), (), frozenset([0]), (0.0,), depth=3).path() == ([], 0)
    assert Maze(((0,),), (0,), frozenset(), (0.0,), depth=3).path()[0] == []
    assert Maze((), (), frozenset(), (), depth=3).path() == ([], 0)
