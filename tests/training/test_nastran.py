"""Decks for NASTRAN and the way back, read by pyNastran in its own environment (numpy < 2)."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import torch

from lpc_mdo.structures.pieces import join
from lpc_mdo.structures.samples import COMPONENTS, INPUTS, read_samples
from lpc_mdo.structures.shipped import BASELINE, structural_inputs
from lpc_mdo.structures.sizing import GAUGES, SizingModel, mass_properties
from lpc_mdo.training.nastran import card, deck
from lpc_mdo.training.nastran_files import bulk_text, read_run

ROOT = Path(__file__).parents[2]
PYTHON = Path(os.environ.get("LPC_MDO_NASTRAN_PYTHON", ROOT / ".venv-nastran" / "bin" / "python"))
needs_pynastran = pytest.mark.skipif(
    not PYTHON.is_file(), reason=f"no interpreter with pyNastran at {PYTHON} (see docs/structures.md)"
)
F06 = """
                      OBJECTIVE AND MAXIMUM CONSTRAINT HISTORY
    CYCLE     OBJECTIVE FROM     OBJECTIVE FROM     FRACTIONAL ERROR     MAXIMUM VALUE
    NUMBER    APPROXIMATION      EXACT ANALYSIS     OF APPROXIMATION     OF CONSTRAINT
    INITIAL                       4.303000E+02                            3.426000E-01
          1    4.100000E+02       4.110000E+02       -2.400000E-03        2.100000E-02
          2    4.090000E+02       4.090000E+02       -1.000000E-05        {violation}
 RUN TERMINATED DUE TO {kind} CONVERGENCE TO AN OPTIMUM
"""


@pytest.fixture(scope="module")
def model():
    return SizingModel()


@pytest.fixture(scope="module")
def designs(model):
    """Two samples: inputs (sample, 7) and logarithms of gauges (sample, variable), all different."""
    rng = np.random.default_rng(4)
    inputs = np.array(BASELINE) * (1.0 + 0.1 * rng.uniform(-1.0, 1.0, (2, 7)))
    return inputs, model.start() + 0.4 * torch.from_numpy(rng.uniform(-1.0, 1.0, (2, sum(GAUGES.values()))))


def run(*arguments, folder):
    environment = {"PYTHONPATH": str(ROOT), "PATH": os.environ["PATH"], "MPLBACKEND": "agg", "HOME": str(folder)}
    return subprocess.run(
        [PYTHON, *map(str, arguments)], cwd=folder, env=environment, capture_output=True, text=True, timeout=120
    )


def one(inputs, i):
    return structural_inputs(inputs[i])


@pytest.mark.parametrize("solution", [101, 200])
def test_fields_keep_their_columns(model, designs, solution):
    text = deck(model, one(designs[0], 0), designs[1][0], solution)
    for line in text.split("BEGIN BULK")[1].splitlines():
        assert len(line) <= 72, line
        if line.startswith(("GRID*", "CBAR*", "*")):
            for k in range(8, len(line), 16):
                assert " " not in line[k : k + 16].strip(), line
    assert text.startswith(f"SOL {solution}")
    assert text.endswith("ENDDATA\n")


def test_numbers_keep_ten_digits():
    assert card("GRID", 1, None, -1.0 / 3.0).split()[2] == "-3.333333333E-01"


def test_other_solutions_and_batches_are_refused(model, designs):
    with pytest.raises(ValueError, match="solution = 103 is not allowed; it must be 101 or 200"):
        deck(model, one(designs[0], 0), designs[1][0], 103)
    with pytest.raises(ValueError, match="a deck holds one sample"):
        deck(model, structural_inputs(designs[0]), designs[1], 101)


@pytest.fixture(scope="module")
def ingested(model, designs, tmp_path_factory):
    """Both samples as finished runs, a third without a run, a fourth that did not converge; the table made of them."""
    folder = tmp_path_factory.mktemp("runs")
    inputs, x = designs
    for i, (name, solution) in enumerate((("a", 101), ("b", 200))):
        (folder / f"{name}.bdf").write_text(deck(model, one(inputs, i), x[i], solution))
    bulk = (folder / "b.bdf").read_text().split("BEGIN BULK\n")[1]
    (folder / "b.pch").write_text(bulk)  # as NASTRAN punches it: bulk data alone
    (folder / "b.bdf").unlink()
    (folder / "d.pch").write_text(bulk)
    for name, kind, violation in (("a", "HARD", "1.0E-04"), ("b", "SOFT", "-2.0E-03"), ("d", "HARD", "2.0E-01")):
        (folder / f"{name}.f06").write_text(F06.format(kind=kind, violation=violation))
    rows = [",".join(["sample_id", *INPUTS])]
    rows += [",".join([name, *(f"{v:.12g}" for v in inputs[i])]) for name, i in zip("abcd", (0, 1, 1, 1), strict=True)]
    (folder / "design.csv").write_text("\n".join(rows) + "\n")
    outcome = run(
        "-m", "lpc_mdo.training.nastran_ingest", folder, folder / "design.csv", folder / "out.csv", folder=folder
    )
    assert outcome.returncode == 0, outcome.stderr
    return read_samples(folder / "out.csv")[0], outcome.stdout


@needs_pynastran
def test_masses_come_back_as_they_were_written(model, designs, ingested):
    """Ten printed digits; inertia about the centre of gravity is a difference of larger numbers."""
    samples, _ = ingested
    inputs, x = designs
    for i in range(2):
        assert samples.inputs[i] == pytest.approx(inputs[i], rel=1e-11)
        bodies = mass_properties(model.frames(one(inputs, i), x[i]).pieces)
        for j, component in enumerate(COMPONENTS):
            ours, theirs = bodies[component], samples.targets[i, j]
            assert theirs[0] == pytest.approx(float(ours.mass), rel=1e-8), component
            assert theirs[1:4] == pytest.approx(ours.center_of_gravity.numpy(), abs=1e-7), component
            tensor = ours.inertia
            products = [-tensor[0, 1], -tensor[0, 2], -tensor[1, 2]]
            expected = [*tensor.diagonal().tolist(), *(float(p) for p in products)]
            assert theirs[4:] == pytest.approx(expected, rel=1e-6, abs=1e-6), component


@needs_pynastran
def test_runs_count_only_if_converged_with_constraints_satisfied(ingested):
    samples, notes = ingested
    assert samples.ids == ("a", "b", "d")
    assert samples.statuses == ("converged", "soft", "failed")
    assert samples.violation.tolist() == pytest.approx([1e-4, 0.0, 0.2])
    assert samples.cycles.tolist() == [2, 2, 2]
    assert "c: there must be c.pch or c.bdf in" in notes
    assert "d: constraints violated by 0.2" in notes


WEIGH = """
import sys
import numpy as np
from pyNastran.op2.op2 import OP2
from pyNastran.op2.result_objects.grid_point_weight import GridPointWeight
mass, x, y, z = map(float, sys.argv[2:])
model = OP2(debug=False, log=None)
model.is_nx, model.is_msc, model.is_optistruct, model.date = True, False, False, (1, 1, 26)
center = np.array([[0.0, y, z], [x, 0.0, z], [x, y, 0.0]])
model.grid_point_weight[""] = GridPointWeight(
    0, np.eye(6), np.eye(3), np.full(3, mass), center, np.eye(3), np.ones(3), np.eye(3))
model.write_op2(sys.argv[1], post=-1, nastran_format="nx")
"""


@needs_pynastran
@pytest.mark.parametrize(("factor", "status"), [(1.0, "converged"), (1.01, "failed")])
def test_weights_that_nastran_found_must_be_those_of_the_bulk_data(model, designs, tmp_path, factor, status):
    inputs, x = one(designs[0], 0), designs[1][0]
    pieces = join(*model.frames(inputs, x).pieces.values()).total()
    place = [f"{v:.12g}" for v in (factor * float(pieces.mass), *pieces.center_of_gravity.tolist())]
    written = run("-c", WEIGH, tmp_path / "a.op2", *place, folder=tmp_path)
    assert written.returncode == 0, written.stderr
    (tmp_path / "a.bdf").write_text(deck(model, inputs, x, 101))
    (tmp_path / "a.f06").write_text(F06.format(kind="HARD", violation="0.0E+00"))
    (tmp_path / "design.csv").write_text(",".join(["sample_id", *INPUTS]) + "\na" + ",1" * 7 + "\n")
    run(
        "-m",
        "lpc_mdo.training.nastran_ingest",
        tmp_path,
        tmp_path / "design.csv",
        tmp_path / "out.csv",
        folder=tmp_path,
    )
    assert read_samples(tmp_path / "out.csv")[0].statuses == (status,)


RELATIONS = """
import json, sys
from pyNastran.bdf.bdf import BDF
model = BDF(debug=False, log=None)
model.read_bdf(sys.argv[1], xref=True)
value = {number: variable.xinit for number, variable in model.desvars.items()}
names = {"A": "A", "I1": "i1", "I2": "i2", "J": "j"}
errors = []
for relation in model.dvprels.values():
    number, name = relation.pid_ref.pid, relation.pname_fid
    truth = getattr(relation.pid_ref, names[name])
    if relation.type == "DVPREL1":
        mapped = relation.c0 + sum(c * value[d] for c, d in zip(relation.coeffs, relation.dvids))
    else:
        equation = relation.dequation_ref
        mapped = equation.func(*[value[d] for d in relation.dvids])
    errors.append(abs(mapped / truth - 1.0))
print(json.dumps({
    "variables": len(value), "relations": len(errors), "error": max(errors), "responses": sorted(model.dresps),
    "subcases": len([n for n in model.subcases if n]), "solution": model.sol,
    "cases": sorted({load.type for loads in model.loads.values() for load in loads}), "load sets": len(model.loads),
}))
"""


@needs_pynastran
def test_design_model_is_complete_and_maps_the_gauges_to_the_properties(model, designs, tmp_path):
    """pyNastran resolves every reference; every property of every bar follows from the design variables."""
    (tmp_path / "deck.bdf").write_text(deck(model, one(designs[0], 0), designs[1][0], 200))
    outcome = run("-c", RELATIONS, tmp_path / "deck.bdf", folder=tmp_path)
    assert outcome.returncode == 0, outcome.stderr
    found = json.loads(outcome.stdout)
    assert found["solution"] == 200
    assert found["variables"] == sum(GAUGES.values())
    assert found["relations"] == 4 * (11 + 8 + 8 + 4 + 4)
    assert found["error"] < 1e-7
    assert found["responses"] == [1, 2, 3, 4, 5, 10, 11]
    assert found["subcases"] == found["load sets"] == 11 + 7 + 2
    assert found["cases"] == ["FORCE", "MOMENT"]


CYCLE = """
 CONVERGENCE NOT ACHIEVED YET   (HARD CONVERGENCE DECISION LOGIC)
                                (SOFT CONVERGENCE DECISION LOGIC)
"""
ENDED_BY_CYCLES = " RUN TERMINATED DUE TO MAXIMUM NUMBER OF DESIGN CYCLES =    2.\n"


@pytest.mark.parametrize(
    ("end", "status", "reason"),
    [
        (CYCLE + F06, "converged", ""),
        (CYCLE + F06.replace(" RUN", " * USER INFORMATION MESSAGE 6464 *\n RUN"), "converged", ""),
        (F06.replace("RUN TERMINATED DUE TO {kind} CONVERGENCE", "({kind} CONVERGENCE ACHIEVED)"), "converged", ""),
        (CYCLE + F06.partition(" RUN")[0] + ENDED_BY_CYCLES, "failed", "ended by maximum number of design cycles"),
        (ENDED_BY_CYCLES + CYCLE + F06.partition(" RUN")[0], "failed", "ended by maximum number of design cycles"),
        (CYCLE + F06.partition(" RUN")[0], "failed", "nothing says that it converged"),
        (F06 + " *** USER FATAL MESSAGE 9050 (SEKRRS)\n", "failed", "a fatal message"),
        (F06.replace("{violation}", "2.000000E-01"), "failed", "constraints violated by 0.2"),
        ("", "failed", "nothing says that it converged"),
        (F06.rpartition("\n")[0].rpartition("\n")[2], "failed", "no history of the largest constraint"),
    ],
)
def test_a_run_counts_where_nastran_says_that_it_ended_by_convergence(tmp_path, end, status, reason):
    file = tmp_path / "a.f06"
    file.write_text(end.format(kind="HARD", violation="1.000000E-04"))
    found = read_run(file)
    assert found.status == status
    assert reason in found.reason


def test_included_files_stay_in_the_folder_of_the_runs(tmp_path):
    runs, secret = tmp_path / "runs", tmp_path / "secret.bdf"
    (runs / "parts").mkdir(parents=True)
    secret.write_text("GRID,1\n")
    (runs / "parts" / "b.bdf").write_text("include '../c.bdf'\nGRID,2\n")
    (runs / "c.bdf").write_text("GRID,3\n")
    (runs / "link.bdf").symlink_to(secret)
    deck = runs / "a.bdf"
    deck.write_text("BEGIN BULK\nINCLUDE 'parts/\nb.bdf'\nInclude c.bdf $ again\nENDDATA\n")
    assert bulk_text(deck, runs).split("\n") == ["BEGIN BULK", "GRID,3", "GRID,2", "GRID,3", "ENDDATA"]
    for name in (str(secret), "../secret.bdf", "/etc/passwd", "link.bdf", "parts/../../secret.bdf"):
        deck.write_text(f"BEGIN BULK\n INCLUDE '{name}'\n")
        with pytest.raises(ValueError, match=r"INCLUDE .* is invalid: it must lie in"):
            bulk_text(deck, runs)
    for text, message in (
        ("INCLUDE 'none.bdf'", "there is no such file"),
        ("INCLUDE 'open", "its quote must close"),
        ("INCLUDE 'a.bdf'", "more than 8 nested"),
    ):
        deck.write_text(text + "\n" * 20)
        with pytest.raises(ValueError, match=message):
            bulk_text(deck, runs)


@pytest.fixture
def finished(model, designs, tmp_path):
    """Two finished runs, `good` and `bad`, with their table; what turns the deck of `bad` is the test's. Returns a call
    that ingests them."""
    inputs, x = designs
    text = deck(model, one(inputs, 0), x[0], 101)
    rows = [",".join(["sample_id", *INPUTS])] + [",".join([name, *("1.5",) * 7]) for name in ("bad", "good")]
    (tmp_path / "design.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "good.bdf").write_text(text)
    for name in ("good", "bad"):
        (tmp_path / f"{name}.f06").write_text(F06.format(kind="HARD", violation="0.0E+00"))

    def ingest(changed: bytes):
        (tmp_path / "bad.bdf").write_bytes(changed)
        return run(
            "-m",
            "lpc_mdo.training.nastran_ingest",
            tmp_path,
            tmp_path / "design.csv",
            tmp_path / "out.csv",
            folder=tmp_path,
        )

    return text, tmp_path, ingest


@needs_pynastran
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("ENDDATA", f"{card('PBAR', 1000, 1, 2.0, 3.0, 3.0, 1.0)}\nENDDATA"), "PBAR"),
        (lambda text: text.replace("ENDDATA", f"{card('QUIBBLE', 1, 2.0)}\nENDDATA"), "QUIBBLE"),
        (lambda text: text.replace("ENDDATA", "INCLUDE '/etc/passwd'\nENDDATA"), "it must lie in"),
        (lambda text: text[: len(text) // 2], "ENDDATA is missing: the deck must be whole"),
        (lambda text: text[: text.rindex("CONM2")], "ENDDATA is missing: the deck must be whole"),
        (lambda text: text.replace("E+0", "E+x"), "bad.bdf"),
        (lambda text: text.replace("CBAR*", "CBAD*"), "bad.bdf"),
        (lambda text: text.replace("MAT1*   " + " " * 15 + "1", "MAT1*   " + " " * 15 + "7"), "bad.bdf"),
        (lambda text: "", "bad.bdf"),
        (lambda text: "\x00\xff" * 4000, "bad.bdf"),
    ],
    ids=[
        "property twice",
        "unknown card",
        "include",
        "cut off",
        "masses cut off",
        "no numbers",
        "no bars",
        "no material",
        "empty",
        "binary",
    ],
)
def test_a_damaged_sample_is_left_out_by_name_and_the_others_go_on(finished, change, words):
    text, folder, ingest = finished
    outcome = ingest(change(text).encode("latin-1"))
    assert (outcome.returncode, outcome.stderr) == (0, "")
    assert read_samples(folder / "out.csv")[0].ids == ("good",)
    first, last = outcome.stdout.splitlines()
    assert first.startswith("bad left out: bad.bdf")
    assert words in first
    assert any(rule in first for rule in ("invalid", "must", "cannot be read"))
    assert "1 samples, 0 of them failed" in last


@needs_pynastran
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sample_id\n", "column 'wing_area_m2' is missing"),
        ((ROOT / "tests" / "faults" / "samples_decimal_comma.csv").read_text(), "decimal commas need semicolons"),
        (",".join(["sample_id", *INPUTS]) + "\na,1,1,1,1,1,1,-1\n", "vtail_area_m2 = '-1' is invalid"),
        (",".join(["sample_id", *INPUTS]) + "\na,1,1,1,1,1,1,x\n", "vtail_area_m2 = 'x' is invalid"),
        (",".join(["sample_id", *INPUTS]) + "\n../a" + ",1" * 7 + "\n", "it must be the name of files"),
        (",".join(["sample_id", *INPUTS]) + ("\na" + ",1" * 7) * 2 + "\n", "and stand once"),
        (",".join(["sample_id", *INPUTS]) + "\n" + "x" * 500 + ",1" * 7 + "\n", "it must be the name of files"),
        (",".join(["sample_id", *INPUTS]) + "\n", "it must hold a line for each"),
    ],
)
def test_a_damaged_table_of_designs_is_refused_in_one_line(tmp_path, text, words):
    (tmp_path / "design.csv").write_text(text)
    outcome = run(
        "-m",
        "lpc_mdo.training.nastran_ingest",
        tmp_path,
        tmp_path / "design.csv",
        tmp_path / "out.csv",
        folder=tmp_path,
    )
    assert (outcome.returncode, outcome.stderr.count("\n")) == (2, 1)
    assert words in outcome.stderr
    assert len(outcome.stderr) < 400
    assert not (tmp_path / "out.csv").exists()


@needs_pynastran
def test_a_model_whose_masses_belong_to_no_component_is_refused(model, designs, tmp_path):
    text = deck(model, one(designs[0], 0), designs[1][0], 101)
    extra = card("CONM2", 9000, 1000, 0, 5.0)
    (tmp_path / "a.bdf").write_text(text.replace("ENDDATA", f"{extra}\nENDDATA"))
    (tmp_path / "design.csv").write_text(",".join(["sample_id", *INPUTS]) + "\na" + ",1" * 7 + "\n")
    outcome = run(
        "-m",
        "lpc_mdo.training.nastran_ingest",
        tmp_path,
        tmp_path / "design.csv",
        tmp_path / "out.csv",
        folder=tmp_path,
    )
    assert outcome.returncode == 2
    assert "a.bdf: CONM2 9000 of number 9000 belongs to no component" in outcome.stderr
    assert not (tmp_path / "out.csv").exists()
