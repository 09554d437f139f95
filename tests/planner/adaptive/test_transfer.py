from dataclasses import replace

import numpy as np
import pytest

from planner.adaptive.continuous_check import ContinuousCheck, Move, joint_radii_mm, turning_radius_mm
from planner.adaptive.surroundings import Surroundings
from planner.adaptive.transfer import SPEED_SHARE, Stance, Transfer, Transfers
from planner.arrays import FloatArray
from planner.cell.cell import placement
from planner.cell.obstacles import Obstacle, box
from planner.cell.pose_clearance import clearances
from planner.cell.scan import load_scan
from planner.kinematics.configuration import Configuration
from planner.kinematics.inverse_kinematics import inverse_kinematics
from planner.reasons import Reason

SCAN = load_scan("cylinder")
CELL = SCAN.cell
PART = box("workpiece", (120.0, 120.0, 160.0), placement(0.0, 0.0, 80.0, 0.0, 0.0, 0.0), turning=True)
FIN = box("workpiece", (180.0, 2.0, 250.0), placement(0.0, 0.0, 125.0, 0.0, 0.0, 0.0), turning=True)


def check_of(solid: Obstacle, minimum_mm: float = 2.5) -> ContinuousCheck:
    return ContinuousCheck(CELL, Surroundings.of(SCAN).collision(solid)[0], solid, minimum_mm)


def looking(T_WS: FloatArray, table_deg: float) -> Stance:
    """A stance in which the probe is at a pose over the workpiece."""
    goal = CELL.table_factors(np.array([table_deg])) @ CELL.location_factors(T_WS[np.newaxis])
    joints, reasons = inverse_kinematics(CELL.arm, goal)
    slot = int(np.flatnonzero(reasons[0] == Reason.REACHED)[0])
    return Stance(joints[0, slot], table_deg, Configuration(slot))


FROM_ABOVE = looking(placement(0.0, 0.0, 310.0, 0.0, 180.0, 180.0), 0.0)
FROM_THE_ARM = looking(placement(-210.0, 0.0, 110.0, 0.0, 90.0, 90.0), 30.0)


def sampled_clearance_mm(check: ContinuousCheck, move: Move, count: int = 400) -> float:
    at = np.linspace(0.0, 1.0, count)
    rng = np.random.default_rng(0)
    angles = rng.uniform(*move.table_deg, count)
    return float(check.clearance_mm(move.start + at[:, np.newaxis] * (move.end - move.start), angles).min())


def test_a_motion_is_free_where_no_sample_of_it_collides() -> None:
    check, rng = check_of(PART), np.random.default_rng(1)
    lower, upper = CELL.arm.limits
    free, blocked = 0, 0
    for _ in range(60):
        start = FROM_ABOVE.joints + rng.uniform(-0.5, 0.5, 6)
        end = FROM_THE_ARM.joints + rng.uniform(-0.5, 0.5, 6)
        move = Move(np.clip(start, lower, upper), np.clip(end, lower, upper), (0.0, 40.0))
        least_mm = sampled_clearance_mm(check, move)
        if check.is_free(move):
            free += 1
            assert least_mm > 2.5
        elif least_mm > 2.5:
            blocked += 1  # what the samples missed, or a place that is nearly too near
            assert least_mm < 2.5 + 12.0
    assert free > 5
    assert blocked < free


def test_a_fin_that_samples_step_over_is_not_passed_through() -> None:
    """The probe sweeps through a fin of 2 mm from one side to the other."""
    T = placement(0.0, -150.0, 240.0, 0.0, 180.0, 180.0), placement(0.0, 150.0, 240.0, 0.0, 180.0, 180.0)
    start, end = (looking(each, 0.0) for each in T)
    move = Move(start.joints, end.joints, (0.0, 0.0))
    check = check_of(FIN)
    ends = check.clearance_mm(np.array([start.joints, end.joints]), np.zeros(2))
    assert (ends > 2.5).all()
    assert not check.is_free(move)


def test_at_rest_the_table_turns_past_what_is_out_of_its_reach_alone() -> None:
    check = check_of(FIN)
    beside = looking(placement(0.0, -150.0, 240.0, 0.0, 180.0, 180.0), 0.0)
    assert check.is_free(Move(beside.joints, beside.joints, (0.0, 0.0)))
    assert not check.is_free(Move(beside.joints, beside.joints, (0.0, 90.0)))


def test_nothing_moves_farther_than_the_radii_say() -> None:
    rng, arm = np.random.default_rng(2), CELL.arm
    lower, upper = arm.limits
    for _ in range(200):
        joints = rng.uniform(lower, upper)
        turned = joints + rng.uniform(-0.02, 0.02, 6)
        frames = arm.link_frames(np.array([joints, turned]))
        points = np.concatenate(([[0, 0, 0, 1.0]], np.column_stack((rng.uniform(-80, 80, (20, 3)), np.ones(20)))))
        moved = np.einsum("fij,pj->fpi", frames[1] - frames[0], points)[..., :3]
        assert np.linalg.norm(moved, axis=2).max() <= np.abs(turned - joints) @ joint_radii_mm(CELL) + 1e-9
    assert turning_radius_mm(PART) == pytest.approx(60.0 * np.sqrt(2.0))


@pytest.fixture(scope="module")
def ways() -> Transfers:
    return Transfers(CELL, SCAN.limits, check_of(PART), PART)


@pytest.mark.parametrize(
    ("start", "end"),
    [(FROM_ABOVE, FROM_THE_ARM), (FROM_THE_ARM, FROM_ABOVE), (None, FROM_THE_ARM), (FROM_ABOVE, None)],
)
def test_a_way_leads_from_one_stance_to_the_other_and_is_free(
    ways: Transfers, start: Stance | None, end: Stance | None
) -> None:
    way = ways.between(start, end)
    assert isinstance(way, Transfer)
    if start is not None:
        np.testing.assert_array_equal(way.joints[0], start.joints)
    if end is not None:
        np.testing.assert_array_equal(way.joints[-1], end.joints)
    lower, upper = CELL.arm.limits
    assert ((way.joints >= lower) & (way.joints <= upper)).all()
    speeds = np.degrees(np.abs(np.diff(way.joints, axis=0))) / np.maximum(way.moves_s, 1e-12)[:, np.newaxis]
    assert (speeds <= SPEED_SHARE * np.array(CELL.arm.max_speed_deg_s) + 1e-6).all()
    assert clearance_along_mm(way, start, end) > 2.0
    assert way.duration_s >= way.table_s


def clearance_along_mm(way: Transfer, start: Stance | None, end: Stance | None) -> float:
    """The minimum clearance along a way, with the table where it may be, by dense samples."""
    check = check_of(PART)
    angles = [each.table_deg for each in (start, end) if each is not None]
    least = np.inf
    for k, (a, b) in enumerate(zip(way.joints, way.joints[1:], strict=False)):
        before, after = k < way.retraction, k >= len(way.joints) - 1 - way.approach
        table = (angles[0],) * 2 if before else (angles[-1],) * 2 if after else (min(angles), max(angles))
        if not way.is_direct and not before and not after:
            table = (angles[0],) * 2 if k == way.retraction and start is not None else (angles[-1],) * 2
        least = min(least, sampled_clearance_mm(check, Move(a, b, table), 60))
    return least


def test_the_probe_retracts_along_its_beam(ways: Transfers) -> None:
    way = ways.between(FROM_THE_ARM, FROM_ABOVE)
    assert isinstance(way, Transfer)
    assert way.retraction > 0
    T_BS = CELL.arm.flange_poses(way.joints[: way.retraction + 1]) @ CELL.T_FS
    moved = T_BS[-1, :3, 3] - T_BS[0, :3, 3]
    np.testing.assert_allclose(moved / np.linalg.norm(moved), -T_BS[0, :3, 2], atol=1e-6)


def test_where_all_is_blocked_there_is_no_way() -> None:
    wall = box("workpiece", (300.0, 300.0, 900.0), placement(0.0, 0.0, 450.0, 0.0, 0.0, 0.0), turning=True)
    blocked = Transfers(CELL, SCAN.limits, check_of(wall), wall)
    found = blocked.between(FROM_ABOVE, FROM_THE_ARM)
    assert found == "the arm has no way to it that is free of collisions"


def test_the_beam_may_meet_something_between_strips() -> None:
    model, names = Surroundings.of(SCAN).collision(PART)
    into = looking(placement(0.0, 0.0, 230.0, 0.0, 180.0, 180.0), 0.0)  # the probe is 70 mm over the part
    with_beam = clearances(model, CELL.arm, into.joints[np.newaxis], np.zeros(1), CELL.probe.stand_off_mm)
    assert names[int(with_beam.pair[0])] == "beam and workpiece"
    assert check_of(PART).clearance_mm(into.joints[np.newaxis], np.zeros(1))[0] > 10.0


def test_a_table_that_turns_meanwhile_costs_no_more_than_the_slower_of_both(ways: Transfers) -> None:
    near = looking(placement(0.0, 0.0, 310.0, 0.0, 180.0, 180.0), 5.0)
    way = ways.between(FROM_ABOVE, near)
    assert isinstance(way, Transfer)
    assert way.is_direct
    slower = replace(way, table_s=100.0)
    assert slower.duration_s == pytest.approx(100.0 + way.moves_s.sum() - way.moves_s[way.retraction])
