# Copyright 2026 The stickslip_ros maintainers
# SPDX-License-Identifier: Apache-2.0

"""A trial fit with resonance and bandwidth free: the first fit may have missed them."""

from dataclasses import replace

from stickslip_ros.lab.fitting.free import OF_A_FALL, choose_free
from stickslip_ros.lab.fitting.missing import Missing, Trial
from stickslip_ros.lab.fitting.problem import Problem
from stickslip_ros.lab.fitting.search import search
from stickslip_ros.lab.fitting.traces import LOOSE, to_plain, with_clocks


def fit_trial(problem: Problem, missing: tuple[Missing, ...]) -> Trial | None:
    """
    Fit again with resonance and bandwidth free; return None if no parameter is missing.

    A ringing piezo loosens the contacts at each fall. A stand without it compensates this by a
    tenth of the friction, or by a slow sensor, and no slope leads back from there: a search from
    the start is needed.

    """
    freed = [name for name in OF_A_FALL if name not in {one.name for one in problem.free}]
    if not missing or not freed:
        return None
    stand, more, _ = choose_free(problem.parameters, freed)
    experiments = tuple(
        replace(one, seen=tuple(replace(each, slow_s=0.0) for each in one.seen))
        for one in problem.experiments
    )
    bare = replace(problem, parameters=stand, free=(*problem.free, *more), experiments=experiments)
    loose = replace(with_clocks(bare), allowance=LOOSE[0], metrics=())
    ended, chain = to_plain(loose, search(loose, loose.start))
    values = ended.values(chain[-1].place)[: len(problem.free)]
    return Trial(tuple(freed), missing[0].chi_square, chain[-1].chi_square, tuple(values))
