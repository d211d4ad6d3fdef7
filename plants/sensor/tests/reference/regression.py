"""Linear models of cells by statsmodels.

Reads {"cells": rows of coded factors, "responses": [{"values", "effects", "coded", "threshold"}]}
from standard input; an effect is a list of columns of factors. Prints for each response the table
of the model, its prediction intervals at the rows of `coded`, those that hold for three responses
jointly, and what backward elimination keeps of all effects of up to two factors.
"""

import itertools
import json
import sys

import numpy as np
import statsmodels.api as sm


def columns(factors, effects):
    products = [np.prod(factors[:, effect], axis=1) for effect in effects]
    return np.column_stack([np.ones(len(factors)), *products])


def table(model, effects):
    rows = []
    for n in range(1, len(effects) + 1):
        test = model.f_test(np.eye(len(effects) + 1)[n])
        squares = float(test.fvalue) * model.mse_resid
        rows.append([model.params[n], squares, float(test.fvalue), float(test.pvalue)])
    return rows


def eliminate(cells, values, threshold):
    pairs = [list(pair) for pair in itertools.combinations(range(5), 2)]
    effects = []
    for effect in [[n] for n in range(5)] + pairs:
        wider = columns(cells, [*effects, effect])
        if np.linalg.matrix_rank(wider) == wider.shape[1]:
            effects.append(effect)
    while True:
        model = sm.OLS(values, columns(cells, effects)).fit()
        worst = int(np.argmax(model.pvalues[1:]))
        if model.pvalues[1:][worst] <= threshold:
            return {"effects": effects, "p": model.pvalues[1:].tolist()}
        del effects[worst]


case = json.load(sys.stdin)
cells = np.array(case["cells"])
answers = []
for response in case["responses"]:
    values, effects = np.array(response["values"]), response["effects"]
    model = sm.OLS(values, columns(cells, effects)).fit()
    at = columns(np.array(response["coded"]), effects)
    prediction = model.get_prediction(at)
    intervals = prediction.conf_int(obs=True, alpha=0.05)
    answers.append(
        {
            "constant": model.params[0],
            "rows": table(model, effects),
            "residual": model.ssr,
            "f": model.fvalue,
            "p": model.f_pvalue,
            "r_squared": model.rsquared,
            "intervals": [
                [value, *ends] for value, ends in zip(prediction.predicted_mean, intervals.tolist())
            ],
            "joint": prediction.conf_int(obs=True, alpha=0.05 / 3.0).tolist(),
            "kept": eliminate(cells, values, response["threshold"]),
        }
    )
json.dump(answers, sys.stdout)
