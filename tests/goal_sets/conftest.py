import pytest

from real_bench.errors import SceneError
from real_bench.simulation import load_scene


@pytest.fixture(scope="session")
def official_scene():
    try:
        return load_scene("official")
    except SceneError as error:
        pytest.skip(str(error))
