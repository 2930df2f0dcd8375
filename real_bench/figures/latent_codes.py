"""What REAL-LD makes of a recording's images (paper, section REAL-LD)."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from real_bench.analysis import PairDistances, pair_distances
from real_bench.errors import RealBenchError
from real_bench.real_x.architecture import AbstractionSettings
from real_bench.real_x.triplets import Triplets
from real_bench.recording import Experience, Recording
from real_bench.settings import merged, validated

if TYPE_CHECKING:  # torch is only needed for images
    from real_bench.real_x.latents import Latents

N_PAIRS = 100_000

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class LatentCodes:
    """The codes of a recording's images.

    Attributes:
        codes: before and after each action that can be planned with.
        pairs: distances of states before such actions, in codes and in metres.
        settings: of eye and VAE.
        is_recorded: whether the weights are the recording's; otherwise they were learned now.
    """

    codes: Triplets
    pairs: PairDistances
    settings: Mapping[str, Any]
    is_recorded: bool


def sight_settings(values: Mapping[str, Any]) -> Any:
    """How images are seen and states abstracted: ``eye``, ``vae``, ``abstraction``, as in REAL-LD.

    Raises:
        RealBenchError: an unknown setting, or a bad value.
    """
    from real_bench.real_x.latents import SightSettings

    class Seen(SightSettings):
        abstraction: AbstractionSettings = AbstractionSettings()

    return validated(Seen, values, "figures")


def encode_recording(
    recording: Recording,
    experience: Experience,
    kept: NDArray[np.int64],
    positions: NDArray[np.float64],
    values: Mapping[str, Any],
    seed: int,
) -> LatentCodes | None:
    """Encode images with what the recorded controller learned, or else learn as REAL-LD does.

    Args:
        recording: of the experience.
        experience: all of it, or its beginning.
        kept: which actions can be planned with, (k,) row numbers.
        positions: of the objects in every state, (m, n_objects, 3) metres.
        values: settings of REAL-LD; they override those of the recording's weights.
        seed: of learning, and of drawing pairs.

    Returns:
        the codes; None, with a warning if it has images, where they cannot be learned.
    """
    if recording.n_images is None or len(kept) < 2:
        return None
    from real_bench.real_x.latents import Latents

    learned = _recorded_weights(recording)
    settings = sight_settings(merged(learned.get("settings", {}), values))
    latents = Latents(settings.eye, settings.vae)
    is_recorded = _accepts_weights(latents, learned, experience.n_states)
    latents.seed(seed)
    how = "uses the recorded weights" if is_recorded else "learning to see as REAL-LD does"
    log.info("%s: %s", recording.path.name, how)
    try:
        triplets = latents.triplets(experience)
    except RealBenchError as error:
        log.warning("%s is in no figure of codes: %s", recording.path.name, error)
        return None
    codes = Triplets(triplets.states[kept], triplets.outcomes[kept])
    there = positions[experience.preconditions[kept]]
    pairs = pair_distances(codes.states, there, N_PAIRS, np.random.default_rng(seed))
    facts = {"eye": settings.eye.model_dump(), "vae": settings.vae.model_dump()}
    return LatentCodes(codes, pairs, facts, is_recorded)


def _recorded_weights(recording: Recording) -> Mapping[str, Any]:
    """What the recorded controller learned to see; empty if it does not fit our eye."""
    learned = recording.controller_state().get("perception")
    if not isinstance(learned, dict) or not learned.get("vae"):
        return {}
    try:
        sight_settings(learned.get("settings", {}))
    except RealBenchError:  # of an older eye
        return {}
    return learned


def _accepts_weights(latents: Latents, learned: Mapping[str, Any], n_states: int) -> bool:
    """Whether it accepts what was learned, from as many images as there are."""
    if not learned:
        return False
    try:
        latents.set_state(learned)
    except (RealBenchError, KeyError, TypeError):  # of an older VAE
        return False
    state = latents.get_state()
    return bool(state["vae"]) and state["learned_from"] == n_states
