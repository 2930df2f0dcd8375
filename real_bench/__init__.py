"""Realbench: the REAL benchmark of robot open-ended autonomous learning.

>>> import real_bench
>>> env = real_bench.make_env(scene="builtin", condition="OM", objects=1)
>>> observation, info = env.reset(seed=0)

The names below are loaded on first use.

========================= ======================================================================
environment               ``make_env``; or ``gymnasium.make("RealBench/REAL-OM-v0")``
a controller of your own  ``Controller`` (or the official ``BasePolicy``), ``Action``, ``Settings``
the two phases            ``run_intrinsic`` plays, ``run_extrinsic`` tests
many of them              ``run_experiment``
data                      ``Recording``, ``Experience``, ``GoalSet``, ``load_goals``
scores                    ``load_result``; ``score`` judges, ``compare`` compares
figures                   ``draw_figures``; the package ``figures`` has them one by one
what goes wrong           ``RealBenchError``
========================= ======================================================================

The same as commands: ``realbench --help``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from real_bench.lazy import lazy_names
from real_bench.registration import register
from real_bench.version import __version__

if TYPE_CHECKING:
    from real_bench import figures
    from real_bench.actions import Action
    from real_bench.api import (
        compare,
        draw_figures,
        load_goals,
        load_result,
        make_env,
        run_experiment,
        run_extrinsic,
        run_intrinsic,
        score,
    )
    from real_bench.controller import BasePolicy, Controller
    from real_bench.errors import RealBenchError
    from real_bench.goal_sets import GoalSet
    from real_bench.recording import Experience, Recording
    from real_bench.settings import Settings

register()

__all__ = [
    "Action",
    "BasePolicy",
    "Controller",
    "Experience",
    "GoalSet",
    "RealBenchError",
    "Recording",
    "Settings",
    "__version__",
    "compare",
    "draw_figures",
    "figures",
    "load_goals",
    "load_result",
    "make_env",
    "run_experiment",
    "run_extrinsic",
    "run_intrinsic",
    "score",
]

if not TYPE_CHECKING:  # or checkers would take any name for one of these
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "actions": ("Action",),
            "api": (
                "compare",
                "draw_figures",
                "load_goals",
                "load_result",
                "make_env",
                "run_experiment",
                "run_extrinsic",
                "run_intrinsic",
                "score",
            ),
            "controller": ("BasePolicy", "Controller"),
            "errors": ("RealBenchError",),
            "figures": ("figures",),
            "goal_sets": ("GoalSet",),
            "recording": ("Experience", "Recording"),
            "settings": ("Settings",),
        },
    )
