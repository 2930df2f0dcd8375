"""The numbers beside each figure are those of the analyses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from real_bench import analysis
from real_bench.errors import RealBenchError
from real_bench.figures import FIGURES, FigureData, FigureOptions, Numbers, Play, facts, logged
from real_bench.scoring.statistics import goals_interval
from tests.figures.bench import FEW_STEPS, Test, made_up, only, read, reread

DRAW = {kind.name: kind.draw for kind in FIGURES}


def numbers(name: str, material: FigureData) -> dict[str, NDArray[Any]]:
    drawing = DRAW[name](material)
    assert drawing is not None
    return {column: np.array(values) for column, values in drawing.numbers.columns.items()}


def play(material: FigureData, name: str) -> Play:
    return only(material, name).plays[0]


@pytest.mark.parametrize("name", ["effective-actions", "effective-actions-latent"])
def test_effective_actions_match_the_analysis(material: FigureData, name: str) -> None:
    pushed = play(material, "pushed")
    assert pushed.sight is not None
    triplets = pushed.places if name == "effective-actions" else pushed.sight.codes
    abstraction = pushed.abstraction(triplets)
    told = numbers(name, only(material, "pushed"))
    counts = analysis.effective_actions(triplets, abstraction)
    n_variables = triplets.n_variables
    assert told["level"].tolist() == np.repeat(range(200), n_variables).tolist()
    assert told["effective_actions"][::n_variables].tolist() == counts.tolist()
    column = "threshold_cm" if name == "effective-actions" else "threshold_latent_units"
    scale = 100 if name == "effective-actions" else 1
    thresholds = told[column].reshape(200, n_variables)
    np.testing.assert_allclose(thresholds, scale * abstraction.thresholds)


def test_every_object_has_thresholds(material: FigureData) -> None:
    told = numbers("effective-actions", only(material, "two"))
    assert set(told["variable"]) == {"cube x", "cube y", "tomato x", "tomato y"}


@pytest.mark.parametrize("name", ["latent-distances", "latent-distances-near"])
def test_every_pair_is_in_one_bin(material: FigureData, name: str) -> None:
    pushed = play(material, "pushed")
    assert pushed.sight is not None
    pairs = pushed.sight.pairs
    if name == "latent-distances-near":
        pairs = pairs.within(*analysis.NEAR_M)
    told = numbers(name, only(material, "pushed"))
    assert told["pairs"].sum() == len(pairs.real) > 1000
    for row in range(len(told["pairs"])):
        inside = np.ones(len(pairs.real), bool)
        for axis, values in (("real_cm", 100 * pairs.real), ("latent", pairs.latent)):
            low, high = told[f"{axis}_from"][row], told[f"{axis}_to"][row]
            last = high == told[f"{axis}_to"].max()  # the last bin takes in its upper end
            inside &= (values >= low) & ((values <= high) if last else (values < high))
        assert told["pairs"][row] == inside.sum()


def test_action_lengths_match_the_analysis(material: FigureData) -> None:
    lengths = analysis.action_lengths(play(material, "pushed").displacements)
    assert len(lengths) > 2
    told = numbers("action-lengths", only(material, "pushed"))
    edges = [*told["cm_from"], told["cm_to"][-1]]
    assert told["actions"].tolist() == np.histogram(100 * lengths, edges)[0].tolist()
    assert told["actions"].sum() == len(lengths)


def test_displacements_are_counted_by_period(material: FigureData) -> None:
    pushed = play(material, "pushed")
    long = replace(
        pushed,
        displacements=np.tile(pushed.displacements, (150, 1)),
        ended_at=1000 * np.arange(1, 150 * len(pushed.displacements) + 1),
    )
    told = numbers("displacements", FigureData((long,)))
    assert told["displacements"].tolist() == analysis.moves_by_period(long.displacements).tolist()
    assert told["actions"].tolist() == [500, 250]
    assert told["until_step"].tolist() == [500_000, 750_000]


def test_discoveries_are_counted_by_period(material: FigureData) -> None:
    n = 750
    made = replace(
        play(material, "pushed"),
        displacements=np.column_stack([np.full(n, 0.02), np.where(np.arange(n) < 100, 0.3, 0)]),
        raised=np.column_stack([np.full(n, -0.1), np.where(np.arange(n) < 500, 0, 0.1)]),
        ended_at=1000 * np.arange(1, n + 1),
    )
    told = numbers("discoveries", FigureData((made,)))
    assert told["until_step"].tolist() == [500_000, 750_000]
    assert told["actions"].tolist() == [500, 250]
    assert told["moved"].tolist() == [1, 1]
    assert told["far"].tolist() == [0.2, 0]
    assert told["raised"].tolist() == [0, 1]


def test_scores_of_goals_are_means_of_repeated_tests(material: FigureData) -> None:
    told = numbers("score-by-goal", material)
    who = np.char.add(told["controller"], told["condition"])
    assert set(who) == {"REAL-LDIM", "REAL-LDIJ", "REAL-DOM"}
    results = [one.result for one in material.tested[:2]]
    rows = who == "REAL-LDIM"
    assert told["runs"][rows].tolist() == [2] * 4
    assert told["run_steps"][rows].tolist() == [15_000_000] * 4  # not that after less play
    order = [0, 1, 2, 3]
    np.testing.assert_allclose(told["score"][rows], analysis.scores_by_goal(results)[1][order])
    assert told["class"][rows].tolist() == ["2D", "2D", "2.5D", "3D"]


def test_scores_by_length_match_the_analysis(material: FigureData) -> None:
    told = numbers("score-by-length", material)
    assert set(told["condition"]) == {"IM"}  # the others were tested after one length only
    results = [material.tested[i].result for i in (4, 0, 1)]
    lengths, means = analysis.score_by_length(results)
    assert told["run_steps"].tolist() == lengths.tolist() == [1_000_000, 15_000_000]
    np.testing.assert_allclose(told["score"], means)
    classes, by_goal = analysis.scores_by_goal(results[1:])
    interval = goals_interval(by_goal, classes)
    assert interval is not None
    assert told["goals_interval_low"][1] == interval.low
    assert told["goals_interval_high"][1] == interval.high


def test_coverage_counts_every_state(material: FigureData) -> None:
    told = numbers("coverage", only(material, "two"))
    two = play(material, "two")
    for number, name in enumerate(two.header.object_names):
        rows = told["object"] == name
        assert told["states"][rows].sum() == len(two.positions)
        x, y = 100 * two.positions[0, number, :2]
        here = (told["x_cm_from"] <= x) & (x < told["x_cm_to"])
        here &= (told["y_cm_from"] <= y) & (y < told["y_cm_to"])
        assert (rows & here).sum() == 1


def test_facts_match_the_analyses(material: FigureData) -> None:
    told = facts(material, FigureOptions(seed=0))
    pushed, learned, one, still, two = told["recordings"]
    real = play(material, "pushed")
    assert real.sight is not None
    assert pushed["actions"] == 5
    assert pushed["steps"] == 5000
    assert pushed["actions_that_moved_an_object"]["all"] == (real.displacements > 0.01).sum()
    told_all = pushed["sight"]["latent_against_real"]["all"]
    assert told_all["spearman"] == round(real.sight.pairs.spearman, 3)
    assert [learned["sight"]["weights"], pushed["sight"]["weights"]] == ["recorded", "learned now"]
    assert one["sight"] is None  # one action makes no pair
    assert still["actions_that_moved_an_object"]["all"] == 1  # the cube begins in the air
    assert still["threshold_of_1_cm"] is None
    assert 0 < pushed["share_of_cells_visited"]["cube"]["table"] < 0.2
    assert set(two["share_of_cells_visited"]) == {"cube", "tomato"}
    assert told["results"][0]["score"] == material.tested[0].result.score


def test_columns_of_unequal_length_are_refused() -> None:
    with pytest.raises(RealBenchError, match="equally long: a 1, b 2"):
        Numbers({"a": [1], "b": [1, 2]})
    assert Numbers({"a": [0.1 + 0.2, 1e-30], "b": ["x, y", "z"]}).csv() == (
        b'a,b\n0.3,"x, y"\n1e-30,z\n'
    )


def test_goals_without_a_result_are_left_out(
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    folder = tmp_path_factory.mktemp("one")
    told = numbers("score-by-goal", FigureData((), reread(folder, made_up(Test(), [0.1]))))
    assert told["goal"].tolist() == [0]
    assert told["score"].tolist() == pytest.approx([0.25])


def test_logged_numbers_are_drawn_by_name(folder: Path, material: FigureData) -> None:
    drawing = logged.draw(only(material, "pushed", "two"))
    assert drawing is not None
    panels = drawing.figure.axes
    assert [panel.get_title() for panel in panels] == ["side", "way (m)"]
    columns = drawing.numbers.columns
    assert columns["name"] == ["side", "way (m)"] * 5
    assert columns["step"] == [step for step in range(1000, 6000, 1000) for _ in range(2)]
    assert columns["value"][1::2] == pytest.approx([0.02, 0.04, 0.06, 0.08, 0.1])
    (line,) = panels[0].lines
    assert np.asarray(line.get_ydata()).tolist() == [-1, 1, -1, 1, -1]
    early = read(folder / "pushed.h5", options=FigureOptions(FEW_STEPS, run_steps=2000))
    assert len(early[0].logged) == 4
    assert logged.draw(only(material, "two")) is None
