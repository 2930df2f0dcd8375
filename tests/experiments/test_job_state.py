"""What becomes of results and recordings that are there before an experiment goes on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from real_bench.errors import ExperimentError, ResultError
from real_bench.experiments import Spec, read_spec
from real_bench.experiments.plan import ExperimentPlan
from real_bench.scoring import result_file
from real_bench.scoring.result import load_result
from tests.cli.shell import realbench
from tests.experiments.conftest import WriteSpec

RANDOM: dict[str, Any] = {"controller": "real_r", "condition": "OM"}


def test_damaged_files_are_replaced_with_overwrite(write_spec: WriteSpec, tmp_path: Path) -> None:
    """With --resume, too: there is nothing in them to go on from."""
    path = write_spec(cells=[RANDOM], repeats=1, steps=1000)
    shown = realbench(tmp_path, "table", path).stdout
    for resume in ((), ("--resume",)):
        for name in ("real_r-OM-1-seed0-few.json", "real_r-OM-1-seed0.h5"):
            (tmp_path / "results" / name).write_text("not at all")
        for options in ((), ("--no-run",)):
            refused = realbench(tmp_path, "table", path, *options, code=1).stderr
            assert "real_r-OM-1-seed0-few.json does not belong here: " in refused
            assert "replace them with --overwrite" in refused
        assert realbench(tmp_path, "table", path, "--overwrite", *resume).stdout == shown


def test_damaged_recording_is_refused_before_work(write_spec: WriteSpec, tmp_path: Path) -> None:
    spec = read_spec(write_spec(cells=[RANDOM], repeats=1))
    spec.results_folder.mkdir()
    (spec.results_folder / "real_r-OM-1-seed0.h5").write_text("not at all")
    with pytest.raises(ExperimentError, match=r"seed0\.h5 does not belong here"):
        ExperimentPlan(spec).pending()
    (play,) = ExperimentPlan(spec).pending(overwrite=True, resume=True).plays
    assert not play.resume


def test_finished_trials_are_kept_when_a_result_gets_too_large(
    drawn: Spec, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is begun again: it would end in the same error."""
    (job,) = ExperimentPlan(drawn).scorings(drawn.cells[2], 0)
    job.do(lambda done, busy="": None)
    size = job.out.stat().st_size
    job.out.unlink()
    monkeypatch.setattr(result_file, "MAX_FILE_BYTES", size - 100)  # times vary by a few
    reported: list[int] = []
    with pytest.raises(ResultError, match="earlier trials are kept"):
        job.do(lambda done, busy="": reported.append(done))
    assert reported == [job.trial_steps]
    monkeypatch.undo()
    assert len(load_result(job.out).trials) == 1


def test_result_of_another_test_is_begun_again(drawn: Spec) -> None:
    (job,) = ExperimentPlan(drawn).scorings(drawn.cells[2], 0)
    job.model_copy(update={"seed": 7}).do(lambda done, busy="": None)
    job.do(lambda done, busy="": None)
    assert load_result(job.out).setting.seed == 0
