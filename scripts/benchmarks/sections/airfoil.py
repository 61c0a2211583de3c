"""Airfoil surrogate beside NeuralFoil: errors on unseen polars, evaluations per second."""

from benchmarks.sections.cells import megabytes
from benchmarks.session import Outcome, measure
from benchmarks.sheets import Section, Sheet
from benchmarks.subject import Subject

TARGET = "benchmarks.subjects.airfoil"
BATCH = 20_000  # points at a time, as training.neuralfoil has them
POINTS = {"unseen_polars_re_from_2e5": "Re from 2e5", "unseen_polars_re_1e5_to_2e5": "Re 1e5 to 2e5"}
ERRORS = (("cl_mean", 1.0, 4), ("cl_max", 1.0, 4), ("cd_mean_relative", 100.0, 2), ("cd_max_relative", 100.0, 2))


def run(is_quick: bool) -> Section:
    compared, value, slope = measure(
        [
            Subject("NeuralFoil", f"{TARGET}:prepare_comparison", package="neuralfoil"),
            Subject("lpc-mdo, value", f"{TARGET}:prepare_own", {"has_gradient": False}),
            Subject("lpc-mdo, value and slope", f"{TARGET}:prepare_own", {"has_gradient": True}),
        ],
        15,
        3.0,
    )
    rows = [(o.subject.label, o.absence or f"{BATCH / o.median:,.0f}", megabytes(o)) for o in (value, slope)]
    if compared.absence:
        rows.append(("NeuralFoil", compared.absence, ""))
        return Section((_speed(rows),))
    speed = compared.check["speed"]
    rows += [(f"{name}, in the comparison", f"{per_second:,.0f}", "") for name, per_second in speed.items()]
    return Section((_errors(compared), _speed(rows)))


def _errors(compared: Outcome) -> Sheet:
    rows = [
        (
            POINTS[points],
            model,
            str(row["points"]),
            *(f"{scale * row[key]:.{digits}f}" for key, scale, digits in ERRORS),
        )
        for points, models in compared.check["figures"].items()
        for model, row in models.items()
    ]
    columns = ("points", "model", "number", "cl mean", "cl max", "cd mean %", "cd max %")
    note = (
        "NACA 4412 against XFOIL on whole polars that training did not see, Mach 0, attached range. NeuralFoil serves any "
        "section, this surrogate one."
    )
    return Sheet("Airfoil polars, errors", columns, tuple(rows), (note,))


def _speed(rows: list[tuple[str, str, str]]) -> Sheet:
    note = f"Batches of {BATCH:,}; 'in the comparison': wall time of the quickest batch, all models in one process."
    return Sheet("Airfoil polars, speed", ("model", "evaluations per second", "peak MB"), tuple(rows), (note,))
