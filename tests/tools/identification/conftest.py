from pathlib import Path

import pytest

import emulator  # noqa: F401  # teaches pyserial the port emulator://
from emulator.config import TableConfig, load_config
from protocol.client import TableClient
from tools.identification.excitation import excitation
from tools.identification.recorder import record
from tools.identification.recording import WireRecording

UNSEEN = """
[motor]
torque_constant_Nm_A = 0.0206
[table]
inertia_kg_m2 = 0.42
[friction]
coulomb_Nm = 2.3e-3
[gears]
backlash_arcmin = 21.0
"""


@pytest.fixture(scope="session")
def unseen(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a table that no fit begins from."""
    path = tmp_path_factory.mktemp("unseen") / "table.toml"
    path.write_text(UNSEEN, encoding="utf-8")
    return path


@pytest.fixture(scope="session")
def recording(unseen: Path) -> WireRecording:
    """A minute of that table over the wire, with one decimal."""
    with TableClient.open(f"emulator://?config={unseen}&seed=11") as client:
        return record(client, excitation(60.0, 40.0, 100.0, seed=0), speed_deg_s=40.0, baud=9600)


@pytest.fixture(scope="session")
def assumed() -> TableConfig:
    """What is known of it beforehand: the default table, and that is wrong by much."""
    return load_config()
