"""The reason for a forbidden cell of a configuration map, as one code: the arm's, a user's factor, or a collision."""

from collections.abc import Sequence

from planner.reasons import Reason

FIRST_USER_FACTOR = 16
FIRST_PAIR = 32
_CODES = 256


def reason_texts(pair_names: Sequence[str], user_factor_names: Sequence[str]) -> dict[int, str]:
    """Return the meaning of each code of a map.

    Raises:
        ValueError: there are more pairs or more user factors than codes.
    """
    if len(pair_names) > _CODES - FIRST_PAIR:
        raise ValueError(f"{len(pair_names)} pairs can collide; a map can distinguish {_CODES - FIRST_PAIR}")
    if len(user_factor_names) > FIRST_PAIR - FIRST_USER_FACTOR:
        raise ValueError(
            f"{len(user_factor_names)} user factors; a map can distinguish {FIRST_PAIR - FIRST_USER_FACTOR}"
        )
    texts = {int(reason): _plain(reason) for reason in Reason if reason < Reason.JOINT_1_SPEED}
    texts |= {FIRST_USER_FACTOR + i: f"excluded by {name}" for i, name in enumerate(user_factor_names)}
    texts |= {FIRST_PAIR + i: f"collision of {name}" for i, name in enumerate(pair_names)}
    return texts


def _plain(reason: Reason) -> str:
    return reason.name.replace("_", " ").lower()
