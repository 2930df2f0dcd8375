"""A metric is one entry, and an interval is the same wherever it stands."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from rich.console import Console, RenderableType

from real_bench.cli.compare import compare
from real_bench.cli.score import score
from real_bench.experiments import Spec
from real_bench.experiments.plan import ExperimentPlan
from real_bench.experiments.scores import rows_of
from real_bench.experiments.table import json_table, markdown_table, text_table
from real_bench.report import Report, read_tested
from real_bench.report.page import render
from real_bench.scoring import METRICS, Metric
from real_bench.scoring.repeats import by_goal, summarise_repeats
from real_bench.scoring.result import Result, load_result
from real_bench.scoring.summary import summarise, summary_json
from real_bench.scoring.table import score_table
from real_bench.scoring.verdict import judge, markdown
from tests.experiments.conftest import keep
from tests.scoring.bench import made

INTERVAL = re.compile(r"\d\.\d{3} to \d\.\d{3}")


def text(what: RenderableType) -> str:
    console = Console(width=200, file=io.StringIO(), record=True)
    console.print(what)
    return console.export_text()


def test_one_new_entry_adds_a_metric_everywhere(
    drawn: Spec, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = [str(keep(drawn, repeat=repeat)) for repeat in (0, 1)]
    monkeypatch.setitem(METRICS, "toy", Metric("toys", lambda trial: trial.goal + 0.5, form=".2f"))
    rows = rows_of(drawn, ExperimentPlan(drawn))
    assert "toys" in markdown_table(drawn, rows)
    assert "1.00" in text(text_table(drawn, rows))
    assert json_table(drawn, rows)["rows"][0]["summary"]["metrics"]["toy"]["mean"] == 1.0
    result = load_result(Path(files[0]))
    assert "toys" in text(score_table(result))
    assert [goal["toy"] for goal in summary_json(result)["goals"]] == [0.5, 1.5]
    page = render(Report("title", tests=[read_tested(Path(files[0]))]))
    assert page.count(">toys</th>") == 2
    assert '<td data-name="toys">1.50</td>' in page
    assert "| toys" in markdown(judge([result]))
    run = CliRunner().invoke
    assert "toys" in run(compare, files).stdout
    told = json.loads(run(compare, [*files, "--json"]).stdout)
    assert told["metrics"]["toy"]["difference"] == 0.0
    told = json.loads(run(score, [files[0], "--json", "--allow-part"]).stdout)
    assert told["summary"]["metrics"]["toy"]["by_repeat"] == [1.0]


def distances(seed: int) -> list[float]:
    return [0.02 + 0.3 * ((7 * goal + 3 * seed) % 10) / 10 for goal in range(20)]


def test_intervals_of_one_result_are_the_same_everywhere(tmp_path: Path) -> None:
    result = made(distances(0))
    result.save(tmp_path / "a.json")
    total = summarise(result.trials)[-1].means["score"].interval
    assert total is not None
    tested = read_tested(tmp_path / "a.json")
    pages = [
        next(line for line in text(score_table(result)).splitlines() if "total" in line),
        " ".join(tested.rows[-1]),
        next(line for line in markdown(judge([result])).splitlines() if "| score" in line),
    ]
    assert [INTERVAL.findall(page) for page in pages] == [[str(total)]] * 3
    assert judge([result]).summary.score.interval == total
    everywhere = (text(score_table(result)), " ".join(tested.headings), markdown(judge([result])))
    for page in everywhere:
        assert "95% over goals" in page


def test_intervals_over_plays_match_in_table_and_score(drawn: Spec) -> None:
    results: list[Result] = [
        made(distances(seed), seed, run_sha256=f"{seed}" * 64) for seed in range(4)
    ]
    summary = summarise_repeats(by_goal(results))
    assert summary.score.interval is not None
    page = markdown(judge(results))
    assert "95% over plays and goals" in page
    assert str(summary.score.interval) in page
    for repeat in (0, 1):
        keep(drawn, repeat=repeat)
    row = rows_of(drawn, ExperimentPlan(drawn))[0]
    assert row.summary is not None
    kept = [load_result(file) for file in row.files]
    assert row.summary.to_json() == judge(kept).summary.to_json()
