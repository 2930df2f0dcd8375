from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray

from real_bench.errors import RealBenchError
from real_bench.real_x import DynamicAbstraction, Plan, Planner, Triplets

Vector = NDArray[np.float64]

QUARTERS = st.integers(0, 9).map(lambda number: number / 4)  # sums of them are exact
TENTHS = st.integers(0, 8).map(lambda number: number * 0.1)  # sums of them are not
FLOATS = st.floats(-1, 1).filter(lambda number: number == 0 or abs(number) > 1e-200)
NUMBERS = [QUARTERS, TENTHS, FLOATS, st.one_of(TENTHS, FLOATS)]


@dataclass(frozen=True)
class Problem:
    states: Vector
    outcomes: Vector
    thresholds: Vector
    here: Vector
    goal: Vector
    depth: int

    def plan(self) -> Plan:
        planner = Planner(Triplets(self.states, self.outcomes), DynamicAbstraction(self.thresholds))
        return planner.plan(self.here, self.goal, self.depth)

    def gap(self, point: Vector) -> float:
        return float(np.abs(point - self.goal).sum())

    def merit(self, plan: Plan) -> tuple[int, int, float] | None:
        """Level, number of actions, and how far from the goal the plan ends."""
        if plan.level is None:
            return None
        end = self.outcomes[plan.triplets[-1]] if plan.triplets else self.here
        return plan.level, len(plan.triplets), self.gap(end)


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    n = draw(st.sampled_from([0, 1, 2, 3, 4, 5, 6, 6, 7, 7, 8, 8]))
    n_variables = draw(st.sampled_from([1, 2, 3]))
    numbers = draw(st.sampled_from(NUMBERS))

    def rows(k: int) -> Vector:
        return draw(arrays(np.float64, (k, n_variables), elements=numbers, fill=st.nothing()))

    states, outcomes = rows(n), rows(n)
    if mostly(draw):  # one after the other, as in free play
        outcomes[:-1] = states[1:]
    if n > 1 and not mostly(draw):
        states[0], outcomes[0] = states[1], outcomes[1]
    if n and not mostly(draw):
        learned = DynamicAbstraction.learn(Triplets(states, outcomes), draw(st.integers(2, 5)))
        thresholds = learned.thresholds
    else:
        coarseness = draw(st.sampled_from([0.1, 0.25, 0.5, 1]))
        thresholds = np.sort(np.abs(rows(draw(st.integers(1, 5)))), axis=0) * coarseness
    here, goal = rows(2)
    first = draw(st.integers(0, max(0, n - 1)))
    if n and mostly(draw):
        here = states[first]
    if n and mostly(draw):
        goal = outcomes[draw(st.integers(first, n - 1))]
    return Problem(states, outcomes, thresholds, here, goal, draw(st.sampled_from([1, 2, 3, 4, 4])))


def mostly(draw: st.DrawFn) -> bool:
    return draw(st.integers(0, 3)) > 0


def same(one: Vector, other: Vector, thresholds: Vector) -> bool:
    return all(abs(a - b) < most for a, b, most in zip(one, other, thresholds, strict=True))


def is_effective(state: Vector, outcome: Vector, thresholds: Vector) -> bool:
    return any(abs(a - b) > most for a, b, most in zip(state, outcome, thresholds, strict=True))


def best_by_trying_all(problem: Problem) -> tuple[int, int, float] | None:
    """The merit of the best plan, straight from the definition: every sequence is made."""
    states, outcomes, goal = problem.states, problem.outcomes, problem.goal
    for level, near in enumerate(problem.thresholds):
        if same(problem.here, goal, near):
            return level, 0, problem.gap(problem.here)
        useful = [t for t in range(len(states)) if is_effective(states[t], outcomes[t], near)]
        follow = {t: [u for u in useful if same(outcomes[t], states[u], near)] for t in useful}
        ends = {
            t: problem.gap(outcomes[t])
            for t in useful
            if same(outcomes[t], goal, near)
            and problem.gap(outcomes[t]) < problem.gap(problem.here)
        }
        sequences: list[tuple[int, ...]] = [
            (t,) for t in useful if same(problem.here, states[t], near)
        ]
        for n_actions in range(1, problem.depth + 1):
            if gaps := [ends[sequence[-1]] for sequence in sequences if sequence[-1] in ends]:
                return level, n_actions, min(gaps)
            sequences = [(*sequence, u) for sequence in sequences for u in follow[sequence[-1]]]
    return None


def check_that_none_is_better(problem: Problem) -> None:
    found, best = problem.merit(problem.plan()), best_by_trying_all(problem)
    assert (found is None) == (best is None)
    if found is not None and best is not None:
        assert found[:2] == best[:2]
        assert found[2] == pytest.approx(best[2], rel=1e-12, abs=1e-12)


@settings(max_examples=200)
@given(problems())
def test_no_sequence_of_triplets_is_better_than_the_plan(problem: Problem) -> None:
    check_that_none_is_better(problem)


@pytest.mark.parametrize("unit", [np.float64(0.1), np.float64(0.125)])
def test_no_sequence_is_better_where_long_ones_are_needed(unit: np.float64) -> None:
    random, lengths = np.random.default_rng(1), set()
    for _ in range(400):
        way = np.cumsum(random.integers(-5, 6, (9, random.integers(1, 4))), axis=0) * unit
        noise = random.integers(-1, 2, (8, way.shape[1])) * unit
        thresholds = np.sort(random.integers(0, 4, (3, way.shape[1])), axis=0) * unit
        first = int(random.integers(0, 5))
        here, goal = way[first], way[random.integers(first, first + 5)]
        problem = Problem(way[:-1] + noise, way[1:], thresholds, here, goal, depth=4)
        check_that_none_is_better(problem)
        lengths.add((problem.merit(problem.plan()) or (None, None))[1])
    assert lengths == {None, 0, 1, 2, 3, 4}


@pytest.mark.parametrize("n_variables", [14, 300])
@pytest.mark.parametrize("seed", range(8))
def test_no_sequence_is_better_in_many_variables(seed: int, n_variables: int) -> None:
    """As many as images have; in eighths, so that all sums are exact."""
    random, n_actions = np.random.default_rng(seed), 1 + seed % 4
    way = np.cumsum(random.integers(-6, 7, (9, n_variables)), axis=0) / 8
    states, outcomes = way[:-1] + random.integers(-1, 2, (8, n_variables)) / 8, way[1:]
    thresholds = np.sort(random.integers(1, 4, (4, n_variables)), axis=0) / 8
    thresholds[-1] = 0.5
    order = random.permutation(8)
    problem = Problem(states[order], outcomes[order], thresholds, way[0], way[n_actions], depth=4)
    check_that_none_is_better(problem)
    assert len(problem.plan().triplets) == n_actions


@settings(max_examples=100)
@given(problems())
def test_plan_is_consistent_with_its_triplets(problem: Problem) -> None:
    plan = problem.plan()
    assert plan.n_expanded >= 0
    assert plan.is_at_goal == (plan.level is not None and not plan.triplets)
    if plan.level is None:
        assert plan.triplets == ()
        return
    near, chosen = problem.thresholds[plan.level], list(plan.triplets)
    assert len(chosen) <= problem.depth
    before = problem.here
    for state, outcome in zip(problem.states[chosen], problem.outcomes[chosen], strict=True):
        assert same(before, state, near)
        assert is_effective(state, outcome, near)
        before = outcome
    assert same(before, problem.goal, near)
    assert plan.is_at_goal or problem.gap(before) < problem.gap(problem.here)


@settings(max_examples=100)
@given(problems(), st.randoms(use_true_random=False))
def test_the_order_of_the_triplets_does_not_matter(problem: Problem, random: object) -> None:
    order = list(range(len(problem.states)))
    random.shuffle(order)  # type: ignore[attr-defined]
    states, outcomes = problem.states[order], problem.outcomes[order]
    shuffled = replace(problem, states=states, outcomes=outcomes)
    one, other = problem.plan(), shuffled.plan()
    assert (one.level, one.n_expanded) == (other.level, other.n_expanded)
    for mine, theirs in ((problem.states, states), (problem.outcomes, outcomes)):
        np.testing.assert_array_equal(mine[list(one.triplets)], theirs[list(other.triplets)])


@settings(max_examples=100)
@given(problems())
def test_more_actions_never_make_the_level_coarser(problem: Problem) -> None:
    n_levels = len(problem.thresholds)
    plans = [replace(problem, depth=depth).plan() for depth in (1, 2, 3, 6)]
    levels = [n_levels if plan.level is None else plan.level for plan in plans]
    assert levels == sorted(levels, reverse=True)


@settings(max_examples=50)
@given(problems())
def test_planner_plans_the_same_when_reused_or_copied(problem: Problem) -> None:
    planner = Planner(
        Triplets(problem.states, problem.outcomes), DynamicAbstraction(problem.thresholds)
    )
    planner.plan(problem.goal, problem.here, problem.depth)
    assert planner.plan(problem.here, problem.goal, problem.depth) == problem.plan()
    assert copy.deepcopy(planner).plan(problem.here, problem.goal, problem.depth) == problem.plan()


def levels(*thresholds: list[float]) -> DynamicAbstraction:
    return DynamicAbstraction(np.array(thresholds))


def moves(states: list[list[float]], outcomes: list[list[float]]) -> Triplets:
    return Triplets(np.array(states), np.array(outcomes))


def steps_of_ten_centimetres(n: int) -> Triplets:
    """Along a line from 0, a centimetre short of it each time: state 0.1 k to 0.1 k + 0.09."""
    starts = np.arange(n, dtype=np.float64)[:, None] * 0.1
    return Triplets(starts, starts + 0.09)


def test_plans_match_a_hand_calculation() -> None:
    planner = Planner(steps_of_ten_centimetres(5), levels([0.005], [0.02], [0.05]))
    assert planner.plan([0.101], [0.195]) == Plan(1, (1,), 0)
    assert planner.plan([0.101], [0.192]) == Plan(0, (1,), 0)
    plan = planner.plan([0.1], [0.395])
    assert (plan.level, plan.triplets) == (1, (1, 2, 3))
    assert plan.n_expanded > 0
    assert planner.plan([0.2], [0.203]) == Plan(0, (), 0)
    assert planner.plan([0.2], [0.21]).is_at_goal
    assert planner.plan([0.4], [0.1]).level is None


def test_plan_length_is_limited_by_the_depth() -> None:
    planner = Planner(steps_of_ten_centimetres(30), levels([0.02]))
    goal = [1.09]
    assert planner.plan([0.0], goal, depth=11).triplets == tuple(range(11))
    assert planner.plan([0.0], goal, depth=10).level is None
    assert planner.plan([0.1], goal).triplets == tuple(range(1, 11))  # ten, as a trial has
    assert planner.plan([0.0], goal).level is None


def test_nearest_end_wins_among_equally_short_plans() -> None:
    outcomes = [[0.5, 0.53], [0.52, 0.52], [0.5, 0.51], [0.49, 0.52]]
    planner = Planner(Triplets(np.zeros((4, 2)), np.array(outcomes)), levels([0.1, 0.1]))
    assert planner.plan([0, 0], [0.5, 0.5]).triplets == (2,)


def test_shorter_plan_wins_even_if_it_ends_farther_away() -> None:
    triplets = moves([[0.0], [0.0], [0.5]], [[0.95], [0.5], [1.0]])
    plan = Planner(triplets, levels([0.1])).plan([0.0], [1.0])
    assert plan.triplets == (0,)


def test_shorter_plan_wins_even_if_it_first_leads_away() -> None:
    """Two actions by way of -0.5, and three that come nearer each time."""
    triplets = moves([[0.0], [0.33], [0.67], [0.0], [-0.5]], [[0.33], [0.67], [1.0], [-0.5], [1.0]])
    plan = Planner(triplets, levels([0.02])).plan([0.0], [1.0])
    assert plan.triplets == (3, 4)


def test_plan_may_jump_within_the_threshold_between_actions() -> None:
    """The first variable is moved by actions; in the second, all that matters is the threshold."""
    states = [[0.0, 9.0], [1.0, 15.0], [0.0, 9.9], [0.6, 15.0], [1.3, 15.0]]
    outcomes = [[1.0, 9.0], [2.0, 15.0], [0.6, 9.9], [1.3, 15.0], [2.0, 15.0]]
    planner = Planner(moves(states, outcomes), levels([0.05, 10.0]))
    assert planner.plan([0.0, 0.0], [2.0, 15.0]).triplets == (0, 1)


@pytest.mark.parametrize("order", [*permutations(range(4))])
def test_same_plan_is_taken_among_equally_good_ones(order: tuple[int, ...]) -> None:
    corners = np.array([[0.375, 0.375], [0.375, 0.625], [0.625, 0.375], [0.625, 0.625]])
    triplets = Triplets(np.zeros((4, 2)), corners[list(order)])
    plan = Planner(triplets, levels([0.25, 0.25])).plan([0.0, 0.0], [0.5, 0.5])
    assert [order[number] for number in plan.triplets] == [0]


def test_finer_level_wins_even_if_its_plan_is_longer() -> None:
    triplets = moves([[0.0], [0.0], [0.5]], [[0.95], [0.5], [1.0]])
    plan = Planner(triplets, levels([0.01], [0.1])).plan([0.0], [1.0])
    assert (plan.level, plan.triplets) == (0, (1, 2))


@pytest.mark.parametrize(("outcome", "n_actions"), [(0.0625, 1), (0.125, 0), (0.1875, 0)])
def test_a_plan_must_end_nearer_to_the_goal_than_it_begins(outcome: float, n_actions: int) -> None:
    """Before, the gap is 0.25; after, it is 0.125 more than in the second variable."""
    abstraction = levels([0.25, 0.25])
    planner = Planner(moves([[0.0, 0.0]], [[0.375, outcome]]), abstraction)
    assert len(planner.plan([0.0, 0.0], [0.25, 0.0]).triplets) == n_actions


def test_identical_states_are_not_the_same_where_a_threshold_is_zero() -> None:
    planner = Planner(moves([[0.0, 1.0]], [[1.0, 1.0]]), levels([0.5, 0.0]))
    assert planner.plan([0.0, 1.0], [1.0, 1.0]).level is None
    assert planner.plan([0.0, 1.0], [0.0, 1.0]).level is None


@pytest.mark.parametrize("n_variables", [1, 2, 14])
def test_without_triplets_there_is_no_plan(n_variables: int) -> None:
    nothing = Triplets(np.empty((0, n_variables)), np.empty((0, n_variables)))
    planner = Planner(nothing, DynamicAbstraction.learn(nothing))
    here = np.zeros(n_variables)
    assert planner.plan(here, here + 1) == planner.plan(here, here) == Plan(None, (), 0)
    by_hand = Planner(nothing, DynamicAbstraction.fixed(np.full(n_variables, 0.1)))
    assert by_hand.plan(here, here + 0.05).is_at_goal
    assert by_hand.plan(here, here + 1).level is None


@pytest.mark.parametrize(
    ("state", "goal", "complaint"),
    [
        ([0.0], [0.0, 0.0], "a state must be 2 finite numbers, not \\[0.0\\]"),
        ([0.0, 0.0], [0.0, 0.0, 0.0], "a goal must be 2 finite numbers"),
        ([0.0, np.nan], [0.0, 0.0], "a state must be 2 finite numbers, not \\[0.0, nan\\]"),
        ([0.0, 0.0], [np.inf, 0.0], "a goal must be 2 finite numbers, not \\[inf, 0.0\\]"),
        ([[0.0, 0.0]], [0.0, 0.0], "a state must be 2 finite numbers"),
    ],
)
def test_states_and_goals_that_do_not_fit_are_refused(
    state: list[float], goal: list[float], complaint: str
) -> None:
    planner = Planner(moves([[0.0, 0.0]], [[1.0, 1.0]]), levels([0.1, 0.1]))
    with pytest.raises(RealBenchError, match=complaint):
        planner.plan(state, goal)


def test_an_abstraction_of_other_variables_is_refused() -> None:
    with pytest.raises(RealBenchError, match="3 variables, the triplets have 2"):
        Planner(Triplets(np.zeros((1, 2)), np.ones((1, 2))), levels([0.1] * 3))


def test_tiny_thresholds_do_not_break_the_search() -> None:
    states = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 1.0]])
    outcomes = np.array([[0.5, 0.0], [1.0, 0.0], [0.5, 1.0]])
    here, goal = np.array([0.0, 0.0]), np.array([1.0, 0.0])
    problem = Problem(states, outcomes, np.array([[0.05, 2e-313]]), here, goal, depth=2)
    check_that_none_is_better(problem)
