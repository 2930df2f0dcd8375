"""Whether results are repeats of one test: only those are averaged."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from real_bench.errors import ResultError
from real_bench.scoring.result import Result, Setting
from real_bench.settings import dotted
from real_bench.text.counting import tallied_if_mixed
from real_bench.text.quoting import quoted
from real_bench.version import SOURCE

NAMES = {
    "controller": "controller",
    "controller_sha256": "code of the controller",
    "condition": "condition",
    "control_version": "control version",
    "objects": "objects",
    "scene_sha256": "scene sha256",
    "run_steps": "run steps",
    "trial_steps": "trial steps",
}
"""What must agree between the results of one test, and what it is called; settings, too."""


def check_one_test(results: Sequence[Result]) -> None:
    """Check that results are of one controller, tested alike; goals and seeds may differ.

    Raises:
        ResultError: they are not; the message says in what they differ.
    """
    differences = list(_differences([result.setting for result in results]))
    if differences:
        raise ResultError(f"results of different tests are never averaged: {differences[0]}")


def sources_of(results: Sequence[Result]) -> tuple[str, ...]:
    """The hash of realbench's own code that each result keeps; ``unknown`` if it is older."""
    return tuple(result.setting.versions.get(SOURCE, "unknown") for result in results)


def mixed_sources(sources: Sequence[str]) -> str:
    """A remark on results made by different code of realbench; empty if all are of one."""
    counts = tallied_if_mixed(map(quoted, sources))
    remark = (
        f"results of different code of realbench are averaged ({counts}): "
        "its own controllers may have changed in between"
    )
    return remark if counts else ""


def _differences(settings: Sequence[Setting]) -> Iterator[str]:
    for name, called in NAMES.items():
        values = sorted({str(getattr(setting, name)) for setting in settings})
        if len(values) > 1:
            yield f"{called} {_listed(value[:24] for value in values)}"
    yield from _changed("settings", [setting.settings for setting in settings])
    learned = [setting.learned for setting in settings if setting.learned]
    if 0 < len(learned) < len(settings):
        yield "some continued from what was learned at play, others did not"
    known = {setting.learned_from for setting in settings if setting.learned_from}
    if len(known) > 1:
        yield f"learned from {_listed(sorted(known))}"
    code = sorted({each.code_sha256 for each in learned})
    if len(code) > 1:
        yield f"code that learned {_listed(value[:24] for value in code)}"
    yield from _changed("settings that learned", [each.settings for each in learned])


def _changed(called: str, settings: Sequence[dict[str, Any]]) -> Iterator[str]:
    """The first value by which some settings differ from the first ones."""
    plain = [dict(dotted(values)) for values in settings]
    for other in plain[1:]:
        for name in sorted({*plain[0], *other}):
            values = [each.get(name, "none") for each in (plain[0], other)]
            if values[0] != values[1]:
                yield f"{called} {_listed(f'{name}={value}' for value in values)}"


def _listed(values: Iterable[str]) -> str:
    return " and ".join(quoted(value, 80) for value in values)
