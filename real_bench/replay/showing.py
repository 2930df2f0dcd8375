"""Show a replay as a film, or in pybullet's window at the robot's speed."""

from __future__ import annotations

import time
from pathlib import Path

from real_bench.goal_sets import captioned
from real_bench.phases.film import STEPS_PER_FRAME, Film
from real_bench.replay.part import Frame, OnAction, PartReplay
from real_bench.simulation import STEP_S

STEPS_PER_REFRESH = 4  # 50 a second


def film_part(replay: PartReplay, out: Path, report: OnAction) -> bool:
    """Film a part of a recording, labelled with condition, action and step.

    Returns:
        Whether all went as it was recorded.

    Raises:
        RealBenchError: it cannot be replayed, or the film cannot be written.
        Interrupted: the user stopped it; there is no film then.
    """
    film = Film(out)

    def shoot(shown: Frame) -> None:
        remark = "" if shown.as_recorded else " (differs)"
        label = f"{shown.task.condition.name}, action {shown.number:,}, step {shown.step:,}{remark}"
        film.add(captioned([shown.task.simulation.image().retina], [label]))

    as_recorded = replay.run(shoot, STEPS_PER_FRAME, report)
    film.close()
    return as_recorded


def show_part(replay: PartReplay, report: OnAction) -> bool:
    """Show a part of a recording in pybullet's window, in real time.

    Returns:
        Whether all went as it was recorded.

    Raises:
        RealBenchError: it cannot be replayed, or there is no display.
        Interrupted: the user stopped it.
    """
    due: list[float] = []  # when the next frame is due, once the part has begun

    def wait(shown: Frame) -> None:
        now = time.monotonic()
        if due:
            time.sleep(max(0.0, due[0] - now))
        due[:] = [max([now, *due]) + STEPS_PER_REFRESH * STEP_S]

    return replay.run(wait, STEPS_PER_REFRESH, report, gui=True)
