import numba

from planner.kernel import cache_directory, kernel


def triangle(side: float) -> float:
    return 0.5 * side * side


def test_a_kernel_gives_what_its_source_gives() -> None:
    assert kernel(triangle)(3.0) == triangle(3.0)


def test_machine_code_is_kept_under_the_digest_of_the_source() -> None:
    compiled = kernel(triangle)
    compiled(3.0)
    assert list(cache_directory().rglob("*triangle*.nbi"))


def test_the_users_numba_settings_stay_as_they_were() -> None:
    before = numba.config.CACHE_DIR
    kernel(triangle)
    assert before == numba.config.CACHE_DIR
