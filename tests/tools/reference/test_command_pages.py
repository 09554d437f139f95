import argparse

import pytest

from seventh_axis.__main__ import COMMANDS
from tools.reference.command_pages import command_pages, options, page, programs, subcommands

PROGRAMS = programs()


def test_each_command_has_its_page() -> None:
    pages = "".join(command_pages().values())
    assert not [name for name in COMMANDS if f"`seventh-axis {name}`" not in pages]
    assert len(command_pages()) == len(PROGRAMS)


@pytest.mark.parametrize("module", PROGRAMS)
def test_a_page_has_each_option_of_each_command(module: str) -> None:
    parser = PROGRAMS[module]
    text = page(module, parser)
    for part in (parser, *subcommands(parser).values()):
        assert part.description
        assert part.description in text
        for action in options(part):
            assert action.help, action
            assert all(f"{option}" in text for option in action.option_strings)
    assert all(f"\n## {name}\n" in text for name in subcommands(parser))


def test_a_row_gives_value_choices_default_and_need_of_an_option() -> None:
    parser = argparse.ArgumentParser(prog="scan", description="Scan.")
    parser.add_argument(
        "--unit", choices=("mm", "inch"), default="mm", help="unit (default: %(default)s)", required=True
    )
    parser.add_argument("--hidden", help=argparse.SUPPRESS)
    text = page("emulator", parser)
    assert "| `--unit {mm,inch}` | unit (default: mm); required |" in text
    assert "hidden" not in text.replace("[--hidden", "")
