"""Terminals narrower than numbers need: the numbers are there, and whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from real_bench.progress.display import ProgressDisplay
from real_bench.scoring.result import load_result
from tests.outside.bench import command

WIDTHS = ["0", "1", "10", "30", "40", "80", "200", "many", ""]


@pytest.mark.parametrize("width", WIDTHS)
def test_compare_shows_whole_numbers_at_any_width(
    place: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, width: str
) -> None:
    result = load_result(place / "score.json")
    setting = result.setting.model_copy(update={"seed": 7})
    result.model_copy(update={"setting": setting}).save(place / "other.json")
    monkeypatch.setenv("COLUMNS", width)
    done = command(capfd, "compare", "score.json", "other.json")
    assert done.code == 0
    for trial in result.trials:
        assert done.out.count(f"{trial.score:.3f}") >= 2
    assert "…" not in done.out


@pytest.mark.parametrize("width", WIDTHS)
def test_score_table_shows_whole_numbers_at_any_width(
    place: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, width: str
) -> None:
    monkeypatch.setenv("COLUMNS", width)
    test = ("--controller", "real_r", "--scene", "builtin", "--condition", "OM")
    done = command(capfd, "extrinsic", *test, "--goals", "goals.npy", "--out", "new.json")
    assert done.code == 0
    assert f"{load_result(place / 'new.json').score:.3f}" in done.out
    assert "95% over goals" in done.out
    assert "…" not in done.out


@pytest.mark.parametrize("width", WIDTHS)
def test_experiment_table_shows_whole_numbers_at_any_width(
    place: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, width: str
) -> None:
    monkeypatch.setenv("COLUMNS", width)
    done = command(capfd, "table", "tiny.yaml", "--no-run")
    assert done.code == 0
    assert "0.021 ± 0.002" in done.out
    assert "mean ± s.e." in done.out
    assert "…" not in done.out


@pytest.mark.parametrize("width", ["0", "25", "40", "71"])
def test_narrow_progress_bar_becomes_a_log(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, width: str
) -> None:
    monkeypatch.setenv("COLUMNS", width)
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal
    with ProgressDisplay("playing a_long_name", "steps", 15_000_000) as display:
        display._last_line = -1e9
        display.update(14_567_890, "fast")
    assert "14,567,890 of 15,000,000 steps" in capfd.readouterr().err


@pytest.mark.parametrize("width", ["72", "100"])
def test_wide_progress_bar_shows_all_its_numbers(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, width: str
) -> None:
    monkeypatch.setenv("COLUMNS", width)
    monkeypatch.setenv("FORCE_COLOR", "1")
    with ProgressDisplay("playing a_long_name", "steps", 15_000_000) as display:
        display.update(14_567_890, "fast")
        display._bar.refresh()
    assert "14567890/15000000" in capfd.readouterr().err
