"""Each fault that is planted in the firmware's source is found by what is named for it."""

import pytest

from tests.emulator.avr.toolchain_mark import needs_toolchain
from tools.firmware_mutants import Mutant, failing_case, finding_on, main, mutants


def test_there_are_twelve_mutants_or_more_with_names_of_their_own() -> None:
    assert len({mutant.name for mutant in mutants()}) == len(mutants()) >= 12


@needs_toolchain
@pytest.mark.parametrize("mutant", mutants(), ids=lambda mutant: mutant.name)
def test_a_mutant_is_found(mutant: Mutant) -> None:
    finding = finding_on(mutant)
    assert finding
    assert not mutant.found_by[0].isdigit() or finding.startswith(mutant.found_by)


@needs_toolchain
def test_the_sound_firmware_passes_the_cases_that_find_mutants() -> None:
    assert failing_case("compiled://", [mutant.found_by for mutant in mutants() if mutant.found_by[0].isdigit()]) == ""


@needs_toolchain
def test_a_mutant_whose_text_is_not_in_the_source_is_misuse() -> None:
    with pytest.raises(ValueError, match="0 times 'no such text'"):
        finding_on(Mutant("none", "main.c", "no such text", "", "lockstep"))


@needs_toolchain
def test_the_command_prints_what_found_a_mutant(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["halves away"]) == 0
    assert capsys.readouterr().out.startswith("found   a wrong rounding: halves away from zero (5.2/4): 5.2/4:")
