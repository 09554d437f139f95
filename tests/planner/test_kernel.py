import subprocess
import sys

import pytest

from planner.kernel import kernel


def half_square(side: float) -> float:
    return 0.5 * side * side


@kernel
def scaled(side: float, factor: float = 3.0) -> float:
    return factor * side


@kernel
def called_with_constants(side: float) -> tuple[float, float, float]:
    return scaled(side), scaled(side, 2), scaled(side, factor=1.5)


def test_a_kernel_gives_what_its_source_gives() -> None:
    assert kernel(half_square)(3.0) == half_square(3.0)


def test_a_kernel_calls_another_with_its_defaults_and_by_name() -> None:
    assert called_with_constants(2.0) == (6.0, 4.0, 3.0)


def test_a_kernel_keeps_the_name_and_the_docstring_of_its_source() -> None:
    assert (scaled.__name__, scaled.__module__) == ("scaled", __name__)


def test_a_kernel_has_no_other_attributes() -> None:
    with pytest.raises(AttributeError):
        scaled.compiled  # type: ignore[attr-defined]  # noqa: B018  # that is the test


def test_kernels_are_declared_without_numba() -> None:
    program = "import sys, planner.map.map_builder, planner.planning.planners; sys.exit('numba' in sys.modules)"
    subprocess.run([sys.executable, "-c", program], check=True)
