import math
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from planner.arrays import FloatArray
from planner.cell.cell import Cell, placement
from planner.cell.scan_path import looking_at
from planner.execution.run_record import Record
from planner.geometry.ray_casting import RayCaster
from planner.geometry.transforms import rigid_inverse
from planner.kinematics.arm import Arm
from planner.scanning.alignment import Calibration, probe_poses
from planner.scanning.error_budget import Chain, ErrorBudget, Samples, Source, error_budget_of, signed_distances_mm
from planner.scanning.latched_run import LatchedRun
from planner.scanning.probe import LaserProbe, measure
from tests.planner.goals import goal_flange_poses

CELL = Cell()
TRUE = Calibration.of(CELL)
PROFILES = 600
BLOCK = trimesh.creation.box((120.0, 120.0, 60.0)).apply_translation((0.0, 0.0, 30.0))


def poses_round_the_block() -> FloatArray:
    """Return probe poses in frame W that look at the sides of the block."""
    rng = np.random.default_rng(1)
    side = rng.integers(0, 4, PROFILES) * (np.pi / 2)
    normals = np.column_stack((np.cos(side), np.sin(side), np.zeros(PROFILES)))
    along = np.column_stack((-np.sin(side), np.cos(side), np.zeros(PROFILES)))
    points = 60.0 * normals + rng.uniform(-45.0, 45.0, (PROFILES, 1)) * along + (0.0, 0.0, 30.0)
    return looking_at(points, normals, np.tile((0.0, 0.0, 1.0), (PROFILES, 1)), 150.0)


def made_up_chain(
    decimals: int, backlash_deg: float = 0.08, off_mm: float = 0.02, counts_per_deg: float = 512.0
) -> Chain:
    """Return a run whose errors are known, with poses instead of joints: row k of `joints` is its number."""
    rng = np.random.default_rng(2)
    true_deg: FloatArray = rng.uniform(0.0, 360.0, PROFILES)
    edge_deg = true_deg + 0.001
    shaft_deg = edge_deg - backlash_deg
    latched_deg: FloatArray = np.round(shaft_deg * counts_per_deg) / counts_per_deg
    T_BF = goal_flange_poses(CELL, poses_round_the_block(), true_deg)[np.arange(PROFILES), np.arange(PROFILES)]
    numbers = np.tile(np.arange(PROFILES, dtype=np.float64)[:, np.newaxis], (1, 6))
    times_s = np.linspace(0.0, 24.0, PROFILES)
    run = LatchedRun(
        np.arange(PROFILES), times_s, numbers, latched_deg.round(decimals), numbers,
        true_deg, edge_deg, shaft_deg, latched_deg, True, PROFILES, {}, Record(),
    )  # fmt: skip
    known = replace(TRUE, T_FS=TRUE.T_FS @ placement(off_mm, 0.0, 0.0, 0.0, 0.0, 0.0))
    return Chain(run, TRUE, known, lambda joints: T_BF[joints[:, 0].astype(int)])


def budget(chain: Chain, decimals: int, probe: LaserProbe | None = None) -> ErrorBudget:
    samples = Samples()
    probe = probe or LaserProbe(points_per_line=16)
    samples.take(0, measure(RayCaster(BLOCK), probe, chain.poses(()), chain.run.numbers))
    return error_budget_of(chain, samples.all(), BLOCK, 10.0**-decimals)


def test_switched_off_together_only_the_arithmetic_is_left() -> None:
    assert budget(made_up_chain(1), 1).none_mm < 1e-9


def test_switched_on_together_it_is_the_wire() -> None:
    chain = made_up_chain(1)
    everything = frozenset(Source)
    assert chain.angles_deg(everything) == pytest.approx(chain.run.angles_deg, abs=1e-12)
    run = chain.run
    expected = probe_poses(chain.known, chain.flange_poses(run.joints_deg), run.angles_deg)
    assert np.abs(chain.poses(everything) - expected).max() < 1e-12
    assert (chain.angles_deg(()) == run.true_deg).all()


def test_rounding_costs_what_the_closed_form_says() -> None:
    for decimals, tolerance in ((1, 0.05), (2, 0.05)):
        result = budget(made_up_chain(decimals), decimals)
        step = math.radians(10.0**-decimals) / math.sqrt(12.0)
        assert result.rounding_mm == pytest.approx(step * result.radius_mm)
        assert result.parts[Source.ROUNDING].displacement_mm == pytest.approx(result.rounding_mm, rel=tolerance)


def test_the_parts_are_those_that_were_put_in() -> None:
    result = budget(made_up_chain(1), 1)
    moved_mm = {part: share.displacement_mm for part, share in result.parts.items()}
    radius_mm = result.radius_mm
    assert moved_mm[Source.PROBE] == pytest.approx(0.025, rel=0.04)
    assert moved_mm[Source.BACKLASH] == pytest.approx(math.radians(0.08) * radius_mm, rel=1e-6)
    assert moved_mm[Source.TIMING] == pytest.approx(math.radians(0.001) * radius_mm, rel=0.01)
    assert moved_mm[Source.ENCODER] == pytest.approx(math.radians(1.0 / 512.0) / math.sqrt(12.0) * radius_mm, rel=0.1)
    assert moved_mm[Source.CALIBRATION] == pytest.approx(0.02, rel=1e-6)


def test_independent_parts_add_up_by_their_squares() -> None:
    result = budget(made_up_chain(1, backlash_deg=0.0), 1)
    assert result.sum_mm == pytest.approx(result.total.displacement_mm, rel=0.05)


def test_with_three_decimals_no_backlash_and_exact_calibration_the_cloud_is_within_30_micrometers() -> None:
    result = budget(made_up_chain(3, backlash_deg=0.0, off_mm=0.0), 3)
    assert 0.020 < result.distances.sigma < 0.030
    assert result.parts[Source.CALIBRATION].displacement_mm < 1e-9
    assert result.parts[Source.PROBE].without_mm < 0.005


def test_without_the_table_s_truth_its_parts_are_left_out() -> None:
    chain = made_up_chain(1)
    wire = chain.run.angles_deg
    run = replace(chain.run, true_deg=wire, edge_deg=wire, shaft_deg=wire, latched_deg=wire, tells_truth=False)
    assert set(budget(replace(chain, run=run), 1).parts) == {
        Source.PROBE,
        Source.TIMING,
        Source.CALIBRATION,
    }


def test_distances_are_signed_and_exact() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=50.0)
    rng = np.random.default_rng(0)
    directions = rng.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    off_mm = rng.uniform(-2.0, 2.0, 500)
    assert signed_distances_mm(sphere, (50.0 + off_mm)[:, np.newaxis] * directions) == pytest.approx(off_mm, abs=0.02)


def test_samples_are_an_even_choice_in_bounded_memory() -> None:
    caster, T_WS = RayCaster(BLOCK), poses_round_the_block()[:100]
    probe = LaserProbe(points_per_line=20)
    kept = Samples(most=300)
    for first in range(0, 100, 10):
        kept.take(first, measure(caster, probe, T_WS[first : first + 10]))
        assert kept.count <= 300
    assert kept.count >= 150
    rows = kept.all().profiles
    assert np.bincount(rows, minlength=100).max() <= 3
    assert rows.max() >= 98
    assert (np.diff(rows) >= 0).all()


@pytest.mark.parametrize("counts_per_deg", [16.0, 100.0, 512.0, 40_000.0])
def test_encoder_and_backlash_are_those_of_the_table_whatever_its_counts(counts_per_deg: float) -> None:
    result = budget(made_up_chain(3, backlash_deg=0.0, counts_per_deg=counts_per_deg), 3)
    step_mm = math.radians(1.0 / counts_per_deg) * result.radius_mm
    assert result.parts[Source.ENCODER].displacement_mm == pytest.approx(step_mm / math.sqrt(12.0), rel=0.1)
    assert result.parts[Source.BACKLASH].displacement_mm < 1e-9


def test_the_arm_s_own_kinematics_serve_the_chain() -> None:
    arm = Arm.load()
    joints_deg = np.array([[10.0, -70.0, 150.0, 20.0, 30.0, -40.0]])
    chain = replace(made_up_chain(1), flange_poses=lambda deg: arm.flange_poses(np.radians(deg)))
    T = chain.flange_poses(joints_deg)
    assert np.abs(rigid_inverse(T) @ T - np.eye(4)).max() < 1e-9
