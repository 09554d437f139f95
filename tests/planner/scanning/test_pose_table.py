import csv
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from planner.arrays import FloatArray
from planner.cell.cell import Cell
from planner.scanning.alignment import Calibration, probe_poses
from planner.scanning.pose_table import POSE_COLUMNS, write_poses


def test_a_reader_gets_the_poses_back_and_can_compute_one_from_the_other(tmp_path: Path) -> None:
    cell, count = Cell(), 20
    random = np.random.default_rng(0)
    joints_deg, angles_deg = random.uniform(-60.0, 60.0, (count, 6)), random.uniform(-400.0, 400.0, count)
    T_BF = cell.arm.flange_poses(cell.arm.joints(joints_deg))
    T_WS = probe_poses(Calibration.of(cell), T_BF, angles_deg)
    write_poses(
        tmp_path / "poses.csv", np.arange(count) + 5, np.arange(count) / 25.0, angles_deg, joints_deg, T_BF, T_WS
    )

    with (tmp_path / "poses.csv").open(encoding="ascii") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == POSE_COLUMNS
    assert [int(row["profile"]) for row in rows] == list(range(5, 5 + count))
    table = {name: np.array([float(row[name]) for row in rows]) for name in POSE_COLUMNS}
    np.testing.assert_allclose(table["table_deg"], angles_deg, atol=1e-6)

    def poses(frame: str) -> FloatArray:
        T = np.tile(np.eye(4), (count, 1, 1))
        quaternions = np.column_stack([table[f"{frame}_q{part}"] for part in "xyzw"])
        T[:, :3, :3] = Rotation.from_quat(quaternions).as_matrix()
        T[:, :3, 3] = np.column_stack([table[f"{frame}_{axis}_mm"] for axis in "xyz"])
        return T

    assert np.abs(probe_poses(Calibration.of(cell), poses("BF"), table["table_deg"]) - poses("WS")).max() < 1e-4
