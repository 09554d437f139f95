"""Why a cell of a configuration map is forbidden, as one code: the arm's reasons, a user's factor, or a collision."""

from collections.abc import Sequence

from planner.reasons import Reason

FIRST_USER_FACTOR = 16
FIRST_PAIR = 32
_CODES = 256


def reason_texts(pair_names: Sequence[str], user_factor_names: Sequence[str]) -> dict[int, str]:
    """Return what each code that a map can hold means.

    Raises:
        ValueError: There are more pairs or more user factors than there are codes.
    """
    if len(pair_names) > _CODES - FIRST_PAIR:
        raise ValueError(f"{len(pair_names)} pairs can collide; a map tells {_CODES - FIRST_PAIR} apart")
    if len(user_factor_names) > FIRST_PAIR - FIRST_USER_FACTOR:
        raise ValueError(f"{len(user_factor_names)} user factors; a map tells {FIRST_PAIR - FIRST_USER_FACTOR} apart")
    texts = {int(reason): _plain(reason) for reason in Reason if reason < Reason.JOINT_1_SPEED}
    texts |= {FIRST_USER_FACTOR + i: f"excluded by {name}" for i, name in enumerate(user_factor_names)}
    texts |= {FIRST_PAIR + i: f"collision of {name}" for i, name in enumerate(pair_names)}
    return texts


def _plain(reason: Reason) -> str:
    return reason.name.replace("_", " ").lower()
