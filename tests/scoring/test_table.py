from __future__ import annotations

import io
import re

from rich.console import Console

from real_bench.scoring.parts import describe_play, describe_sum
from real_bench.scoring.result import Result
from real_bench.scoring.table import score_table
from tests.scoring import bench


def test_the_table_shows_every_class_and_the_total(result: Result) -> None:
    console = Console(width=80, file=io.StringIO(), record=True)
    console.print(score_table(result))
    text = console.export_text()
    rows = [re.split(r"\s{2,}", line.strip()) for line in text.splitlines()]
    cells = {row[0]: row[1:] for row in rows if row}
    assert "95% over goals" in text
    assert cells["2D"] == ["2", "1.250", "0.500 to 2.000", "0.050", "50%", "10.0"]
    assert cells["3D"] == ["1", "0.125", "-", "0.200", "0%", "10.0"]
    assert cells["total"][:2] == ["3 of 4", "0.875"]
    assert "a part: only 3 of 4 goals of the set" in text
    assert "real_r in REAL_OM, 2 objects, scene builtin, without play" in text
    assert "scores of 2 objects are added: they go up to 2" in text


def test_only_what_can_be_misread_is_remarked_on() -> None:
    made_of = bench.made([0.1] * 20).setting
    assert describe_sum(made_of.objects) == []
    assert describe_play(made_of) == "without play"
    played = made_of.model_copy(update={"run_steps": 5000})
    assert describe_play(played) == "after 5,000 steps of play"
    made = played.model_copy(update={"learned_from": "nothing"})
    assert describe_play(made) == "as made, nothing learned from 5,000 steps of play"
