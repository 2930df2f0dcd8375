"""Objects' rows from images (conditions with I)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from real_bench.actions import Action
from real_bench.real_g.arrays import Array
from real_bench.real_g.image_objects import ImageObjects
from real_bench.real_x.home import is_home
from real_bench.recording import Experience


class ImagePerception:
    """Rows x, y, z of each object that it has learned to see; none before.

    Args:
        low, high: the range of x, y that can be commanded, (2,) metres each.
        image_map: as given to :class:`HandEye`; None: it is learned.
    """

    def __init__(self, low: Array, high: Array, image_map: Array | None = None) -> None:
        self._objects = ImageObjects(low, high, image_map)

    def see(self, observation: Mapping[str, Any]) -> None:
        """The next moment of the play; looks only if the arm is out of view."""
        if is_home(observation["joint_positions"]):
            self._objects.see(observation["retina"], observation["depth"])
        else:
            self._objects.see(None)

    def act(self, path: Array | None) -> None:
        """The hand will now pass these points."""
        if path is not None:
            self._objects.act(path)

    def changed(self) -> bool:
        """Whether more than flicker has changed."""
        return self._objects.changed()

    def recall(self, experience: Experience, path_of: Callable[[Action], Array | None]) -> None:
        """Start over with a whole play; raises RecordingError."""
        home = iter(is_home(experience.joint_positions).tolist())
        paths = dict(zip(experience.preconditions.tolist(), range(len(experience)), strict=True))
        moments = iter(range(experience.n_states))

        def look(image: NDArray[np.uint8]) -> Array:
            self._objects.remember(image if next(home) else None)
            number = paths.get(next(moments))
            self.act(None if number is None else path_of(experience.action(number)))
            return np.zeros(0)

        self._objects.forget()
        experience.map_images(look)
        self._objects.learn()

    def rows(self, first: int = 0) -> Array:
        """Rows of each object at each moment since the first, (k, n_objects, 3)."""
        return self._objects.rows(first)

    def state(self, observation: Mapping[str, Any]) -> Array:
        """Rows of each object in an observation, (n_objects, 3); NaN if it is not seen."""
        return self._objects.look(observation["retina"])

    def goal(self, observation: Mapping[str, Any]) -> Array:
        """Where each object should be, (n_objects, 3); NaN if the goal does not show it."""
        return self._objects.look(observation["goal"])

    def seed(self, seed: int) -> None:
        """Begin with an empty memory."""
        self._objects.seed(seed)

    def get_state(self) -> dict[str, Any]:
        """What it has learned."""
        return self._objects.get_state()

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Restore it."""
        self._objects.set_state(state)
