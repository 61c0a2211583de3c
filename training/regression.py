"""Regressions of sized samples with scikit-learn: choice of the form by cross-validation, quality, hand-over to torch."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from safetensors.torch import save
from scipy.stats import t as student_t
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import KFold
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from lpc_mdo.structures.samples import COMPONENTS, INPUTS, QUANTITIES, Samples
from lpc_mdo.surrogates.structural_mass import TARGETS

FOLDS = 10
SAME = 1e-9  # a target that varies by less than this share of its size is a constant
FORMS = ("linear", "quadratic", "power law")
# Tails carry their own area, the dynamic pressure and nothing else: fewer terms, less noise.
RELEVANT = {"horizontal_tail": (4, 5), "vertical_tail": (4, 6)}
EVERY_INPUT = tuple(range(len(INPUTS)))


@dataclass(frozen=True)
class Fit:
    """One target of one component; `columns` of the inputs are used; the pipeline is fitted to sign times the target (for
    power laws: to its logarithm). deviation: residual standard deviation in that space, with n - p degrees of freedom;
    r2_by_form: cross-validated, of the forms that apply, NaN for a constant; quantile: 95 % of held-out errors."""

    component: str
    target: str
    form: str
    columns: tuple[int, ...]
    sign: float
    pipeline: Pipeline
    r2_by_form: dict[str, float]
    count: int
    degrees_of_freedom: int
    deviation: float
    rmse: float
    rmse_cross_validated: float
    largest_error: float
    r2: float
    quantile: float

    def predict(self, inputs: np.ndarray) -> np.ndarray:
        """(sample,) by scikit-learn alone, for inputs (sample, input)."""
        return self.sign * _predict(self.pipeline, self.form, inputs[:, list(self.columns)])

    def quality(self) -> dict[str, Any]:
        def number(value: float, digits: int) -> float | None:
            return None if np.isnan(value) else round(value, digits)

        return {
            "form": self.form,
            "n": self.count,
            "r2": number(self.r2, 7),
            "r2_cross_validated": {form: number(value, 7) for form, value in self.r2_by_form.items()},
            "rmse": float(f"{self.rmse:.4g}"),
            "rmse_cross_validated": float(f"{self.rmse_cross_validated:.4g}"),
            "largest_error_cross_validated": float(f"{self.largest_error:.4g}"),
        }


def _pipeline(form: str) -> Pipeline:
    degree = 2 if form == "quadratic" else 1
    return make_pipeline(StandardScaler(), PolynomialFeatures(degree, include_bias=False), LinearRegression())


def _predict(pipeline: Pipeline, form: str, x: np.ndarray) -> np.ndarray:
    return np.exp(pipeline.predict(np.log(x))) if form == "power law" else pipeline.predict(x)


def _fitted(form: str, x: np.ndarray, y: np.ndarray) -> Pipeline:
    return _pipeline(form).fit(np.log(x), np.log(y)) if form == "power law" else _pipeline(form).fit(x, y)


def _held_out_residuals(form: str, x: np.ndarray, y: np.ndarray, seed: int) -> np.ndarray:
    """(sample,) each predicted from the folds that do not hold it."""
    residual = np.empty_like(y)
    for seen, unseen in KFold(FOLDS, shuffle=True, random_state=seed).split(x):
        residual[unseen] = y[unseen] - _predict(_fitted(form, x[seen], y[seen]), form, x[unseen])
    return residual


def _r2(residual: np.ndarray, y: np.ndarray) -> float:
    """NaN for a constant."""
    if np.ptp(y) <= SAME * np.abs(y).max():
        return float("nan")
    return float(1.0 - (residual**2).sum() / ((y - y.mean()) ** 2).sum())


def linear_slopes(inputs: np.ndarray, values: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Linear regression in the inputs' own units: slopes (input,), their standard errors (input,), intercept, and the
    cross-validated r2."""
    fit = LinearRegression().fit(inputs, values)
    ones = np.column_stack([np.ones(len(inputs)), inputs])
    scale = np.abs(ones).max(0)  # keeps the normal equations well conditioned
    residual = values - fit.predict(inputs)
    variance = (residual**2).sum() / (len(values) - ones.shape[1])
    errors = np.sqrt(variance * np.diag(np.linalg.inv((ones / scale).T @ (ones / scale)))) / scale
    return (
        fit.coef_,
        errors[1:],
        float(fit.intercept_),
        _r2(_held_out_residuals("linear", inputs, values, seed), values),
    )


def _choose(residuals: dict[str, np.ndarray]) -> str:
    """Linear, unless another form's mean squared error is lower by more than one standard error of the difference."""
    best = "linear"
    for form, residual in residuals.items():
        difference = residuals[best] ** 2 - residual**2
        if difference.mean() > difference.std(ddof=1) / np.sqrt(len(difference)):
            best = form
    return best


def _forms(columns: int, values: np.ndarray) -> list[str]:
    """Which forms the samples (of one sign, made positive) and their number allow."""
    if np.ptp(values) <= SAME * np.abs(values).max():
        return ["linear"]
    terms = (columns + 1) * (columns + 2) // 2
    allowed = {"linear": True, "quadratic": len(values) > 2 * terms, "power law": values.min() > 0.0}
    return [form for form in FORMS if allowed[form]]


def fit_target(component: str, target: str, inputs: np.ndarray, values: np.ndarray, seed: int) -> Fit:
    """The form that cross-validation prefers, fitted to all samples (sample, input) and (sample,).

    Raises ValueError if there are fewer samples than the linear form needs for cross-validation.
    """
    columns = RELEVANT.get(component, EVERY_INPUT)
    least = max(2 * (len(columns) + 1), FOLDS)
    if len(values) < least:
        raise ValueError(f"{len(values)} samples are not allowed; {component} needs at least {least}")
    x, sign = inputs[:, list(columns)], -1.0 if values.max() < 0.0 else 1.0
    y = sign * values
    residuals = {form: _held_out_residuals(form, x, y, seed) for form in _forms(len(columns), y)}
    form = _choose(residuals)
    pipeline = _fitted(form, x, y)
    own, held_out = y - _predict(pipeline, form, x), residuals[form]
    misfit = np.log(y) - pipeline.predict(np.log(x)) if form == "power law" else own
    freedom = len(y) - 1 - pipeline[1].n_output_features_
    return Fit(
        component=component,
        target=target,
        form=form,
        columns=columns,
        sign=sign,
        pipeline=pipeline,
        r2_by_form={name: _r2(residual, y) for name, residual in residuals.items()},
        count=len(y),
        degrees_of_freedom=freedom,
        deviation=float(np.sqrt((misfit**2).sum() / freedom)),
        rmse=float(np.sqrt((own**2).mean())),
        rmse_cross_validated=float(np.sqrt((held_out**2).mean())),
        largest_error=float(np.abs(held_out).max()),
        r2=_r2(own, y),
        quantile=float(np.quantile(np.abs(held_out), 0.95)),
    )


def fit_all(samples: Samples, seed: int) -> dict[tuple[int, int], Fit]:
    """Fits by (component, target) number; targets that are zero by symmetry are left out.

    Raises ValueError if targets are missing, samples too few, or an input does not vary.
    """
    for name, column in zip(INPUTS, samples.inputs.T, strict=True):
        if np.ptp(column) <= SAME * np.abs(column).max():
            raise ValueError(f"{name} = {column[0]:g} in all samples is not allowed; every input must vary")
    fits = {}
    for i, component in enumerate(COMPONENTS):
        for j, target in enumerate(TARGETS):
            values = samples.targets[:, i, QUANTITIES.index(target)]
            if np.isnan(values).any():
                raise ValueError(f"{component}.{target} is missing in {int(np.isnan(values).sum())} samples")
            if np.abs(values).max() > 1e-9:
                fits[i, j] = fit_target(component, target, samples.inputs, values, seed)
    return fits


def _places(fit: Fit, powers: np.ndarray) -> list[int]:
    """Rows of the whole basis (monomial, input) that hold the terms of a fit."""
    place = {tuple(row): k for k, row in enumerate(powers.tolist())}
    found = []
    for power in fit.pipeline[1].powers_:
        whole = np.zeros(powers.shape[1], dtype=int)
        whole[list(fit.columns)] = power
        found.append(place[tuple(whole.tolist())])
    return found


def _interval_arrays(fits: dict[tuple[int, int], Fit], x: np.ndarray, powers: np.ndarray) -> dict[str, np.ndarray]:
    """Errors of the masses, for `surrogates.structural_regression.MassIntervals`."""
    masses = [fits[i, 0] for i in range(len(COMPONENTS))]
    inverse_gram = np.zeros((len(masses), 1 + len(powers), 1 + len(powers)))
    for i, fit in enumerate(masses):
        used = x[:, list(fit.columns)]
        terms = fit.pipeline[:-1].transform(np.log(used) if fit.form == "power law" else used)
        terms = np.column_stack([np.ones(len(terms)), terms])
        rows = [0, *(1 + k for k in _places(fit, powers))]
        inverse_gram[i][np.ix_(rows, rows)] = np.linalg.inv(terms.T @ terms)
    return {
        "interval_inverse_gram": inverse_gram,
        "interval_deviation": np.array([fit.deviation for fit in masses]),
        "interval_student": np.array([student_t.ppf(0.975, fit.degrees_of_freedom) for fit in masses]),
        "interval_cross_validated": np.array([fit.quantile for fit in masses]),
    }


def export(fits: dict[tuple[int, int], Fit], samples: Samples) -> tuple[bytes, float]:
    """Weights (safetensors) for `surrogates.structural_mass.parse_trained`, and the largest leverage of the samples."""
    x = samples.inputs
    both = [StandardScaler().fit(values) for values in (x, np.log(x))]
    powers = PolynomialFeatures(2, include_bias=False).fit(x).powers_
    shape = len(COMPONENTS), len(TARGETS)
    coefficients, intercept, power_law_sign = np.zeros((len(powers), *shape)), np.zeros(shape), np.zeros(shape)
    for (i, j), fit in fits.items():
        regression, is_power_law = fit.pipeline[-1], fit.form == "power law"
        # The sign stands before the exponential of a power law, and in the coefficients of a polynomial.
        sign = 1.0 if is_power_law else fit.sign
        power_law_sign[i, j] = fit.sign if is_power_law else 0.0
        intercept[i, j] = sign * regression.intercept_
        coefficients[_places(fit, powers), i, j] = sign * regression.coef_
    z = (x - x.mean(0)) / x.std(0)
    inverse_gram = np.linalg.inv(z.T @ z)
    leverage = 1.0 / len(x) + np.einsum("ni,ij,nj->n", z, inverse_gram, z)
    arrays = {
        "mean": np.stack([scaler.mean_ for scaler in both]),
        "scale": np.stack([scaler.scale_ for scaler in both]),
        "powers": powers.astype(float),
        "coefficients": coefficients,
        "intercept": intercept,
        "power_law_sign": power_law_sign,
        "lower": x.min(0),
        "upper": x.max(0),
        "sample_mean": x.mean(0),
        "sample_deviation": x.std(0),
        "sample_inverse_gram": inverse_gram,
        **_interval_arrays(fits, x, powers),
    }
    return save({name: torch.from_numpy(np.ascontiguousarray(a)) for name, a in arrays.items()}), float(leverage.max())
