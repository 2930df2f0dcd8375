"""Intrinsic motivation: do what is expected to change something (paper, section REAL-ILD)."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from real_bench.actions import Action
from real_bench.controls import MacroControl
from real_bench.real_x.change import STEPS, ChangePredictor, changed
from real_bench.real_x.foreground import ForegroundSettings
from real_bench.real_x.home import is_home
from real_bench.real_x.latents import LATENTS_PER_OBJECT, Latents, VAESettings
from real_bench.real_x.triplets import Triplets
from real_bench.recording import Experience
from real_bench.settings import Settings

CANDIDATES_AT_ONCE = 20

MOMENTS = np.arange(50, 851, 50)
"""The steps of an action at which the predictor gets the commands."""

log = logging.getLogger(__name__)


class CuriositySettings(Settings):
    """How the change predictor guides exploration; the first two defaults are the paper's.

    Attributes:
        every: actions between two trainings; the first ones are random.
        candidates: the most actions to consider before one is taken.
        latent: latent variables of its VAE.
        eye, vae: how it sees, learned from scratch at every training. Coarsely: it asks whether
            anything changed, and planning has eyes of its own.
        steps: of the change predictor's training.
    """

    every: int = Field(500, ge=2)
    candidates: int = Field(1000, ge=1)
    latent: int = Field(LATENTS_PER_OBJECT, ge=1, le=1000)
    eye: ForegroundSettings = ForegroundSettings(width=80, height=60, shrink=2, blur=2.5)
    vae: VAESettings = VAESettings(steps=400)
    steps: int = Field(default=STEPS, ge=1)


class Curiosity:
    """Chooses among proposed actions the first one that is predicted to change what is seen.

    What it learns depends only on the seed and the play so far. So its memory is not part of a
    controller's state: when a run is resumed, it comes from the recording.

    Args:
        settings: how often it learns, how much it thinks of, how it sees.
    """

    def __init__(self, settings: CuriositySettings) -> None:
        self._settings = settings
        self._eyes = Latents(settings.eye, settings.vae)
        self.seed(0)

    def seed(self, seed: int) -> None:
        """Begin with an empty memory; the seed is of all that is learned."""
        self._seed = seed
        self._eyes.seed(seed)
        self._predictor = ChangePredictor(seed, self._settings.steps)
        self._images: list[NDArray[np.uint8]] = []
        self._home: list[bool] = []
        self._actions: list[NDArray[np.float64]] = []
        self._preconditions: list[int] = []
        self._outcomes: list[int] = []
        self._learned_from = 0

    def get_state(self) -> dict[str, Any]:
        """All of it that is not in the recording."""
        return {"seed": self._seed}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Learn by the same seed as before."""
        self.seed(state["seed"])

    def recall(self, experience: Experience) -> None:
        """Remember what was recorded before the run was cut; raises RecordingError."""
        self._images = list(experience.map_images(self._eyes.shrink))
        self._home = is_home(experience.joint_positions).tolist()
        self._actions = [_sample_commands(experience.action(i)) for i in range(len(experience))]
        self._preconditions = experience.preconditions.tolist()
        self._outcomes = experience.outcomes.tolist()
        n = len(self._outcomes)
        if n >= self._settings.every:
            self._learn(n - n % self._settings.every)

    def choose(self, observation: Mapping[str, Any], propose: Callable[[], Action]) -> Action:
        """The next action of free play.

        Args:
            observation: what is the case now: ``retina``, ``joint_positions``.
            propose: gives a random action.
        """
        self._see(observation)
        n = len(self._outcomes)
        if n - self._learned_from >= self._settings.every:
            self._learn(n)
        action = self._first_promising(propose) if self._learned_from else propose()
        self._actions.append(_sample_commands(action))
        self._preconditions.append(len(self._images) - 1)
        return action

    def _see(self, observation: Mapping[str, Any]) -> None:
        if len(self._preconditions) > len(self._outcomes):  # it acted: this is the outcome
            self._outcomes.append(len(self._images))
        self._images.append(self._eyes.shrink(observation["retina"]))
        self._home.append(bool(is_home(observation["joint_positions"])))

    def _learn(self, n: int) -> None:
        """Learn again from the first n actions."""
        log.info("learning what %d actions changed", n)
        before, after = self._preconditions[:n], self._outcomes[:n]
        images = np.array(self._images[: after[-1] + 1])
        codes = self._eyes.learn(images, self._settings.latent)
        triplets = Triplets(codes[before], codes[after])
        change, home = changed(triplets), np.array(self._home)
        visible = home[before] & home[after]
        if visible.any():
            actions = np.array(self._actions[:n])[visible]
            self._predictor.train(triplets.states[visible], actions, change[visible])
        self._learned_from = n
        log.info("%d of them changed what is seen", np.count_nonzero(change & visible))

    def _first_promising(self, propose: Callable[[], Action]) -> Action:
        state = self._eyes.code(self._images[-1])
        for first in range(0, self._settings.candidates, CANDIDATES_AT_ONCE):
            n = min(CANDIDATES_AT_ONCE, self._settings.candidates - first)
            actions = [propose() for _ in range(n)]
            commands = np.array([_sample_commands(action) for action in actions])
            promising = self._predictor.predict(np.tile(state, (n, 1)), commands)
            if promising.any():
                return actions[int(promising.argmax())]
        return propose()


def _sample_commands(action: Action) -> NDArray[np.float64]:
    """What is commanded at each moment, (k, size); a macro is one command throughout."""
    is_macro = action.commands.shape[1] == MacroControl.size
    return action.commanded(MOMENTS[:1] if is_macro else MOMENTS)
