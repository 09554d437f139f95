"""The evolution strategy with covariance matrix adaptation (CMA-ES): the top of a rugged function.

A population is drawn from a normal distribution; the better half of it, weighted by rank, shapes the next one. Only the
order of the heights counts and no derivative is taken, so ruggedness that is narrower than the population does not
show; and it is all one which way a ridge runs. The method is N. Hansen's, "The CMA Evolution Strategy: A Tutorial",
arXiv:1604.00772, and so is the library.
"""

from collections.abc import Callable
from math import nan
from typing import NamedTuple

import cma
import numpy as np

from tools.emulated import Array


class Summit(NamedTuple):
    """The highest vector that was seen, and the covariance of the population that would be drawn next."""

    best: Array
    covariance: Array


def climb(
    height: Callable[[Array], float],
    mean: Array,
    covariance: Array,
    population: int,
    generations: int,
    chance: np.random.Generator,
) -> Summit:
    """Return where the populations come to.

    Args:
        height: What is to be greatest.
        mean: (n,) of the first population.
        covariance: (n, n) of the first population.
        population: How many are drawn at a time.
        generations: How many populations are drawn.
        chance: Draws them.
    """

    def drawn(rows: int, columns: int) -> Array:
        return chance.standard_normal((rows, columns))

    root = np.linalg.cholesky(covariance)  # from coordinates in which the first population is round
    strategy = cma.CMAEvolutionStrategy(
        np.zeros(len(mean)), 1.0, {"popsize": population, "randn": drawn, "seed": nan, "verbose": -9}
    )
    for _ in range(generations):
        steps = strategy.ask()
        strategy.tell(steps, [-height(mean + root @ step) for step in steps])
    return Summit(mean + root @ strategy.best.x, strategy.sigma**2 * root @ strategy.C @ root.T)
