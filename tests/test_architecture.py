"""The direction of dependencies, as docs/architecture.md tells it; imports in functions count."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import real_bench

ROOT = Path(real_bench.__file__).parent
FILES = {
    ".".join([ROOT.name, *file.relative_to(ROOT).with_suffix("").parts]).removesuffix(
        ".__init__"
    ): file
    for file in ROOT.rglob("*.py")
}
HELPERS = {"errors", "files", "inputs", "lazy", "lengths", "text"}


def imports(module: str) -> set[str]:
    """The modules of ours that a module imports, except for type checkers alone."""
    return set(_imports(ast.parse(FILES[module].read_text()))) - {module}


def _imports(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Import):
        yield from (each.name for each in node.names if each.name in FILES)
    if isinstance(node, ast.ImportFrom) and node.module in FILES:
        for each in node.names:
            submodule = f"{node.module}.{each.name}"
            yield submodule if submodule in FILES else node.module
    for child in ast.iter_child_nodes(node):
        yield from _imports(child)


@cache
def graph() -> dict[str, set[str]]:
    """What each module imports."""
    return {module: imports(module) for module in FILES}


def part(module: str) -> str:
    """The folder or file at the top of the package in which a module lies."""
    return [*module.split("."), ""][1]


def known_to(name: str) -> set[str]:
    """The parts of the package that a part of it knows, directly or through others."""
    found: set[str] = set()
    left = [module for module in graph() if part(module) == name]
    assert left
    while left:
        more = graph()[left.pop()] - found
        found |= more
        left += more
    return {part(module) for module in found} - {name}


def test_no_module_imports_itself_through_others() -> None:
    assert "real_bench.simulation.scene" in graph()["real_bench.task"]
    TopologicalSorter(graph()).prepare()  # CycleError names the modules of a circle


def test_no_part_knows_itself_through_others() -> None:
    """A part is a folder or a file at the top of the package."""
    parts: dict[str, set[str]] = {}
    for module in graph():
        others = {part(other) for other in graph()[module]} - {part(module)}
        parts.setdefault(part(module), set()).update(others)
    assert "simulation" in parts["task"]
    TopologicalSorter(parts).prepare()


def test_command_line_is_known_to_nobody() -> None:
    knowing = {module for module in graph() if "cli" in map(part, graph()[module])}
    assert {part(module) for module in knowing} == {"cli", "__main__"}


def test_simulation_knows_helpers_alone() -> None:
    assert known_to("simulation") <= HELPERS


@pytest.mark.parametrize(
    ("name", "others"),
    [
        ("controls", {"task", "recording", "phases"}),
        ("task", {"recording", "scoring", "phases", "controller"}),
        ("recording", {"task", "scoring", "phases", "controller"}),
        ("scoring", {"task", "phases"}),
        ("phases", {"sandbox", "experiments", "competition", "progress", "real_x", "real_g"}),
        ("sandbox", {"scoring", "experiments", "competition", "verification", "progress"}),
        ("real_x", {"task", "phases", "scoring", "real_g"}),
        ("real_g", {"task", "phases", "scoring"}),
        ("experiments", {"progress", "competition", "verification", "figures", "report"}),
        ("replay", {"verification", "competition", "experiments", "exporting", "sandbox"}),
        ("verification", {"competition", "experiments", "progress", "report", "figures"}),
        ("controller_code", {"task", "phases", "sandbox", "scoring", "competition"}),
        ("competition", {"progress", "real_x", "real_g"}),
        ("progress", {"experiments", "phases", "competition"}),
    ],
)
def test_parts_do_not_know_what_builds_on_them(name: str, others: set[str]) -> None:
    assert others <= {part(module) for module in graph()}
    assert known_to(name).isdisjoint(others)


def test_only_simulation_and_the_macro_use_pybullet() -> None:
    bullet = "real_bench.simulation.bullet"
    using = {module for module in graph() if bullet in graph()[module]}
    assert {module for module in using if part(module) != "simulation"} == {
        "real_bench.controls.macro"
    }
