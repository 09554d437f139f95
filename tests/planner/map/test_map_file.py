import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from planner.kinematics.configuration import Configuration
from planner.map.config_map import ConfigurationMap
from planner.map.map_file import MapFileError, load_maps, save_maps

FLIP, NOFLIP = Configuration.LEFTY_ABOVE_FLIP, Configuration.LEFTY_ABOVE_NOFLIP


def some_maps() -> dict[Configuration, ConfigurationMap]:
    rng = np.random.default_rng(0)
    maps = {}
    for configuration in (FLIP, NOFLIP):
        values = np.maximum(rng.uniform(-0.5, 1.0, (7, 12)), 0.0)
        metadata = {"scan": "test", "configuration": configuration.label, "reasons": {1: "out of reach"}}
        maps[configuration] = ConfigurationMap(values, (values == 0.0).astype(np.uint8), metadata=metadata)
    return maps


def test_maps_come_back_as_they_were_saved(tmp_path: Path) -> None:
    maps = some_maps()
    save_maps(tmp_path / "map.npz", maps)
    loaded = load_maps(tmp_path / "map.npz")
    assert list(loaded) == [FLIP, NOFLIP]
    for configuration, each in loaded.items():
        assert np.array_equal(each.values, maps[configuration].values)
        assert each.reasons is not None
        assert (each.reasons == maps[configuration].reasons).all()
        assert each.metadata == maps[configuration].metadata
        assert each.epsilon == maps[configuration].epsilon


def test_the_same_maps_are_the_same_bytes_and_nothing_else_is_left(tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        save_maps(tmp_path / name, some_maps())
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.npz", "b.npz"]


def test_a_failed_save_leaves_what_was_there(tmp_path: Path) -> None:
    file = tmp_path / "map.npz"
    save_maps(file, some_maps())
    before = file.read_bytes()
    unsavable = {FLIP: ConfigurationMap(np.ones((2, 3)), np.zeros((2, 3), dtype=np.uint8), metadata={"scan": object()})}
    with pytest.raises(TypeError):
        save_maps(file, unsavable)
    assert file.read_bytes() == before
    assert len(list(tmp_path.iterdir())) == 1


def test_no_map_and_a_map_without_reasons_are_not_saved(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no map"):
        save_maps(tmp_path / "map.npz", {})
    with pytest.raises(ValueError, match="without reasons"):
        save_maps(tmp_path / "map.npz", {FLIP: ConfigurationMap(np.ones((2, 3)))})


def cut_short(content: bytes) -> bytes:
    return content[: len(content) // 2]


def flip_a_byte(content: bytes) -> bytes:
    return content[:200] + bytes([content[200] ^ 0xFF]) + content[201:]


def something_else(_content: bytes) -> bytes:
    return b"no map at all"


def nothing(_content: bytes) -> bytes:
    return b""


@pytest.mark.parametrize("damage", [cut_short, flip_a_byte, something_else, nothing])
def test_a_damaged_file_is_refused_by_its_name(damage: Callable[[bytes], bytes], tmp_path: Path) -> None:
    file = tmp_path / "map.npz"
    save_maps(file, some_maps())
    file.write_bytes(damage(file.read_bytes()))
    with pytest.raises(MapFileError, match=r"map\.npz: "):
        load_maps(file)


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(MapFileError, match="cannot be read"):
        load_maps(tmp_path / "map.npz")


Change = Callable[[dict[str, NDArray[np.float64]], dict[str, object]], None]


def foreign(_arrays: dict[str, NDArray[np.float64]], metadata: dict[str, object]) -> None:
    metadata["format"] = "something else"


def newer(_arrays: dict[str, NDArray[np.float64]], metadata: dict[str, object]) -> None:
    metadata["format_version"] = 2


def too_great(arrays: dict[str, NDArray[np.float64]], _metadata: dict[str, object]) -> None:
    arrays["values"][1, 3, 4] = 1.5


def other_shape(arrays: dict[str, NDArray[np.float64]], _metadata: dict[str, object]) -> None:
    arrays["reasons"] = arrays["reasons"][:, :3]


def one_too_few(arrays: dict[str, NDArray[np.float64]], _metadata: dict[str, object]) -> None:
    arrays["values"] = arrays["values"][:1]


def unnamed(_arrays: dict[str, NDArray[np.float64]], metadata: dict[str, object]) -> None:
    del metadata["configurations"]


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (foreign, "no configuration maps of this program"),
        (newer, "format version is 2"),
        (too_great, r"damaged: .*1\.5"),
        (other_shape, "damaged: .*shape"),
        (one_too_few, "no configuration maps"),
        (unnamed, "no configuration maps"),
    ],
)
def test_a_file_that_is_not_ours_is_refused_with_what_is_wrong(change: Change, told: str, tmp_path: Path) -> None:
    file = tmp_path / "map.npz"
    save_maps(file, some_maps())
    with np.load(file) as stored:
        arrays = dict(stored)
    metadata = json.loads(str(arrays.pop("metadata")))
    change(arrays, metadata)
    np.savez(file, metadata=np.array(json.dumps(metadata)), **arrays)
    with pytest.raises(MapFileError, match=told):
        load_maps(file)
