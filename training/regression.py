"""Regressions of sized samples with scikit-learn: choice of the form by cross-validation, quality, hand-over to torch."""

from dataclasses import dataclass

import numpy as np
import torch
from safetensors.torch import save
from sklearn.linear_model import LinearRegression
from sklearn.model_selection import KFold
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import PolynomialFeatures, StandardScaler

from surrogates.structural_mass import TARGETS
from training.samples import COMPONENTS, INPUTS, QUANTITIES, Samples

FOLDS = 10
FORMS = ("linear", "quadratic", "power law")
# Tails carry their own area, the dynamic pressure and nothing else: fewer terms, less noise.
RELEVANT = {"horizontal_tail": (4, 5), "vertical_tail": (4, 6)}
EVERY_INPUT = tuple(range(len(INPUTS)))


@dataclass
class Fit:
    """One target of one component; `columns` of the inputs are used. r2_cv by form, of those that apply."""

    component: str
    target: str
    form: str
    columns: tuple[int, ...]
    pipeline: Pipeline
    r2_by_form: dict[str, float]
    count: int = 0
    rmse: float = 0.0
    rmse_cross_validated: float = 0.0
    largest_error: float = 0.0
    r2: float = 1.0
    quantile: float = 0.0

    @staticmethod
    def linear(component: str, inputs: np.ndarray, values: np.ndarray) -> "Fit":
        """A fitted linear form of a mass."""
        return Fit(component, "mass_kg", "linear", EVERY_INPUT, _pipeline("linear").fit(inputs, values), {})

    def predict(self, inputs: np.ndarray) -> np.ndarray:
        return _predict(self.pipeline, self.form, inputs[:, list(self.columns)])

    def slopes(self, at: np.ndarray) -> np.ndarray:
        """Derivatives (input,) of a linear form in the inputs' own units; central differences are exact for it."""
        steps = np.diag(0.01 * at)
        return (self.predict(at + steps) - self.predict(at - steps)) / (0.02 * at)

    def quality(self) -> dict:
        return {
            "form": self.form,
            "n": self.count,
            "r2": round(self.r2, 7),
            "r2_cross_validated": {form: round(value, 7) for form, value in self.r2_by_form.items()},
            "rmse": float(f"{self.rmse:.4g}"),
            "rmse_cross_validated": float(f"{self.rmse_cross_validated:.4g}"),
            "largest_error": float(f"{self.largest_error:.4g}"),
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
    return float(1.0 - (residual**2).sum() / ((y - y.mean()) ** 2).sum())


def cross_validated_r2(fit: Fit, inputs: np.ndarray, values: np.ndarray, seed: int) -> float:
    return _r2(_held_out_residuals(fit.form, inputs[:, list(fit.columns)], values, seed), values)


def _choose(residuals: dict[str, np.ndarray]) -> str:
    """Linear, unless another form's mean squared error is lower by more than one standard error of the difference."""
    best = "linear"
    for form, residual in residuals.items():
        difference = residuals[best] ** 2 - residual**2
        if difference.mean() > difference.std(ddof=1) / np.sqrt(len(difference)):
            best = form
    return best


def fit_target(component: str, target: str, inputs: np.ndarray, values: np.ndarray, seed: int) -> Fit:
    """The form that cross-validation prefers, fitted to all samples (sample, input) and (sample,).

    Raises ValueError if there are fewer samples than the linear form needs for cross-validation.
    """
    columns = RELEVANT.get(component, EVERY_INPUT)
    if len(values) < 2 * (len(columns) + 1):
        raise ValueError(f"{len(values)} samples are not allowed; {component} needs at least {2 * (len(columns) + 1)}")
    x = inputs[:, list(columns)]
    terms = (len(columns) + 1) * (len(columns) + 2) // 2
    forms = [
        f for f in FORMS if (f != "power law" or values.min() > 0) and (f != "quadratic" or len(values) > 2 * terms)
    ]
    residuals = {form: _held_out_residuals(form, x, values, seed) for form in forms}
    form = _choose(residuals)
    pipeline = _fitted(form, x, values)
    own = values - _predict(pipeline, form, x)
    held_out = residuals[form]
    return Fit(
        component=component,
        target=target,
        form=form,
        columns=columns,
        pipeline=pipeline,
        r2_by_form={name: _r2(residual, values) for name, residual in residuals.items()},
        count=len(values),
        rmse=float(np.sqrt((own**2).mean())),
        rmse_cross_validated=float(np.sqrt((held_out**2).mean())),
        largest_error=float(np.abs(held_out).max()),
        r2=_r2(own, values),
        quantile=float(np.quantile(np.abs(held_out), 0.95)),
    )


def fit_all(samples: Samples, seed: int) -> dict[tuple[int, int], Fit]:
    """Fits by (component, target) number; targets that are zero by symmetry are left out."""
    fits = {}
    for i, component in enumerate(COMPONENTS):
        for j, target in enumerate(TARGETS):
            values = samples.targets[:, i, QUANTITIES.index(target)]
            if not np.isnan(values).any() and np.abs(values).max() > 1e-9:
                fits[i, j] = fit_target(component, target, samples.inputs, values, seed)
    return fits


def export(fits: dict[tuple[int, int], Fit], samples: Samples) -> tuple[bytes, float]:
    """Weights (safetensors) for `surrogates.structural_mass.parse_trained`, and the largest leverage of the samples."""
    x = samples.inputs
    both = [StandardScaler().fit(values) for values in (x, np.log(x))]
    powers = PolynomialFeatures(2, include_bias=False).fit(x).powers_
    shape = len(COMPONENTS), len(TARGETS)
    coefficients, intercept = np.zeros((len(powers), *shape)), np.zeros(shape)
    is_power_law = np.zeros(shape, dtype=bool)
    place = {tuple(row): k for k, row in enumerate(powers.tolist())}
    for (i, j), fit in fits.items():
        regression = fit.pipeline[-1]
        intercept[i, j], is_power_law[i, j] = regression.intercept_, fit.form == "power law"
        for power, coefficient in zip(fit.pipeline[1].powers_, regression.coef_, strict=True):
            whole = np.zeros(x.shape[1], dtype=int)
            whole[list(fit.columns)] = power
            coefficients[place[tuple(whole.tolist())], i, j] = coefficient
    z = (x - x.mean(0)) / x.std(0)
    inverse_gram = np.linalg.inv(z.T @ z)
    leverage = 1.0 / len(x) + np.einsum("ni,ij,nj->n", z, inverse_gram, z)
    quantiles = [fits[i, 0].quantile if (i, 0) in fits else float("nan") for i in range(len(COMPONENTS))]
    arrays = {
        "mean": np.stack([scaler.mean_ for scaler in both]),
        "scale": np.stack([scaler.scale_ for scaler in both]),
        "powers": powers.astype(float),
        "coefficients": coefficients,
        "intercept": intercept,
        "is_power_law": is_power_law,
        "lower": x.min(0),
        "upper": x.max(0),
        "sample_mean": x.mean(0),
        "sample_deviation": x.std(0),
        "inverse_gram": inverse_gram,
        "mass_interval": np.array(quantiles),
    }
    return save({name: torch.from_numpy(np.ascontiguousarray(a)) for name, a in arrays.items()}), float(leverage.max())
