"""Fixtures that all tests share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from real_bench.errors import SceneError
from real_bench.simulation import Scene, load_scene
from real_bench.simulation.install import install_scene
from real_bench.simulation.scene import manifest_path, read_manifest

SHARED = Path(__file__).parents[2] / "shared"
CHROMIUM = Path("/usr/bin/chromium")


@pytest.fixture(scope="session")
def official_scene() -> Scene:
    """The official scene, installed where it is not; skipped where it cannot be had."""
    try:
        return load_scene("official")
    except SceneError:
        pass
    try:
        install_scene(read_manifest(manifest_path("official")))
    except SceneError as error:
        pytest.skip(f"scene official is not installed and cannot be downloaded: {error}")
    return load_scene("official")


@pytest.fixture(scope="session")
def builtin_scene() -> Scene:
    return load_scene("builtin")


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of recordings and goals that may lie beside the repository."""
    if not SHARED.is_dir():
        pytest.skip(f"{SHARED} is not here")
    return SHARED


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Headless Chromium, driven by Playwright; each test opens pages of its own."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if not CHROMIUM.exists():
        pytest.skip(f"{CHROMIUM} is not installed")
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=str(CHROMIUM), args=["--no-sandbox", "--disable-gpu"]
        )
        yield browser
        browser.close()


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """After ``pytest -m attacks``: every attack, and what came of it."""
    if config.option.markexpr != "attacks":
        return
    outcomes = {"passed": "no harm", "failed": "HARM", "error": "NOT TRIED", "skipped": "not here"}
    terminalreporter.section("attacks")
    for outcome, meaning in outcomes.items():
        for report in terminalreporter.stats.get(outcome, []):
            file, _, name = report.nodeid.rpartition("/")[2].partition("::")
            what = name.removeprefix("test_").replace("_", " ").replace("[", ": ").rstrip("]")
            where = file.removeprefix("test_").removesuffix(".py").replace("_", " ")
            terminalreporter.write_line(f"{meaning:9}  {where}: {what}")
    counts = ", ".join(
        f"{len(terminalreporter.stats.get(outcome, []))} {meaning}"
        for outcome, meaning in outcomes.items()
    )
    terminalreporter.write_line(counts)
