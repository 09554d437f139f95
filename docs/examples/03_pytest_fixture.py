"""The fixture `rotary_table`: a fresh table for each test. To run this: pytest 03_pytest_fixture.py."""

from protocol import TableClient
from protocol.conformance.pytest.fixture import RotaryTable


def turn_in_steps(table: TableClient, step_deg: float, count: int) -> list[float]:
    """The code under test: turn the table step by step, and return where it stood."""
    stood = []
    for _ in range(count):
        target = table.position_deg() + step_deg
        table.move_to(target)
        stood.append(table.wait_until_at(target))
    return stood


def test_a_part_is_shown_from_four_sides(rotary_table: RotaryTable) -> None:
    assert turn_in_steps(rotary_table.client, 90.0, 4) == [90.0, 180.0, 270.0, 360.0]


def test_each_test_has_a_table_of_its_own(rotary_table: RotaryTable) -> None:
    assert rotary_table.client.position_deg() == 0.0
