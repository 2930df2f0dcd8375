"""A* with equal step costs and a limited number of steps."""

from __future__ import annotations

import heapq
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Successors = Callable[[int], NDArray[np.int64]]


def shortest_path(
    firsts: NDArray[np.int64],
    is_last: NDArray[np.bool_],
    estimates: NDArray[np.float64],
    successors: Successors,
    depth: int,
) -> tuple[list[int], int]:
    """A path of at most ``depth`` nodes that minimises its length plus the estimate at its end.

    Args:
        firsts: nodes where a path may begin.
        is_last: whether a path may end at a node, (n,).
        estimates: how many steps each node is from the end at least, (n,). No node may be
            estimated more than one step farther than its successors, else paths are not the best.
        successors: the nodes that may follow a node.
        depth: the most nodes a path may have.

    Returns:
        The nodes of the path, empty if there is none; and how many nodes were expanded.
    """
    best = np.full(len(estimates), depth + 1)  # fewest nodes of a path to each
    parents = np.full(len(estimates), -1)
    open_nodes: list[tuple[float, int, int]] = []
    n_expanded = 0

    def reach(nodes: NDArray[np.int64], length: int, parent: int) -> None:
        nearer = nodes[best[nodes] > length]
        best[nearer], parents[nearer] = length, parent
        for estimate, node in zip(estimates[nearer].tolist(), nearer.tolist(), strict=True):
            heapq.heappush(open_nodes, (length + estimate, node, length))

    reach(firsts, 1, -1)
    while open_nodes:
        _, node, length = heapq.heappop(open_nodes)
        if length > best[node]:
            continue  # it was reached by a shorter path since
        if is_last[node]:
            return _path_to(node, parents), n_expanded
        if length < depth:
            n_expanded += 1
            reach(successors(node), length + 1, node)
    return [], n_expanded


def _path_to(node: int, parents: NDArray[np.int64]) -> list[int]:
    path = []
    while node >= 0:
        path.append(node)
        node = int(parents[node])
    return path[::-1]
