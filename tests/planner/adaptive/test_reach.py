import numpy as np

from planner.adaptive.reach import reach, usable
from planner.arrays import BoolArray


def poses(*columns: str) -> BoolArray:
    """One strip in one configuration: a column for each pose, a letter for each table angle, x where it is allowed."""
    return np.array([[letter == "x" for letter in column] for column in columns])


def of(*strips: BoolArray) -> BoolArray:
    """One configuration of eight, the third."""
    every = np.zeros((8, len(strips), *strips[0].shape), dtype=np.bool_)
    every[2] = strips
    return every


def test_a_strip_is_swept_at_one_table_angle() -> None:
    found = reach(of(poses("..x.", "..x.", "..x.")), 1)
    assert (found.first[0], found.last[0], found.configurations[0], found.counts[0]) == (0, 2, 2, 3)


def test_the_table_turns_along_a_strip_over_allowed_angles() -> None:
    drifting = poses("xxx...", ".xxx..", "..xxx.", "...xxx")
    assert reach(of(drifting), 1).last[0] == 3
    assert reach(of(drifting), 0).counts[0] == 3


def test_the_table_does_not_jump_over_what_is_forbidden() -> None:
    assert reach(of(poses("x.x.", "x.x.", "..x.")), 2).counts[0] == 3  # from the start at the other angle
    assert reach(of(poses("x...", "x.x.", "..x.")), 2).counts[0] == 2


def test_angles_wrap() -> None:
    around = of(poses("xx....", "xx...x", "x....x", "....xx"))
    assert reach(around, 1).counts[0] == 4
    assert reach(around, 0).counts[0] == 3


def test_the_longest_part_is_kept_in_the_configuration_that_has_it() -> None:
    every = of(poses("x", "x", ".", "x", "x"))
    every[5, 0, 1:, 0] = True
    found = reach(every, 1)
    assert (found.first[0], found.last[0], found.configurations[0]) == (1, 4, 5)


def test_what_cannot_be_swept_is_not_usable() -> None:
    found = reach(of(poses("....", "....", "...."), poses("x...", "x...", "x...")), 1)
    assert usable(found, 3).tolist() == [1]
    assert usable(found, 4).tolist() == []
