"""A first guess of the delay: whole samples, by least squares at each and SRIVC at the best few."""

from __future__ import annotations

import numpy as np

from smartshoe.arrays import Array
from smartshoe.errors import NotIdentifiableError
from smartshoe.identification.transfer_function._discrete import prefilter
from smartshoe.identification.transfer_function._problem import OutputError

MOST_SAMPLES = 500
MOST_SHARE = 0.25  # of the shortest experiment's duration
UNEVEN_POINTS = 40
CANDIDATES = 3  # delays from each prefilter
MARGIN = 1e-8  # steps by which a cell's lower end lies above the whole sample


def longest_delay_s(problem: OutputError) -> float:
    """The largest delay in s that is searched where the user gives none."""
    shortest = min(problem.experiments, key=lambda experiment: float(experiment.time_s[-1]))
    return min(MOST_SHARE * float(shortest.time_s[-1]), MOST_SAMPLES * shortest.typical_step_s)


def common_step_s(problem: OutputError) -> float | None:
    """The even step in s shared by all experiments, or None."""
    step = problem.experiments[0].step_s
    return step if all(experiment.step_s == step for experiment in problem.experiments) else None


def delay_grid(problem: OutputError, most_delay_s: float) -> Array:
    """Delays in s to try: every whole sample where all steps are equal, `UNEVEN_POINTS` where they are not."""
    step = common_step_s(problem)
    if step is None:
        return np.linspace(0.0, most_delay_s, UNEVEN_POINTS)
    return np.asarray(step * np.arange(int(most_delay_s / step + 1e-9) + 1))


def screen(problem: OutputError, prefilter_rad_s: float, grid: Array) -> Array:
    """Equation error behind the state-variable filter at each delay of ``grid`` (n,), over all samples.

    A delay by whole samples is a shift of filtered signals. Before a record the input is taken as 0 (start at rest), or
    else as its first value, with the free response for the difference.
    """
    n = problem.poles
    chain = prefilter(n, prefilter_rad_s)
    rows, _ = chain.derivatives_of_x()
    powers = list(range(problem.zeros, -1, -1))
    step = common_step_s(problem)
    size = n + 1 + problem.zeros + 1
    normals = np.zeros((grid.size, size, size))
    for index, experiment in enumerate(problem.experiments):
        counted = experiment.counted
        y = experiment.y - (problem.offset or 0.0)
        run = problem.filtered(chain, index, y)
        nuisance = problem.nuisance(chain, index, problem.free(chain, index))
        outputs = np.hstack([(run.states @ rows[n] + y)[:, None], run.states @ rows[:n].T])
        outputs[~counted] = 0.0
        outputs = nuisance.clear(outputs)
        at_rest = problem.initial_state == "rest"
        held = np.zeros(chain.size) if at_rest else chain.steady(float(experiment.u[0]))
        whole = None if step is None else problem.forced(chain, index, 0.0, start=held)
        for at, delay_s in enumerate(grid):
            if whole is not None and step is not None:
                shift = round(delay_s / step)
                index_of = np.maximum(np.arange(-shift, counted.size - shift), 0)
                inputs = whole.states[index_of] @ rows[powers].T
                if problem.zeros == n:
                    inputs[:, 0] += whole.value[index_of]
                if at_rest:
                    inputs[:shift] = 0.0
            else:
                later = problem.forced(chain, index, float(delay_s))
                inputs = later.states @ rows[powers].T
                if problem.zeros == n:
                    inputs[:, 0] += later.value
            inputs[~counted] = 0.0
            block = np.hstack([outputs, nuisance.clear(inputs)])
            normals[at] += block.T @ block
    return np.array([_left(normal) for normal in normals])


def _left(normal: Array) -> float:
    """Sum of squares of the first column that the others do not explain, from their normal matrix."""
    norm = np.sqrt(np.diag(normal))
    norm[norm == 0.0] = 1.0
    scaled = normal / np.outer(norm, norm)
    solution = np.linalg.lstsq(scaled[1:, 1:], scaled[1:, 0], rcond=1e-12)[0]
    return float((1.0 - scaled[0, 1:] @ solution) * norm[0] ** 2)


def candidates(costs: Array) -> list[int]:
    """Indices of the lowest local minima of ``costs``, best first."""
    if not np.isfinite(costs).any():
        raise NotIdentifiableError("no delay gives a finite fit: give delay_s as a number")
    around = np.concatenate([[np.inf], costs, [np.inf]])
    lows = np.flatnonzero((costs <= around[:-2]) & (costs <= around[2:]))
    return [int(index) for index in lows[np.argsort(costs[lows])][:CANDIDATES]]


def cells(problem: OutputError, at_s: float, step_s: float, most_s: float) -> list[tuple[float, float]]:
    """The intervals of delay around ``at_s`` within which the cost is smooth.

    Where a held input jumps, so does the output's slope, and the cost has a kink at every whole sample, where its
    minimum may well lie. The gradient at a whole sample is that of the cell below it; hence the margin above.
    """
    if problem.hold == "foh" or common_step_s(problem) is None:
        return [(max(at_s - 4.0 * step_s, 0.0), min(at_s + 2.0 * step_s, most_s))]
    nearest = round(at_s / step_s)
    whole = abs(at_s - nearest * step_s) <= MARGIN * step_s
    lowest = [nearest - 1, nearest] if whole else [int(np.floor(at_s / step_s))]
    ends = [((k + MARGIN) * step_s, min((k + 1) * step_s, most_s)) for k in lowest if k >= 0]
    return [(low, high) for low, high in ends if low < high] or [(max(at_s - step_s, 0.0), most_s)]


def snapped(delay_s: float, low_s: float, high_s: float, step_s: float, near: float = MARGIN) -> float:
    """``delay_s``, or the whole sample at the end of its cell where it is within ``near`` steps of it."""
    if delay_s <= low_s + near * step_s:
        return max(low_s - MARGIN * step_s, 0.0)
    return high_s if delay_s >= high_s - near * step_s else delay_s


def traded_zeros(numerator: Array) -> list[tuple[Array, float]]:
    """Numerators with one zero (or pair) mirrored in the imaginary axis, and the delay in s that compensates for it.

    (1 - s/z)/(1 + s/z) is nearly exp(-2 s/z) (Pade), so that a zero on the wrong side with a delay too short or too
    long fits almost as well as the truth. This is a separate local minimum, which no descent leaves.
    """
    roots = np.roots(numerator)
    traded = []
    for root in roots:
        if root.imag < 0.0 or root.real == 0.0:
            continue
        family = np.isclose(roots, root) | np.isclose(roots, root.conj())
        others = np.where(family, -roots.conj(), roots)
        mirrored = np.real(np.poly(others))
        # The gain at s = 0 is preserved.
        mirrored *= numerator[-1] / mirrored[-1]
        traded.append(
            (np.asarray(mirrored, dtype=float), float(np.sum(2.0 * roots[family].real / np.abs(roots[family]) ** 2)))
        )
    return traded
