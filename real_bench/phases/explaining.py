"""Record and draw why a controller chose each action of a trial."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.controls import MacroControl
from real_bench.errors import RealBenchError
from real_bench.explanation import Explanation
from real_bench.files.atomic import write_atomically
from real_bench.goal_sets import Goal
from real_bench.palette import AMBER, GREEN, ORANGE, SKY, WHITE, YELLOW
from real_bench.phases.proxy import ControllerProxy, fault
from real_bench.task import Task
from real_bench.text.counting import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = 5
PANEL_INCHES = 4.0
MARGIN_PX = 25
DOTS_PER_INCH = 80
GOAL, NOW, PUSH, LATER, EXPECTED, ACTUAL = GREEN, WHITE, ORANGE, AMBER, SKY, YELLOW
LEGEND = {
    "object now": NOW,
    "goal": GOAL,
    "next push": PUSH,
    "later pushes": LATER,
    "expected": EXPECTED,
    "outcome": ACTUAL,
}


@dataclass(frozen=True, eq=False)
class Decision:
    """One decision and its outcome.

    Attributes:
        explanation: what the controller says of it.
        image: what the camera saw before, (height, width, 3) uint8.
        before, after: the objects' true positions, (n_objects, 3) metres.
    """

    explanation: Explanation
    image: NDArray[np.uint8]
    before: NDArray[np.float64]
    after: NDArray[np.float64]

    @property
    def missed_by(self) -> list[float] | None:
        """How far each object ended from where it was expected, metres in x, y."""
        expected = self.explanation.positions
        if expected is None or len(expected) == 0:
            return None
        gaps = np.linalg.norm(np.asarray(expected)[0] - self.after[:, :2], axis=1)
        return [float(gap) for gap in gaps]

    def to_json(self) -> dict[str, Any]:
        """Everything but the image."""
        expected = self.explanation.positions
        return {
            "title": self.explanation.title,
            **self.explanation.facts,
            "expected_positions": None if expected is None else np.asarray(expected).tolist(),
            "positions_before": self.before.tolist(),
            "positions_after": self.after.tolist(),
            "missed_by": self.missed_by,
        }


class Explainer:
    """Collects the decisions of one trial. Explaining changes nothing in it."""

    def __init__(self, task: Task, goal: Goal) -> None:
        self._task, self._goal = task, goal
        self._decisions: list[Decision] = []

    @contextmanager
    def decision(self, proxy: ControllerProxy) -> Iterator[None]:
        """Note a decision that is made and carried out in this context."""
        image, before = self._task.simulation.image().retina, self._positions()
        yield
        explanation = proxy.explain() or Explanation("not explained", {})
        expected = explanation.positions
        if expected is not None and expected.shape[1] != len(before):
            raise fault(
                proxy, f"explain() gives positions of {counted(expected.shape[1], 'object')}"
            )
        self._decisions.append(Decision(explanation, image, before, self._positions()))

    def save(self, folder: Path, name: str) -> None:
        """Write ``name.json`` and ``name.png``; raises RealBenchError."""
        try:
            record = {
                "challenge": self._goal.challenge,
                "goal_positions": self._goal.final_poses[:, :3].tolist(),
                "decisions": [decision.to_json() for decision in self._decisions],
            }
            text = json.dumps(record, indent=1, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise RealBenchError(f"an explanation cannot be written as JSON: {error}") from error
        write_atomically(folder / f"{name}.json", (text + "\n").encode())
        self._draw(folder / f"{name}.png", name)

    def _positions(self) -> NDArray[np.float64]:
        return self._task.simulation.object_poses()[:, :3]

    def _draw(self, path: Path, name: str) -> None:
        from matplotlib.figure import Figure
        from matplotlib.lines import Line2D

        n_rows = -(-len(self._decisions) // COLUMNS)
        size = (COLUMNS * PANEL_INCHES, n_rows * PANEL_INCHES * 0.7 + 0.8)
        figure = Figure(figsize=size, dpi=DOTS_PER_INCH, layout="constrained")
        axes = np.atleast_1d(figure.subplots(n_rows, COLUMNS)).ravel()
        for panel in axes:
            panel.set_axis_off()
        for number, (panel, decision) in enumerate(zip(axes, self._decisions, strict=False), 1):
            self._draw_decision(panel, number, decision)
            self._zoom(panel)
        keys = [
            Line2D([], [], color=colour, marker="o", linestyle="", markeredgecolor="black")
            for colour in LEGEND.values()
        ]
        figure.legend(keys, LEGEND, loc="outside lower center", ncols=len(LEGEND), frameon=False)
        figure.suptitle(f"{name} ({self._goal.challenge})")
        stream = io.BytesIO()
        figure.savefig(stream, format="png")
        write_atomically(path, stream.getvalue())

    def _draw_decision(self, panel: Axes, number: int, decision: Decision) -> None:
        explanation = decision.explanation
        panel.imshow(decision.image)
        missed = decision.missed_by
        below = f"\nmissed by {100 * max(missed):.1f} cm" if missed else ""
        panel.set_title(f"{number}. {explanation.title}{below}", fontsize=10, parse_math=False)
        height = float(decision.before[:, 2].min())
        for rank, action in reversed(list(enumerate(explanation.actions))):
            self._draw_push(panel, action, height, PUSH if rank == 0 else LATER)
        self._mark(panel, self._goal.final_poses[:, :3], GOAL, "s", 13)
        if explanation.positions is not None and len(explanation.positions):
            self._draw_expected(panel, decision, np.asarray(explanation.positions))
        self._mark(panel, decision.before, NOW, "o", 8)
        self._mark(panel, decision.after, ACTUAL, "X", 8)

    def _zoom(self, panel: Axes) -> None:
        """Show what the trial is about: its objects, goals and planned pushes, with a margin."""
        points = [self._goal.final_poses[:, :3]]
        for decision in self._decisions:
            height = float(decision.before[:, 2].min())
            pushes = [_push_endpoints(action, height) for action in decision.explanation.actions]
            points += [
                decision.before,
                decision.after,
                *(endpoints for endpoints in pushes if endpoints is not None),
            ]
        pixels = self._pixels(np.vstack(points))
        height_px, width_px, _ = self._decisions[0].image.shape
        left, top = np.maximum(pixels.min(axis=0) - MARGIN_PX, 0)
        right, bottom = np.minimum(pixels.max(axis=0) + MARGIN_PX, [width_px, height_px])
        panel.set_xlim(left, right)
        panel.set_ylim(bottom, top)

    def _draw_push(self, panel: Axes, action: Action, height: float, colour: str) -> None:
        endpoints = _push_endpoints(action, height)
        if endpoints is not None:
            start, end = self._pixels(endpoints)
            arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 2}
            panel.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=arrow)

    def _draw_expected(
        self, panel: Axes, decision: Decision, positions: NDArray[np.float64]
    ) -> None:
        for index, start in enumerate(decision.before):
            heights = np.full((len(positions), 1), start[2])
            path = np.vstack([start, np.hstack([positions[:, index], heights])])
            pixels = self._pixels(path)
            panel.plot(*pixels.T, ".-", color=EXPECTED, linewidth=1.5, markersize=7)

    def _mark(
        self, panel: Axes, points: NDArray[np.float64], colour: str, marker: str, size: float
    ) -> None:
        pixels = self._pixels(points)
        panel.plot(
            *pixels.T,
            linestyle="",
            marker=marker,
            markersize=size,
            markerfacecolor="none" if marker == "s" else colour,
            markeredgecolor=colour if marker == "s" else "black",
            markeredgewidth=2 if marker == "s" else 0.8,
        )

    def _pixels(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return self._task.simulation.camera.pixels(points)


def _push_endpoints(action: Action, height: float) -> NDArray[np.float64] | None:
    """The two ends of a macro, (2, 3) metres; other actions have no way that could be drawn."""
    command = action.commands[0]
    if command.shape != (MacroControl.size,) or np.isnan(command).any():
        return None
    return np.column_stack([command.reshape(2, 2), [height, height]])
