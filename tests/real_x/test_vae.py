from __future__ import annotations

import copy

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import spearmanr

from real_bench.errors import RealBenchError
from real_bench.real_x.vae import VAE, Training

SIDE = 12


def ignore_epochs(epoch: int, n_epochs: int, loss: float) -> None:
    """Progress that nobody looks at."""


def blobs(n: int = 300) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Soft spots, and where they are."""
    places = np.random.default_rng(0).uniform(2, SIDE - 2, (n, 2))
    rows, columns = np.mgrid[:SIDE, :SIDE]
    away = (rows - places[:, :1, None]) ** 2 + (columns - places[:, 1:, None]) ** 2
    return np.exp(-away / 8).astype(np.float32).reshape(n, -1), places


def trained(images: NDArray[np.float32], seed: int = 1, epochs: int = 30) -> VAE:
    vae = VAE(SIDE * SIDE, 2, 32, seed)
    vae.train(images, Training(epochs, batch=32, rate=3e-3, weight=2.0), ignore_epochs)
    return vae


def test_codes_are_near_where_spots_are_near() -> None:
    images, places = blobs()
    codes = trained(images).encode(images)
    pairs = np.random.default_rng(1).integers(len(images), size=(2000, 2))
    latent, real = (
        np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        for points in (codes, places)
    )
    assert spearmanr(latent, real).statistic > 0.8


@pytest.mark.parametrize(("weight", "fewest", "most"), [(1.0, 2, 4), (1000.0, 5, 5)])
def test_divergences_tell_which_variables_are_in_use(weight: float, fewest: int, most: int) -> None:
    """Two can say where a spot is; relative to a heavy reconstruction the prior is light."""
    images, _ = blobs()
    vae = VAE(SIDE * SIDE, 5, 32, 1)
    vae.train(images, Training(150, batch=32, rate=3e-3, weight=weight), ignore_epochs)
    found = vae.divergences(images)
    assert found.shape == (5,)
    assert fewest <= (found > 0.1).sum() <= most


def test_loss_falls_and_every_epoch_is_reported() -> None:
    images, _ = blobs()
    told: list[tuple[int, float]] = []
    VAE(SIDE * SIDE, 2, 32, 1).train(
        images,
        Training(epochs=8, batch=128, rate=1e-3, weight=1.0),
        lambda epoch, n_epochs, loss: told.append((epoch, loss)),
    )
    assert [epoch for epoch, _ in told] == list(range(8))
    assert told[-1][1] < told[0][1]


def test_same_seed_gives_the_same_codes_and_another_does_not() -> None:
    images, _ = blobs(100)
    codes = [trained(images, seed, epochs=2).encode(images) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(codes[0], codes[1])
    assert not np.array_equal(codes[0], codes[2])


def test_weights_are_enough_to_restore_a_vae() -> None:
    images, _ = blobs(100)
    vae, other = trained(images, epochs=2), VAE(SIDE * SIDE, 2, 32, seed=9)
    other.set_weights(copy.deepcopy(vae.weights()))
    np.testing.assert_array_equal(other.encode(images), vae.encode(images))
    assert all(isinstance(values, np.ndarray) for values in vae.weights().values())


def test_weights_and_images_of_other_sizes_are_refused() -> None:
    images, _ = blobs(10)
    vae = VAE(SIDE * SIDE, 2, 32, seed=1)
    with pytest.raises(RealBenchError, match="weights are of another VAE"):
        vae.set_weights(VAE(SIDE * SIDE, 3, 32, seed=1).weights())
    for wrong in (images[:, 1:], images[:0]):
        with pytest.raises(RealBenchError, match="cannot learn from images"):
            vae.train(wrong, Training(epochs=1, batch=128, rate=1e-3, weight=1.0), ignore_epochs)


def test_training_leaves_the_global_randomness_alone() -> None:
    import torch

    torch.manual_seed(5)
    expected = torch.rand(3)
    torch.manual_seed(5)
    trained(blobs(20)[0], epochs=1)
    assert torch.equal(torch.rand(3), expected)


def test_diverging_training_is_reported() -> None:
    with pytest.raises(RealBenchError, match="diverged in epoch 1: lower its rate"):
        VAE(SIDE * SIDE, 2, 32, 1).train(
            blobs(100)[0], Training(epochs=3, batch=8, rate=1e30, weight=1.0), ignore_epochs
        )


@pytest.mark.parametrize("seed", [0, 1])
def test_a_few_images_unlike_all_others_do_not_make_it_diverge(seed: int) -> None:
    """As those with the arm in view; the settings are REAL-LD's."""
    side, n, random = 30, 3000, np.random.default_rng(0)
    places = random.uniform(4, side - 4, (n, 2))
    rows, columns = np.mgrid[:side, :side]
    away = (rows - places[:, :1, None]) ** 2 + (columns - places[:, 1:, None]) ** 2
    images = (0.3 * np.exp(-away / 4)).astype(np.float32)
    images[random.choice(n, 3, replace=False), :, 5:13] = 1
    images = images.reshape(n, -1)
    vae = VAE(side**2, 7, 128, seed)
    vae.train(images, Training(6, 128, rate=3e-3, weight=1000 * 320 * 240 / side**2), ignore_epochs)
    assert np.isfinite(vae.encode(images)).all()
    assert (vae.divergences(images) > 0.1).any()


def test_the_number_of_threads_does_not_matter() -> None:
    import torch

    images, _ = blobs(100)
    before = torch.get_num_threads()
    codes = []
    for threads in (1, 3):
        torch.set_num_threads(threads)
        codes.append(trained(images, epochs=2).encode(images))
        assert torch.get_num_threads() == threads
    torch.set_num_threads(before)
    np.testing.assert_array_equal(codes[0], codes[1])
