"""Locations as another program sends them, a JSON line each."""

import json
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.tracking.pose_lines import PoseLines, SourceError
from tests.planner.tracking.track_examples import lines, locations


@given(st.lists(st.integers(1, 200), min_size=1))
def test_poses_come_whole_however_the_bytes_are_cut(cuts: list[int]) -> None:
    data, reader, k = ("\n".join(lines(locations())) + "\n").encode(), PoseLines("poses"), 0
    for cut in (cuts * len(data))[: len(data)]:
        reader.feed(data[k : k + cut])
        k += cut
    reader.close()
    assert reader.has_ended
    np.testing.assert_allclose(np.array(reader.poses), locations(), atol=1e-9)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[1, 2", "line 1 holds '[1, 2', which is not JSON; send a list of 6 or 16 numbers"),
        ("[1, 2, 3]", "line 1: has 3 numbers; allowed are 6"),
        ("[1, 2, 3, 4, 5, NaN]", "line 1: holds a value that is not a finite number"),
        ("[1, 2, 3, 4, 5, Infinity]", "line 1: holds a value that is not a finite number"),
        ("[1, 2, 3, 4, 5, \"x\"]", "line 1 holds"),
        ("null", "line 1 holds 'null'; send"),
        ("7", "line 1 holds '7'; send"),
        ("true", "line 1 holds 'true'; send"),
        ('["1", "2", "3", "4", "5", "6"]', "line 1 holds"),
        ("[true, false, 3, 4, 5, 6]", "line 1 holds"),
        ("[1, 2, 3, 4, 5, null]", "line 1 holds"),
        ("[[1, 2, 3, 4, 5, 6]]", "line 1 holds"),
        ("[[1, 2, 3], [4, 5, 6]]", "line 1 holds"),
        ("[[[1, 2, 3, 4, 5, 6]]]", "line 1 holds"),
        ("[[1, 0, 0, 0, 0, 1, 0, 0], [0, 0, 1, 0, 0, 0, 0, 1]]", "line 1 holds"),
        (f"[1, 2, 3, 4, 5, {10**400}]", "line 1 holds"),
        ("[]", "line 1: has 0 numbers; allowed are 6"),
        ('{"location": 0, "pose": "end"}', "line 1 holds"),
        ('{"location": 0, "pose": {"x": 1}}', "line 1 holds"),
        ('{"location": "0", "pose": [1, 2, 3, 4, 5, 6]}', "line 1 holds"),
        ('{"location": 0.0, "pose": [1, 2, 3, 4, 5, 6]}', "line 1 holds"),
        ('{"location": null, "pose": [1, 2, 3, 4, 5, 6]}', "line 1 holds"),
        ('{"location": -1, "pose": [1, 2, 3, 4, 5, 6]}', "line 1 holds"),
        ('"END"', "line 1 holds"),
        ('{"pose": [1, 2, 3, 4, 5, 6]}', "line 1 holds"),
        ('{"location": 3, "pose": [1, 2, 3, 4, 5, 6]}', "line 1 leaves locations out: its number is 3; the"),
        ('{"location": true, "pose": [1, 2, 3, 4, 5, 6]}', "line 1"),
        ("[2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]", "line 1:"),
        ("[1e30, 2, 3, 4, 5, 6]", "line 1 is 1e+30 mm from the workpiece; allowed are 10000"),
        ("[1e999, 2, 3, 4, 5, 6]", "line 1: holds a value that is not a finite number"),
        ("[1,2,3,4,5,6]\n[1,2,3,4,5,6]", "line 2 repeats the location before it"),
        ('"end"\n[1,2,3,4,5,6]', 'line 2 comes after "end"'),
        ("\ufffd\xff", "line 1 holds"),
        ("[" * 5000, "line 1"),
    ],
)  # fmt: skip
def test_what_is_no_location_is_named_by_its_line(text: str, message: str) -> None:
    with pytest.raises(SourceError, match=re.escape(f"poses: {message}")):
        PoseLines("poses").feed((text + "\n").encode("utf-8", errors="replace"))


def test_a_number_that_was_sent_already_repeats() -> None:
    reader = PoseLines("poses")
    one = json.dumps({"location": 0, "pose": [1, 2, 3, 4, 5, 6]}).encode() + b"\n"
    reader.feed(one)
    with pytest.raises(SourceError, match="line 2 repeats a location: its number is 0; the next is 1"):
        reader.feed(one)


def test_a_line_without_end_is_refused_before_it_fills_the_memory() -> None:
    reader = PoseLines("poses")
    with pytest.raises(SourceError, match="line 1 is longer than 4096 bytes"):
        reader.feed(b"[" + b" " * 5000)


def test_a_stream_that_ends_without_its_marker_is_a_program_that_died() -> None:
    reader = PoseLines("poses")
    reader.feed(b"[1,2,3,4,5,6]\n")
    with pytest.raises(SourceError, match=r'ended without the line "end", at 1 locations'):
        reader.close()


def test_a_matrix_is_its_sixteen_numbers_or_its_four_rows() -> None:
    reader, matrix = PoseLines("poses"), locations(2)
    reader.feed((json.dumps(matrix[0].ravel().tolist()) + "\r\n" + json.dumps(matrix[1].tolist()) + "\r\n").encode())
    np.testing.assert_allclose(np.array(reader.poses), matrix, atol=1e-9)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=7) | st.dictionaries(st.sampled_from(["location", "pose", "x"]), inner),
    max_leaves=20,
)


@given(json_values | st.dictionaries(st.just("location"), json_values).map(lambda one: one | {"pose": [1.0] * 6}))
def test_any_other_json_is_refused_in_one_line_or_is_a_pose_of_numbers(value: object) -> None:
    reader, message = PoseLines("poses"), ""
    try:
        reader.feed(json.dumps(value).encode() + b"\n")
    except SourceError as error:
        message = str(error)
    if message:
        assert message.startswith("poses: line 1")
        assert "\n" not in message
        assert len(message) < 400
        return
    pose = value["pose"] if isinstance(value, dict) else value
    assert value == "end" or (isinstance(pose, list) and {type(number) for number in pose} <= {int, float})
