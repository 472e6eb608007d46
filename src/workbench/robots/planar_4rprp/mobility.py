"""Mobility of the 4-RPRP robot by Gogu's count, its dimensions taken from screws; [GarciaMurillo2016] section 3."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from workbench.arrays import FloatArray, as_batch
from workbench.robots import screws
from workbench.robots.planar_4rprp.screws import limb

REAL_JOINTS = [0, 3, 4]
"""Places of a limb's own joints R, P, R among its six screws; two are virtual, the last is the rod's slide."""

ROD_SLIDE = 5
LOOPS = ((1, 3), (2, 4))
"""H1 and H2: the limbs that a rod joins."""


@dataclass(frozen=True)
class GoguCount:
    """Gogu's count; tuples are in the order of the loops H1, H2. Names follow [GarciaMurillo2016] eq. (1)-(8)."""

    p: int
    """joints, each with one freedom"""
    limb_connectivity: tuple[tuple[int, int], ...]
    """S_G1, S_G2 of each loop"""
    rod_connectivity: tuple[int, ...]
    """S_F of each loop: what both limbs allow the rod"""
    lost_in_loops: tuple[int, ...]
    """r_l of each loop"""
    loop_connectivity: tuple[int, ...]
    """S_H of each loop: what it allows the platform"""
    platform_connectivity: int
    """S_F of the mechanism"""
    r: int
    """joint parameters that lose their independence"""
    mobility: int
    """M = p - r"""
    loop_rows: int
    """rows of the matrix of the three independent loops (6 each)"""
    loop_rank: int
    """its rank; equals r"""


def gogu_mobility(parameters: Any, x: ArrayLike | None = None) -> GoguCount:
    """Count freedoms as in section 3, the dimensions of the velocity spaces being ranks of screws at one pose.

    Parameters
    ----------
    parameters
        Parameters of the mechanism, SI.
    x
        One position of P, ``(1, 3)``, metres; None takes a generic pose.

    Returns
    -------
    GoguCount
        p = 14, r = 11, M = 3 at poses that are not singular.
    """
    generic = [[0.45 * parameters.a, abs(parameters.h) + 0.4 * parameters.a, 0.6 * parameters.b]]
    pose = as_batch("x", generic if x is None else x)
    chains = {number: limb(parameters, number, pose).screws[0] for number in (1, 2, 3, 4)}
    spaces = {number: screws.span(chain[REAL_JOINTS]) for number, chain in chains.items()}
    limbs, rods, lost, loops = [], [], [], []
    for first, second in LOOPS:
        rod = screws.intersection(spaces[first], spaces[second])
        limbs.append((_dimension(spaces[first]), _dimension(spaces[second])))
        rods.append(_dimension(rod))
        lost.append(sum(limbs[-1]) - rods[-1])
        loops.append(screws.span(np.vstack([rod.T, chains[first][ROD_SLIDE]])))
    platform = screws.intersection(loops[0], loops[1])
    matrix = loop_matrix(parameters, pose)
    p = matrix.shape[1]
    r = sum(_dimension(loop) for loop in loops) - _dimension(platform) + sum(lost)
    return GoguCount(
        p=p,
        limb_connectivity=tuple(limbs),
        rod_connectivity=tuple(rods),
        lost_in_loops=tuple(lost),
        loop_connectivity=tuple(_dimension(loop) for loop in loops),
        platform_connectivity=_dimension(platform),
        r=r,
        mobility=p - r,
        loop_rows=matrix.shape[0],
        loop_rank=_dimension(screws.span(matrix.T)),
    )


def loop_matrix(parameters: Any, x: ArrayLike) -> FloatArray:
    """Matrix ``(18, 14)`` that sends joint rates to the gaps of the three independent loops, at one pose.

    Columns: R, P, R of limb 1, the slide of rod 1-3, R, P, R of limb 2, the slide of rod 2-4, R, P, R of limbs 3 and 4.
    Rows: rod 1-3 by limbs 1 and 3, rod 2-4 by limbs 2 and 4, platform by rods 1-3 and 2-4.
    """
    pose = as_batch("x", x)[:1]
    chains = {number: limb(parameters, number, pose).screws[0] for number in (1, 2, 3, 4)}
    real = {number: chain[REAL_JOINTS].T for number, chain in chains.items()}
    slide = {number: chains[number][ROD_SLIDE][:, None] for number in (1, 2)}
    none, three = np.zeros((6, 1)), np.zeros((6, 3))
    return np.block(
        [
            [real[1], none, three, none, -real[3], three],
            [three, none, real[2], none, three, -real[4]],
            [real[1], slide[1], -real[2], -slide[2], three, three],
        ]
    )


def _dimension(basis: FloatArray) -> int:
    return int(basis.shape[1])
