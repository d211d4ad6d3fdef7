"""purecma and pycma, by Hansen and others, as peers of CMA-ES: the update by given samples of the
first, and the evaluations that the second takes to a target. Reads a request from standard input, prints JSON."""

import contextlib
import json
import math
import sys
import warnings

warnings.filterwarnings("ignore")  # There is no need for its plots.

import cma
from cma.more_algorithms import purecma
from cma.recombination_weights import RecombinationWeights


def updates(request):
    """Distributions after each generation of ranked samples."""
    mean, step = request["mean"], request["step"]
    population = len(request["generations"][0])
    parameters = purecma.CMAESParameters(len(mean), population, RecombinationWeights)
    # The tutorial's damping, and below its step size by the length of the path.
    excess = math.sqrt((parameters.mueff - 1) / (len(mean) + 1)) - 1
    parameters.damps = 1 + 2 * max(0, excess) + parameters.cs
    strategy = purecma.CMAES(mean, step, population)
    strategy.params = parameters
    found = []
    for samples in request["generations"]:
        strategy.C.update_eigensystem(strategy.counteval, 0)
        before = strategy.sigma
        strategy.tell(samples, list(range(population)))
        length = math.sqrt(sum(x * x for x in strategy.ps))
        ratio = length / parameters.chiN - 1
        strategy.sigma = before * math.exp(min(1, parameters.cs / parameters.damps * ratio))
        found.append(
            {
                "mean": list(strategy.xmean),
                "step": strategy.sigma,
                "covariances": [list(map(float, row)) for row in strategy.C],
                "path": list(strategy.pc),
                "step_path": list(strategy.ps),
            }
        )
    return found


FUNCTIONS = {
    "sphere": lambda x: sum((v - 1) ** 2 for v in x),
    "ellipsoid": lambda x: sum(
        10 ** (6 * i / (len(x) - 1)) * (v - 1) ** 2 for i, v in enumerate(x)
    ),
    "rosenbrock": lambda x: sum(
        100 * (b - a * a) ** 2 + (1 - a) ** 2 for a, b in zip(x, x[1:])
    ),
}


def evaluations(request):
    """Evaluations to a cost of 1e-9, for each function and seed; none where a local minimum or
    another end comes first."""
    options = {"ftarget": 1e-9, "verbose": -9, "maxfevals": 30000}
    found = {}
    for name, function in FUNCTIONS.items():
        counts = []
        for seed in range(1, request["runs"] + 1):
            start = request["size"] * [0.0]
            strategy = cma.CMAEvolutionStrategy(start, 3.0, {**options, "seed": seed})
            strategy.optimize(function)
            reached = strategy.result.fbest <= 1e-9
            counts.append(strategy.result.evaluations if reached else None)
        found[name] = counts
    return found


request = json.load(sys.stdin)
with contextlib.redirect_stdout(sys.stderr):  # It prints remarks on its weights.
    answer = {"updates": updates, "evaluations": evaluations}[request["request"]](request)
print(json.dumps(answer))
