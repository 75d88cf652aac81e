"""What other packages take for the tasks of `tests/benches/peers/main.rs`, on the same recording: prints JSON.

Each does it as its documentation advises. Errors are those of a free run over the recording, over its standard deviation.
What is compiled (numba) is compiled before the clock starts.
"""

import csv
import json
import sys
import time
import warnings

import numpy as np
import padasip
import pysindy
from numba import njit
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares
from sysidentpy.basis_function import Polynomial
from sysidentpy.model_structure_selection import FROLS
from sysidentpy.parameter_estimation import LeastSquares

ROUNDS = 5
MANY = 100
STEPS = 4  # of Runge and Kutta in a sample, as loopsight takes them
FREE_RUN = "1. a free run of the plain model, 25 s"
FIT = "2. a fit of mass, stiffness, damping and friction"
SEARCH = "3. the search for what is missing"
UPDATES = "4. recursive least squares, 2499 updates"

with open(sys.argv[1], newline="") as file:
    rows = list(csv.DictReader(file))
t, u, y = (np.array([float(row[name]) for row in rows]) for name in ("time_s", "force_N", "position_m"))
period = float(np.median(np.diff(t)))


def median(once, rounds=ROUNDS):
    times = []
    for _ in range(rounds):
        began = time.perf_counter()
        once()
        times.append(time.perf_counter() - began)
    return sorted(times)[len(times) // 2]


def error(predicted):
    n = min(len(predicted), len(y))
    wrong = predicted[-n:] - y[-n:]
    return float(np.sqrt(np.mean(wrong**2)) / np.std(y))


@njit
def acceleration(p, x, v, force):
    """p: 1/m, d/m, k/m, level of friction over m."""
    return p[0] * force - p[1] * v - p[2] * x - p[3] * np.tanh(v / 2e-3)


@njit
def free_run(p, force, h, steps):
    out = np.empty(len(force))
    x, v = p[4], p[5]
    h = h / steps
    for k in range(len(force)):
        out[k] = x
        f = force[k]
        for _ in range(steps):
            a1 = acceleration(p, x, v, f)
            v2 = v + 0.5 * h * a1
            a2 = acceleration(p, x + 0.5 * h * v, v2, f)
            v3 = v + 0.5 * h * a2
            a3 = acceleration(p, x + 0.5 * h * v2, v3, f)
            v4 = v + h * a3
            a4 = acceleration(p, x + h * v3, v4, f)
            x += h / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return out


@njit
def plain_run(p, force, h, steps):
    """The same without friction: what the plain model has to compute."""
    out = np.empty(len(force))
    x, v = 0.0, 0.0
    h = h / steps
    for k in range(len(force)):
        out[k] = x
        f = force[k]
        for _ in range(steps):
            a1 = p[0] * f - p[1] * v - p[2] * x
            v2 = v + 0.5 * h * a1
            a2 = p[0] * f - p[1] * v2 - p[2] * (x + 0.5 * h * v)
            v3 = v + 0.5 * h * a2
            a3 = p[0] * f - p[1] * v3 - p[2] * (x + 0.5 * h * v2)
            v4 = v + h * a3
            a4 = p[0] * f - p[1] * v4 - p[2] * (x + h * v3)
            x += h / 6 * (v + 2 * v2 + 2 * v3 + v4)
            v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return out


believed = np.array([0.5, 1.2, 100.0, 0.0, 0.0, 0.0])
plain_run(believed, u, period, STEPS)


def many_free_runs():
    for _ in range(MANY):
        plain_run(believed, u, period, STEPS)


free = median(many_free_runs) / MANY


def fitted():
    """Parameters of about 1, and the start, which is not known either."""
    scale = np.array([0.5, 1.2, 100.0, 0.1, 0.01, 0.1])
    first = np.array([1.0, 1.0, 1.0, 0.3, 0.0, 0.0])
    found = least_squares(lambda p: free_run(p * scale, u, period, STEPS) - y, first, x_scale="jac")
    return found.x * scale


fitting = median(fitted)


def weak():
    """PySINDy in its weak form: position and speed, polynomials up to the third degree, a threshold on scaled states."""
    v = np.gradient(y, period)
    state = np.column_stack([y / np.std(y), v / np.std(v)])
    library = pysindy.WeakPDELibrary(
        pysindy.PolynomialLibrary(degree=3, include_bias=False), spatiotemporal_grid=t, K=200, H_xt=0.2
    )
    np.random.seed(1)  # the places of the test functions are drawn
    model = pysindy.SINDy(optimizer=pysindy.STLSQ(threshold=0.1), feature_library=library)
    model.fit(state, t=t, u=u / np.std(u))
    return model, np.std(v)


def weak_error(model, speed):
    """Its free run: the terms that it found, by SciPy's solver."""
    terms = pysindy.PolynomialLibrary(degree=3, include_bias=False)
    terms.fit(np.zeros((2, 3)))
    coefficients = np.asarray(model.coefficients())
    force = lambda now: u[min(int(now / period), len(u) - 1)] / np.std(u)
    rate = lambda now, s: (np.asarray(terms.transform(np.array([[*s, force(now)]]))) @ coefficients.T)[0]
    run = solve_ivp(rate, (t[0], t[-1]), [y[0] / np.std(y), 0.0], t_eval=t, max_step=period)
    return error(run.y[0] * np.std(y)) if run.success else float("inf")


def narx():
    """SysIdentPy: a polynomial NARX model, terms by FROLS, how many by BIC."""
    model = FROLS(
        order_selection=True, info_criteria="bic", n_info_values=15, ylag=3, xlag=3,
        basis_function=Polynomial(degree=3), estimator=LeastSquares(),
    )  # fmt: skip
    model.fit(X=u[:, None], y=y[:, None])
    return model


speed = (y[2:] - y[:-2]) / (2 * period)
second = (y[2:] - 2 * y[1:-1] + y[:-2]) / period**2
regressors = np.column_stack([u[1:-1], speed, y[1:-1]])


def updates():
    """padasip's filter, as `run` does it."""
    rls = padasip.filters.FilterRLS(n=3, mu=0.999, eps=1e-3, w="zeros")
    rls.run(second, regressors)
    return rls.w


with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    weakly = median(weak)
    sparse, speed_scale = weak()
    left = weak_error(sparse, speed_scale)
    terms = int(np.count_nonzero(sparse.coefficients()))
    weak_result = f"{terms} terms, " + (f"error {100 * left:.2f} %" if left < 10 else "its free run runs away")
    narxly = median(narx)
    chosen = narx()
    predicted = chosen.predict(X=u[:, None], y=y[:3, None])[:, 0]
    updating = median(updates)


def figure(seconds, result):
    return {"seconds": seconds, "result": result}


print(
    json.dumps({
        FREE_RUN: {"numba, RK4 by hand": figure(free, "four steps a sample")},
        FIT: {
            "scipy least_squares, numba": figure(fitting, f"error {100 * error(free_run(fitted(), u, period, STEPS)):.2f} %")
        },
        SEARCH: {
            "PySINDy, weak form": figure(weakly, weak_result),
            "SysIdentPy, FROLS": figure(narxly, f"{len(chosen.final_model)} terms, error {100 * error(predicted):.2f} %"),
        },
        UPDATES: {"padasip FilterRLS": figure(updating, f"inverse mass {updates()[0]:.3f} 1/kg")},
    })
)
