"""All models of trimesh's own tests: they load, or are refused for the right reason.

The folder is in trimesh's repository (github.com/mikedh/trimesh) and in no package; name it by TRIMESH_MODELS.
"""

import os
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh

from planner.errors import WorkpieceError
from planner.geometry import mesh as mesh_module
from planner.geometry.mesh import load_mesh

FOLDER = Path(os.environ.get("TRIMESH_MODELS", "no such folder"))
REASONS = (
    "the file is empty|the mesh is empty|the mesh is open at|the mesh crosses itself near|this PLY file (lacks|ends)"
    "|line \\d+: a face has 2 corners|a face with \\d+ corners|the triangles are oriented"
)


@pytest.mark.skipif(not FOLDER.is_dir(), reason="TRIMESH_MODELS does not name trimesh's folder of models")
def test_every_model_loads_closed_or_is_refused_with_a_reason_and_a_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mesh_module, "SMALLEST_MM", 0.0)
    monkeypatch.setattr(mesh_module, "LARGEST_MM", np.inf)
    files = [file for file in sorted(FOLDER.rglob("*")) if file.suffix.lower() in (".stl", ".obj", ".ply")]
    loaded = 0
    for file in files:
        reason = ""
        try:
            mesh = load_mesh(file)
        except WorkpieceError as refusal:
            reason = str(refusal).removeprefix(f"{file}: ")
        if reason:
            assert re.match(REASONS, reason), file
            continue
        loaded += 1
        assert mesh.volume > 0.0
        assert isinstance(mesh, trimesh.Trimesh)
    assert loaded > 50
    assert len(files) > 80
