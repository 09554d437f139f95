from planner.reasons import Reason


def test_a_published_number_never_changes_its_meaning() -> None:
    assert {reason.name: int(reason) for reason in Reason} == {
        "REACHED": 0,
        "OUT_OF_REACH": 1,
        "SINGULAR": 2,
        **{f"JOINT_{joint}_LIMIT": 2 + joint for joint in range(1, 7)},
        **{f"JOINT_{joint}_SPEED": 8 + joint for joint in range(1, 7)},
        "WRIST_TURN": 15,
    }
