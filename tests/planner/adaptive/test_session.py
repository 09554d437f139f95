from collections.abc import Sequence

import numpy as np

from planner.adaptive.policy import PolicyError, Returned
from planner.adaptive.session import Step, run_session
from planner.adaptive.strip import Strip
from planner.cell.cell import placement
from planner.cell.obstacles import Obstacle, sphere
from planner.cell.scan_path import ScanPath

NOTHING = Returned(np.zeros((0, 4, 4)), np.zeros(0, dtype=np.int64), np.zeros((0, 3)))


def strip(name: str) -> Strip:
    return Strip(name, ScanPath(np.stack([placement(x, 0.0, 100.0, 0.0, 180.0, 0.0) for x in (0.0, 10.0)]), 0.5))


class Scripted:
    """A policy that returns batches in turn."""

    def __init__(self, *batches: str, wrong: str = "") -> None:
        self.batches, self.wrong = list(batches), wrong
        self.taken: list[str] = []
        self.refused: list[str] = []

    def next_strips(self) -> Sequence[Strip]:
        return [strip(name) for name in self.batches.pop(0)] if self.batches else []

    def take(self, strip: Strip | None, returned: Returned) -> None:
        assert strip is not None
        assert returned is NOTHING
        self.taken.append(strip.name)
        if strip.name == self.wrong:
            raise PolicyError("what the probe saw cannot be")

    def refuse(self, strip: Strip, reason: str) -> None:
        self.refused.append(f"{strip.name}: {reason}")

    def solid(self) -> Obstacle:
        return sphere("workpiece", 10.0, np.eye(4), turning=True)

    def state(self) -> str:
        return f"{len(self.taken)} taken"


class Backwards:
    """Scans each batch from its last strip to its first, and cannot scan some."""

    def __init__(self, out_of_reach: str = "", interrupted: str = "") -> None:
        self.out_of_reach, self.interrupted = out_of_reach, interrupted

    def ordered(self, strips: Sequence[Strip], solid: Obstacle) -> Sequence[Strip]:
        assert solid.name == "workpiece"
        return strips[::-1]

    def scan(self, strip: Strip, solid: Obstacle) -> Returned | str:
        assert solid.name == "workpiece"
        if strip.name == self.interrupted:
            raise KeyboardInterrupt
        return "out of reach" if strip.name in self.out_of_reach else NOTHING


def names(steps: Sequence[Step]) -> str:
    return "".join(step.strip.name for step in steps)


def test_a_session_scans_batch_after_batch_until_the_policy_wants_no_more() -> None:
    policy, said = Scripted("ab", "c"), list[tuple[int, str]]()
    session = run_session(policy, Backwards(), 10, lambda number, state: said.append((number, state)))
    assert (names(session.steps), policy.taken, session.failure) == ("bac", ["b", "a", "c"], None)
    assert said == [(0, "0 taken"), (1, "1 taken"), (2, "2 taken"), (3, "3 taken")]


def test_a_strip_that_cannot_be_scanned_goes_back_to_the_policy_and_does_not_count() -> None:
    policy = Scripted("ab", "c")
    session = run_session(policy, Backwards(out_of_reach="b"), 2)
    assert [(step.strip.name, step.refusal) for step in session.steps] == [
        ("b", "out of reach"),
        ("a", None),
        ("c", None),
    ]
    assert policy.refused == ["b: out of reach"]


def test_no_more_strips_are_scanned_than_allowed() -> None:
    policy = Scripted("abc", "d")
    assert names(run_session(policy, Backwards(), 2).steps) == "ba"
    assert names(run_session(Scripted("abc"), Backwards(), 0).steps) == ""


def test_ctrl_c_keeps_what_was_scanned() -> None:
    session = run_session(Scripted("abc"), Backwards(interrupted="b"), 10)
    assert (names(session.steps), session.failure) == ("c", "interrupted")


def test_a_policy_that_cannot_go_on_ends_the_session_and_keeps_the_strip() -> None:
    session = run_session(Scripted("abc", wrong="b"), Backwards(), 10)
    assert (names(session.steps), session.failure) == ("cb", "what the probe saw cannot be")


def test_a_strip_reversed_visits_the_same_poses_from_the_other_end() -> None:
    there = strip("a")
    np.testing.assert_array_equal(there.reversed().T_WS, there.T_WS[::-1])
    assert (there.reversed().name, there.reversed().path.step_s) == ("a", 0.5)
