from pathlib import Path
from random import Random

import pytest
import serial

import emulator  # noqa: F401  # teaches pyserial the port emulator://
from emulator.config.table_config import TableConfig, load_config
from emulator.protocol_emulator import Serial
from protocol.client import TableClient
from tests.tools.identification.late_port import LatePort
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
    """The file of a table that is not the start of any fit."""
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
    """The known constants: those of the default table, some of which are far from the true ones."""
    return load_config()


class UnhurriedPort(LatePort):
    """A port of a busy computer: written bytes are sometimes late, and so are received bytes."""

    def __init__(self, port: Serial, seed: int) -> None:
        super().__init__(port)
        self._chance = Random(seed)  # noqa: S311  # not for security

    def write(self, data: bytes, /) -> int | None:
        self.dawdle()
        return super().write(data)

    def dawdle(self) -> None:
        if self._chance.random() < 0.04:
            self.port.advance(1 + int(self._chance.expovariate(0.3)))


@pytest.fixture(scope="session")
def unhurried_recording(unseen: Path) -> WireRecording:
    """A minute of that table recorded by a busy computer."""
    port = serial.serial_for_url(f"emulator://?config={unseen}&seed=11", baudrate=9600)
    assert isinstance(port, Serial)
    with TableClient(UnhurriedPort(port, seed=4)) as client:
        return record(client, excitation(60.0, 40.0, 100.0, seed=0), speed_deg_s=40.0, baud=9600)
