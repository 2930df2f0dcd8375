from __future__ import annotations

import h5py
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from real_bench.conditions import Condition, ConditionError
from real_bench.recording import Header
from real_bench.recording.header import FIELDS_TO_RESUME

TEXT = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=30)
SHA256 = st.text("0123456789abcdef", min_size=64, max_size=64)
HEADERS = st.builds(
    Header,
    condition=st.sampled_from(["OM", "IM", "OJ", "IJ", "OC", "IC"]),
    objects=st.integers(1, 3),
    object_names=st.lists(TEXT, min_size=1, max_size=3).map(tuple),
    scene=TEXT,
    scene_source=TEXT,
    scene_sha256=SHA256,
    seed=st.integers(0, 2**63 - 1),
    controller=TEXT,
    controller_source=TEXT,
    controller_class=TEXT,
    controller_sha256=st.just("") | SHA256,
    images=st.booleans(),
    versions=st.dictionaries(TEXT, TEXT, max_size=5),
)


def through_attributes(header: Header) -> Header:
    with h5py.File("memory", "w", driver="core", backing_store=False) as file:
        for key, value in header.to_attributes().items():
            file.attrs[key] = value
        return Header.from_attributes(dict(file.attrs))


@settings(deadline=None)
@given(HEADERS)
def test_a_header_survives_its_file(header: Header) -> None:
    assert through_attributes(header) == header


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("condition", "XY"),
        ("objects", 0),
        ("seed", -1),
        ("seed", 2**63),
        ("scene_sha256", "0"),
        ("controller_sha256", "0"),
        ("colour", "red"),
    ],
)
def test_header_refuses_invalid_fields(header: Header, field: str, value: object) -> None:
    with pytest.raises((ValidationError, ConditionError), match=field):
        Header.model_validate({**header.model_dump(), field: value})


@given(HEADERS, HEADERS)
def test_differences_name_only_fields_that_matter_for_resuming(one: Header, other: Header) -> None:
    named = {difference.partition(":")[0] for difference in one.differences(other)}
    assert named - {"controller"} == {
        field for field in FIELDS_TO_RESUME if getattr(one, field) != getattr(other, field)
    }
    maker = (other.controller_source, other.controller_sha256, other.controller_class)
    assert ("controller" in named) != one.was_made_by(*maker)
    assert one.differences(one) == []


@pytest.mark.parametrize(
    ("controller", "source", "class_name", "own"),
    [
        ("real_r", "", "RealR", True),
        ("./real_r.py", "7" * 64, "RealR", True),
        ("real_r", "7" * 64, "Other", False),
        ("./real_r.py", "7" * 64, "Other", False),
        ("other", "8" * 64, "RealR", False),
        ("other", "", "RealR", False),
    ],
)
def test_header_recognises_its_controller(
    header: Header, controller: str, source: str, class_name: str, own: bool
) -> None:
    made = header.model_copy(update={"controller_sha256": "7" * 64})
    assert made.was_made_by(controller, source, class_name) == own


@pytest.mark.parametrize(
    ("recorded", "tested", "fits"),
    [
        ("OM", "OM", True),
        ("OM", "IM", True),
        ("IM", "OM", False),
        ("IM", "IM", True),
        ("IM", "IJ", False),
        ("OC", "OM", False),
    ],
)
def test_condition_of_a_test_must_fit_that_of_the_recording(
    header: Header, recorded: str, tested: str, fits: bool
) -> None:
    run = header.model_copy(update={"condition": recorded})
    assert (run.mismatches(Condition.parse(tested), 2, run.scene_sha256) == []) == fits


def test_other_objects_or_scene_do_not_fit(header: Header) -> None:
    condition = Condition.parse("OM")
    assert "not 3" in header.mismatches(condition, 3, header.scene_sha256)[0]
    assert "another scene" in header.mismatches(condition, 2, "0" * 64)[0]


def test_earlier_version_of_the_control_does_not_fit(header: Header) -> None:
    run = header.model_copy(update={"control_version": 1})
    told = "its macro-actions have version 1, this realbench has 2"
    assert told in run.mismatches(Condition.parse("OM"), 2, header.scene_sha256)[0]
    assert run.differences(header) == ["control_version: 1, not 2"]
