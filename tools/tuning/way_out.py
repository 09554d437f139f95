"""Relax bounds that no gains satisfy, in as few places as possible, until both gain sets exist."""

from collections.abc import Sequence
from functools import partial
from itertools import combinations
from typing import NamedTuple

from tools.bounds import Bound, Limits, violation
from tools.tuning.gain_design import LEAST_LAG, LEAST_LOAD_PEAK, Design, Objective, Scan, design

_MOST_EASED = 2
_TRIES = 5
_ZOOMS = 3
"""Sufficient to find how far a bound must be relaxed: its new value is rounded to two digits."""
_LOOSER = 0.05


class SetDesigns(NamedTuple):
    """Both gain sets, each the best within its bounds, or the nearest to them."""

    ramp: Design
    hold: Design

    @property
    def broken(self) -> tuple[Bound, ...]:
        """The bounds that one of the sets or both violate."""
        return tuple({bound.figure: bound for each in self for bound in each.broken}.values())

    @property
    def stable(self) -> bool:
        """Whether both loops are stable."""
        return all(bool(each.figures.stable[0]) for each in self)


def both_designs(scanned: Scan, limits: Limits) -> SetDesigns:
    """Return the best gain sets within the limits, or those with the smallest violation."""
    return SetDesigns(*(design(scanned, bounds, objective) for bounds, objective in _tasks(limits)))


def eased_limits(scanned: Scan, limits: Limits, refused: SetDesigns) -> Limits | None:
    """Return limits with which both sets exist; None if no loop is stable.

    The bound that needs the smallest change is relaxed; if one bound is not sufficient, two. If two are not sufficient,
    all bounds that the nearest gains violate are relaxed to the values of these gains.
    """
    if not refused.stable:
        return None
    candidates = sorted({bound.figure for each in refused for bound in each.binding})
    for count in range(1, _MOST_EASED + 1):
        groups = combinations(candidates, count)
        found = [(eased, group) for group in groups if (eased := _eased_in(scanned, limits, group)) is not None]
        for eased, group in sorted(found, key=lambda each: _cost(limits, each[0])):
            if (found_limits := proved(scanned, limits, eased, set(group))) is not None:
                return found_limits
    broken = {bound.figure for bound in refused.broken}
    return proved(scanned, limits, _allowing(limits, refused, broken), set(candidates))


def changes(limits: Limits, eased: Limits) -> tuple[tuple[Bound, Bound], ...]:
    """Return the bounds that differ, before and after the change."""
    pairs = zip(limits.for_hold(), eased.for_hold(), strict=True)
    return tuple((before, after) for before, after in pairs if before != after)


def _tasks(limits: Limits) -> tuple[tuple[tuple[Bound, ...], Objective], ...]:
    return (limits.for_ramp(), LEAST_LAG), (limits.for_hold(), LEAST_LOAD_PEAK)


def _eased_in(scanned: Scan, limits: Limits, group: tuple[str, ...]) -> Limits | None:
    """Return the limits with the bounds of a group as near as possible to the requested ones.

    The result is None if other bounds are violated.
    """
    designs = []
    for bounds, objective in _tasks(limits):
        eased = tuple(bound for bound in bounds if bound.figure in group)
        kept = tuple(bound for bound in bounds if bound.figure not in group)
        best = design(scanned, kept, partial(violation, eased) if eased else objective, _ZOOMS)
        if best.broken or not best.figures.stable[0]:
            return None
        designs.append(best)
    return _allowing(limits, designs, set(group))


def _allowing(limits: Limits, designs: Sequence[Design], figures: set[str]) -> Limits:
    """Return the limits with some relaxed so far that each of the designs satisfies them; none becomes stricter."""
    eased = {}
    for bound in limits.for_hold():
        values = [float(getattr(each.figures, bound.figure)[0]) for each in designs if _has(each, bound)]
        broken = [value for value in values if (value > bound.limit if bound.at_most else value < bound.limit)]
        if bound.figure in figures and broken:
            eased[bound.figure] = bound.allowing(max(broken) if bound.at_most else min(broken))
    return limits._replace(**eased)


def _has(designed: Design, bound: Bound) -> bool:
    """Return whether a bound belongs to the set: the ramp set has none for its response to a step."""
    figures = {each.figure for each in designed.bounds}
    return bound.figure in figures or bound.figure in {each.figure for each in Limits().for_ramp()}


def proved(scanned: Scan, limits: Limits, eased: Limits, group: set[str]) -> Limits | None:
    """Return relaxed limits for which the search finds both sets, with looser bounds of the group if necessary."""
    for _ in range(_TRIES):
        designs = both_designs(scanned, eased)
        if designs.stable and not designs.broken:
            return eased
        looser = {
            after.figure: after.allowing(after.limit * (1.0 + _LOOSER if after.at_most else 1.0 - _LOOSER))
            for _, after in changes(limits, eased)
        }
        eased = _allowing(eased._replace(**looser), designs, group)
    return None


def _cost(limits: Limits, eased: Limits) -> float:
    """Return the relative difference of the relaxed bounds from the requested ones."""
    return sum(abs(after.limit / before.limit - 1.0) for before, after in changes(limits, eased))
