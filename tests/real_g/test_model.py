from __future__ import annotations

import numpy as np
import pytest
import torch

from real_bench.errors import RealBenchError
from real_bench.real_g.model import ContingencyModel, OutcomeModel
from real_bench.real_g.networks import Ensemble
from tests.real_g.deeds import Array


def data(n: int = 600) -> tuple[Array, Array, Array]:
    """Features; outcomes that stay where the first feature is negative, else follow; stays."""
    random = np.random.default_rng(0)
    features = random.uniform(-1, 1, (n, 4))
    stays = np.column_stack([features[:, 1], features[:, 2], np.zeros(n)]) * 0.3
    follows = features[:, :1] > 0
    outcomes = np.where(follows, 0.0, stays) + random.normal(size=(n, 3)) * 0.002
    return features, outcomes, stays


def test_outcome_model_predicts_what_follows_and_what_stays() -> None:
    features, outcomes, stays = data()
    model = OutcomeModel(0, scale=0.3)
    model.train(features, outcomes, stays, 600)
    mixture = model.predict(features, stays)
    np.testing.assert_allclose(mixture.weights.sum(axis=2), 1, atol=1e-6)
    assert (mixture.deviations > 0).all()
    mean = (mixture.weights[..., None] * mixture.means).sum(axis=2).mean(axis=0)
    clear = np.abs(features[:, 0]) > 0.2
    assert np.median(np.linalg.norm(mean - outcomes, axis=1)[clear]) < 0.02


def test_single_member_matches_its_part_of_the_ensemble() -> None:
    features, outcomes, stays = data(100)
    model = OutcomeModel(0, scale=0.3)
    model.train(features, outcomes, stays, 50)
    whole, one = model.predict(features, stays), model.predict(features, stays, member=2)
    np.testing.assert_allclose(one.means[0], whole.means[2], atol=1e-6)


def test_contingency_is_learned() -> None:
    features, _, _ = data()
    followed = (features[:, 0] > 0).astype(float)
    model = ContingencyModel(0)
    model.train(features, followed, 300)
    assert np.mean((model.predict(features) > 0.5) == (followed > 0)) > 0.95


def test_same_seed_learns_the_same_and_state_restores_it() -> None:
    features, outcomes, stays = data(100)
    models = [OutcomeModel(seed, scale=0.3) for seed in (1, 1, 2)]
    for model in models:
        model.train(features, outcomes, stays, 40)
    means = [model.predict(features, stays).means for model in models]
    np.testing.assert_array_equal(means[0], means[1])
    assert (means[0] != means[2]).any()
    heir = OutcomeModel(5, scale=0.3)
    heir.set_state(models[0].get_state())
    np.testing.assert_array_equal(heir.predict(features, stays).means, means[0])


def test_networks_do_not_memorise_noise() -> None:
    """They stop where they are best on what they have not seen."""
    random = np.random.default_rng(0)
    features, noise = random.normal(size=(80, 20)), random.normal(size=(80, 1))
    target = torch.from_numpy(noise.astype(np.float32))
    networks = Ensemble(0, outputs=1)
    networks.train(features, lambda out, rows: ((out - target[rows]) ** 2)[..., 0], 1000)
    away = (networks.predict(features).numpy() - noise) ** 2
    assert away.mean() > 0.3 * noise.var()


def test_unusable_training_data_is_refused() -> None:
    features, outcomes, stays = data(10)
    with pytest.raises(RealBenchError, match="0 rows"):
        OutcomeModel(0, 1.0).train(features[:0], outcomes[:0], stays[:0], 10)
    with pytest.raises(RealBenchError, match="cannot learn"):
        OutcomeModel(0, 1.0).train(features, outcomes[:5], stays, 10)
    features[3] = np.nan
    with pytest.raises(RealBenchError, match="or from NaN"):
        OutcomeModel(0, 1.0).train(features, outcomes, stays, 10)
