"""Official goal files: the real ones, and what somebody with bad intentions might send."""

import io
import os
import pickle
import struct
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from real_bench.errors import GoalSetError
from real_bench.goal_sets import import_official, official
from real_bench.goal_sets.inert_pickle import MAX_INSTRUCTIONS
from real_bench.simulation import Simulation
from tests.goal_sets.goal_examples import make_goal_set, official_goal_class, write_official

SHARED_GOALS = Path(__file__).parents[3] / "shared" / "goals"


def npz(path, pickled, shape=(1,), descr="|O"):
    """A file like numpy's, around any bytes in place of the pickle."""
    stream = io.BytesIO()
    header = {"descr": descr, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, header)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("arr_0.npy", stream.getvalue() + pickled)
    return path


def pickled_by(path):
    """The pickle in a file."""
    with zipfile.ZipFile(path) as archive:
        stream = io.BytesIO(archive.read("arr_0.npy"))
    np.lib.format.read_magic(stream)
    np.lib.format.read_array_header_1_0(stream)
    return stream.read()


def refusal(path, scene):
    with pytest.raises(GoalSetError) as caught:
        import_official(path, scene)
    message = str(caught.value)
    assert "\n" not in message
    assert len(message) < 500
    return message


@pytest.mark.parametrize("n_objects", [2, 3])
def test_official_goals_are_imported_with_their_images(official_scene, n_objects):
    path = SHARED_GOALS / f"official-{n_objects}-objects.npz"
    if not path.is_file():
        pytest.skip(f"{path} is not here")
    goal_set = import_official(path, official_scene)
    assert goal_set.counts == {"2D": 25, "2.5D": 15, "3D": 10}
    assert goal_set.object_names == official_scene.object_names(n_objects)
    assert (goal_set.generator, goal_set.seed) == ("real-robots-0.1.21", -1)
    goal_set.check_fits(official_scene, n_objects)
    _assert_pictures_are_ours(goal_set, official_scene)


def _assert_pictures_are_ours(goal_set, scene):
    """Equal to what we render, but for single pixels that another build of pybullet rounds."""
    different = []
    with Simulation(scene, goal_set.n_objects) as simulation:
        for goal in goal_set.goals:
            simulation.reset(goal.initial_poses)
            different.append((simulation.image().retina != goal.retina_before).any(-1).sum())
            simulation.set_object_poses(goal.final_poses)
            image = simulation.image()
            different.append((image.retina != goal.retina).any(-1).sum())
            np.testing.assert_array_equal(image.mask, goal.mask)
    assert max(different) <= 1
    assert np.count_nonzero(different) <= 3


@pytest.mark.parametrize("n_objects", [1, 2, 3])
def test_files_written_by_current_numpy_are_imported(tmp_path, official_scene, n_objects):
    made = replace(
        make_goal_set(n_objects=n_objects),
        scene_sha256=official_scene.sha256,
        generator="real-robots-0.1.21",
        seed=-1,
    )
    path = write_official(tmp_path / "goals.npz", made)
    assert import_official(path, official_scene).sha256 == made.sha256


@pytest.mark.parametrize(
    ("spelled", "meant"), [("2", "2D"), ("2d", "2D"), ("2.5", "2.5D"), ("3", "3D"), ("3D", "3D")]
)
def test_every_spelling_of_a_challenge_is_understood(tmp_path, official_scene, spelled, meant):
    path = write_official(tmp_path / "goals.npz", make_goal_set(), challenge=spelled)
    assert import_official(path, official_scene).counts[meant] == 3


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"challenge": "4D"}, "unknown challenge '4D'"),
        ({"challenge": None}, "unknown challenge 'NoneType'"),
        ({"initial_state": {}}, "do not all place"),
        ({"initial_state": None}, "do not all place"),
        ({"initial_state": {"cube": np.zeros(7), "teapot": np.zeros(7)}}, "do not all place"),
        ({"final_state": {"cube": np.zeros(7), "tomato": np.zeros(6)}}, r"poses have \[7, 6\]"),
        ({"final_state": {"cube": np.zeros(7), "tomato": [0] * 7}}, "other than an array"),
        ({"final_state": {"cube": np.zeros(7), "tomato": np.zeros(7)}}, "length 1"),
        ({"final_state": {"cube": np.zeros(7), "tomato": np.zeros((1, 7))}}, "not 1-dimensional"),
        ({"mask": np.full((6, 8), 300)}, "body ids 300 to 300"),
        ({"mask": np.array([[None]])}, "not hold plain numbers"),
        ({"retina": np.array(["text"])}, "not hold plain numbers"),
        ({"retina": "text"}, "other than an array"),
    ],
)
def test_malformed_goals_are_refused(tmp_path, official_scene, changes, message):
    path = write_official(tmp_path / "goals.npz", make_goal_set(), **changes)
    with pytest.raises(GoalSetError, match=message):
        import_official(path, official_scene)


def test_a_goal_without_its_fields_is_refused(tmp_path, official_scene):
    with official_goal_class() as goal_class:
        rows = np.empty(1, object)
        rows[0] = goal_class()
        rows[0].challenge = "2D"
        np.savez(tmp_path / "goals.npz", rows)
    assert "has no initial_state" in refusal(tmp_path / "goals.npz", official_scene)


class Calls:
    """Pickled, it asks for a call of anything."""

    def __init__(self, function, *arguments):
        self.call = (function, arguments)

    def __reduce__(self):
        return self.call


def _named(module, name, then=b""):
    return (
        b"\x80\x04\x8c"
        + bytes([len(module)])
        + module
        + b"\x8c"
        + bytes([len(name)])
        + name
        + (b"\x93" + then)
    )


GOAL = (b"real_robots.envs.env", b"Goal")
HOSTILE = {
    "the goal's own attributes": _named(GOAL[0], b"Goal.__init__.__globals__", b"."),
    "a global by its old name": b"cposix\nsystem\n.",
    "another class of numpy": _named(b"numpy", b"load", b"."),
    "a name that is no text": b"\x80\x04K\x01K\x02\x93.",
    "attributes set on the class": _named(*GOAL, b"}\x8c\x01aK\x01sb."),
    "slots set on a function": _named(
        b"numpy.core.multiarray", b"_reconstruct", b"N}\x8c\x0c__defaults__)s\x86b."
    ),
    "an instance by the old opcode": b"(ios\nsystem\n.",
    "keyword arguments": _named(*GOAL, b")}\x92."),
    "a persistent id": b"\x80\x04Vx\nQ.",
    "an extension": b"\x80\x04\x82\x01.",
    "a call of data": b"\x80\x04K\x01)R.",
    "a call without a tuple": _named(*GOAL, b"K\x01R."),
    "a goal that is its own array": _named(*GOAL, b")\x81\x94h\x00b."),
    "a giant memo index": b"\x80\x04Nr\xff\xff\xff\x7f.",
    "giant bytes": b"\x80\x04\x8e" + struct.pack("<Q", 2**62) + b".",
    "more bytes than there are": b"\x80\x04B\xff\xff\xff\x7f.",
    "deep nesting": b"\x80\x04" + b"]" * 100_000 + b"a" * 99_999 + b".",
    "deep tuples": b"\x80\x04)" + b"\x85" * 200_000 + b".",
    "a key whose hash takes for ever": (
        b"\x80\x04})" + b"".join(b"q%ch%c\x86" % (index, index) for index in range(60)) + b"Ns."
    ),
    "endless instructions": b"\x80\x04" + b"N" * (MAX_INSTRUCTIONS + 1) + b".",
    "pops from nothing": b"\x80\x04a.",
    "an unknown memo": b"\x80\x04h\x07.",
    "marks that are not closed": b"\x80\x04(((t.",
    "an odd dictionary": b"\x80\x04}(\x8c\x01au.",
    "no end": b"\x80\x04N",
    "nothing": b"",
    "a huge number in letters": b"I" + b"9" * 100_000 + b"\n.",
    "an unknown instruction": b"\x80\x04\xff.",
    "no array": b"\x80\x04N.",
    "an array with no state": _named(b"numpy._core.multiarray", b"_reconstruct", b")R."),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_pickles_are_refused(tmp_path, official_scene, name):
    refusal(npz(tmp_path / "goals.npz", HOSTILE[name]), official_scene)


@pytest.mark.parametrize("protocol", range(6))
@pytest.mark.parametrize("function", [os.system, eval, exec, __import__, open, getattr])
def test_no_function_is_ever_called(tmp_path, official_scene, function, protocol):
    marker = tmp_path / "marker"
    arguments = {
        os.system: (f"touch {marker}",),
        eval: (f"open({str(marker)!r}, 'w')",),
        exec: (f"open({str(marker)!r}, 'w')",),
        __import__: ("antigravity",),
        open: (str(marker), "w"),
        getattr: ("text", "upper"),
    }
    hostile = Calls(function, *arguments[function])
    path = npz(tmp_path / "goals.npz", pickle.dumps([hostile], protocol))
    assert "refused" in refusal(path, official_scene)
    assert not marker.exists()


def test_refused_name_is_reported(tmp_path, official_scene):
    hostile = pickle.dumps(Calls(os.system, "true"), 2)
    assert f"'{os.name} system'" in refusal(npz(tmp_path / "g.npz", hostile), official_scene)


def test_a_call_hidden_in_a_goal_is_refused(tmp_path, official_scene):
    marker = tmp_path / "marker"
    hidden = Calls(os.system, f"touch {marker}")
    path = write_official(tmp_path / "goals.npz", make_goal_set(), subtype=hidden)
    assert "refused" in refusal(path, official_scene)
    assert not marker.exists()


def test_an_array_that_declares_more_than_it_holds_is_refused(tmp_path, official_scene):
    path = write_official(tmp_path / "goals.npz", make_goal_set(n_goals=1, shape=(6, 8)))
    small = b"K\x06K\x08K\x03\x87"
    large = b"J\xff\xff\xff\x7fK\x08K\x03\x87"
    pickled = pickled_by(path)
    assert small in pickled
    lying = npz(path, pickled.replace(small, large))
    assert "more or fewer bytes" in refusal(lying, official_scene)


@pytest.mark.parametrize(
    ("shape", "descr"), [((10**12,), "|O"), ((1,), "<f8"), ((), "|O"), ((1, 1), "|O")]
)
def test_false_headers_are_refused(tmp_path, official_scene, shape, descr):
    refusal(npz(tmp_path / "goals.npz", b"\x80\x04N.", shape, descr), official_scene)


def test_a_zip_bomb_is_refused_before_it_is_unpacked(tmp_path, official_scene, monkeypatch):
    monkeypatch.setattr(official, "MAX_BYTES", 2**20)
    path = npz(tmp_path / "goals.npz", bytes(2**21))
    assert path.stat().st_size < 2**13
    assert "it unpacks to 2097280 bytes" in refusal(path, official_scene)
    path.write_bytes(bytes(2**21))
    assert "it has 2097152 bytes" in refusal(path, official_scene)


def test_archives_of_another_kind_are_refused(tmp_path, official_scene):
    path = tmp_path / "goals.npz"
    np.savez(path, a=np.zeros(1), b=np.zeros(1))
    assert "it has 2 members" in refusal(path, official_scene)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("readme.txt", "")
    assert "not one .npy" in refusal(path, official_scene)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("arr_0.npy", "")
    assert "a method that numpy does not use" in refusal(path, official_scene)
    path.write_bytes(b"PK not a zip")
    assert "zip archive cannot be read" in refusal(path, official_scene)
    assert "No such file" in refusal(tmp_path / "missing.npz", official_scene)


@pytest.mark.filterwarnings("ignore:invalid escape sequence")
@given(data=st.data())
@settings(
    max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_altered_pickles_fail_cleanly(tmp_path, official_scene, data):
    path = write_official(tmp_path / "goals.npz", make_goal_set(n_goals=1, shape=(2, 3)))
    pickled = bytearray(pickled_by(path))
    for _ in range(data.draw(st.integers(1, 3))):
        position = data.draw(st.integers(0, len(pickled) - 1))
        pickled[position] = data.draw(st.integers(0, 255))
    try:
        goal_set = import_official(npz(path, bytes(pickled)), official_scene)
    except GoalSetError:
        return
    assert len(goal_set) == 1  # a byte within a number was changed
