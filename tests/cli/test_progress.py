"""Progress as a log shows it."""

from __future__ import annotations

import pytest

from real_bench.cli import progress


def test_a_log_gets_a_line_now_and_then(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "SECONDS_BETWEEN_LINES", -1)
    with progress.ProgressDisplay("playing", "steps", 3000) as display:
        display.update(1000, "fast")
        display.update(2000, "")
    printed = capsys.readouterr()
    first, second = printed.err.splitlines()
    assert first == "playing: 1,000 of 3,000 steps, fast"  # no rate is known yet
    assert second.startswith("playing: 2,000 of 3,000 steps, about ")
    assert second.endswith(" s left")
    assert printed.out == ""


def test_a_short_piece_of_work_is_silent_in_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.ProgressDisplay("playing", "steps", 3) as display:
        display.update(1)
    assert capsys.readouterr().err == ""
