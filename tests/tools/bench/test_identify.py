from pathlib import Path

import pytest

from emulator.config.table_config import load_config
from tools.bench.identify_tables import BACKLASH_ARCMIN, SPREAD, random_plant, write_constants


@pytest.mark.parametrize("seed", range(5))
def test_a_random_plant_is_a_configuration_and_the_same_again(seed: int, tmp_path: Path) -> None:
    config = load_config(write_constants(tmp_path / "table.toml", random_plant(seed)))

    assert BACKLASH_ARCMIN[0] <= config.gears.backlash_arcmin <= BACKLASH_ARCMIN[1]
    assert config.table.inertia_kg_m2 == random_plant(seed)["table.inertia_kg_m2"]
    assert config.driver == load_config().driver
    assert len(random_plant(seed)) == len(SPREAD) + 1
