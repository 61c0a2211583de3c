"""Kinds of files that commands read: where a sound one is, how it is damaged, and what reads it (scripts/robustness.py)."""

import gzip
import importlib.util
import json
import random
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import resources
from math import cos, pi, sin
from pathlib import Path
from typing import Any

import mutations

ROOT = Path(__file__).parents[1]
REFERENCE = ROOT / "tests" / "reference"
SECONDS = 10.0
CASES = {
    "rotor": "bem_lift_rotor_axial",
    "wing": "vlm_rect_ar8_flat",
    "noise": "noise_tonal_hover",
    "motor": "motor_dq",
    "battery": "battery_thevenin",
    "structures": "structures_frame_L",
}
CONDITIONS = {
    "rotor": ("V_m_per_s", "rpm", "hub_loss"),
    "noise": ("elevation_from_disk_plane_deg",),
    "motor": ("torque_em_N_m", "speed_rpm"),
}
F06 = """
                      OBJECTIVE AND MAXIMUM CONSTRAINT HISTORY
    CYCLE     OBJECTIVE FROM     OBJECTIVE FROM     FRACTIONAL ERROR     MAXIMUM VALUE
    NUMBER    APPROXIMATION      EXACT ANALYSIS     OF APPROXIMATION     OF CONSTRAINT
    INITIAL                       4.303000E+02                            3.426000E-01
          1    4.100000E+02       4.110000E+02       -2.400000E-03        2.100000E-02
          2    4.090000E+02       4.090000E+02       -1.000000E-05        1.000000E-04
 RUN TERMINATED DUE TO HARD CONVERGENCE TO AN OPTIMUM
"""
SAVED_POLAR = """
       XFOIL         Version 6.99

 Calculated polar for: NACA 2412

 1 1 Reynolds number fixed          Mach number fixed

 xtrf =   1.000 (top)        1.000 (bottom)
 Mach =   0.000     Re =     1.000 e 6     Ncrit =   9.000

   alpha    CL        CD       CDp       CM     Top_Xtr  Bot_Xtr
  ------ -------- --------- --------- -------- -------- --------
  -2.000   0.0150   0.00592   0.00115  -0.0560   0.6510   0.4210
   0.000   0.2371   0.00564   0.00120  -0.0525   0.4450   0.9980
   4.000   0.7146   0.00693   0.00210  -0.0540   0.2110   1.0000
"""


@dataclass(frozen=True)
class Kind:
    """Files of one kind: where a sound set of files is, the one that is damaged, and how it is read.

    stop: "module.attribute" whose call means that all is read. weight: share of the inputs. seconds: of processor time, four
    times what the sound file takes where that is more than two. needs: package that reads it, torch unless another is named.
    """

    name: str
    base: Path
    victim: str
    mutate: Callable[[str, random.Random], mutations.Mutation]
    command: str
    stop: str | None = None
    weight: float = 1.0
    seconds: float = SECONDS
    needs: str = "torch"

    @property
    def is_readable_here(self) -> bool:
        """Whether this interpreter has what reads it."""
        return importlib.util.find_spec(self.needs) is not None


def kinds(base: Path) -> list[Kind]:
    """All kinds, in the order of the table; `base` holds their sound files."""
    return [*_written_by_people(base), *_cases(base), *_stored(base), *_other_programs(base)]


def _written_by_people(base: Path) -> list[Kind]:
    configuration = "lpc_mdo.studies.runs.write_configuration"
    structure = "optimize --set vehicle.structure.source=open --set vehicle.structure.surrogate_file=structure.json"
    return [
        Kind("vehicle", base / "files", "vehicle.toml", mutations.of_toml, "optimize vehicle.toml --quiet --output out",
             configuration, 5.0),
        Kind("mission", base / "files", "mission.toml", mutations.of_toml, "optimize --mission mission.toml --output out",
             configuration, 3.0),
        Kind("envelope mission", base / "files", "envelope.toml", mutations.of_toml,
             "optimize --problem full-envelope --mission envelope.toml --output out", configuration, 2.0),
        Kind("problem", base / "files", "problem.toml", mutations.of_toml, "optimize --problem problem.toml --output out",
             configuration, 2.0),
        Kind("start", base / "hover", "result.json", mutations.of_json,
             "optimize --problem aeroacoustic --start result.json --output out", configuration, 1.0),
        Kind("checkpoint", base / "checkpoint", "out/checkpoint.json", mutations.of_json,
             "optimize --resume --quiet --output out", configuration, 2.0),
        Kind("coordinates", base / "files", "section.dat", mutations.of_text,
             "train airfoil --airfoil section.dat --generate --output out", "lpc_mdo.training.airfoil_command.generate", 2.0),
        Kind("polar table", base / "files", "polars.csv", mutations.of_csv,
             "train airfoil --data polars.csv --output out", "lpc_mdo.training.airfoil_command.train", 2.0),
        Kind("saved polar", base / "files", "saved.txt", mutations.of_text,
             "train airfoil --airfoil 2412 --data saved.txt --output out", "lpc_mdo.training.airfoil_command.train", 1.0),
        Kind("sample table", base / "files", "samples.csv", mutations.of_csv,
             "train structures --data samples.csv --output out", "lpc_mdo.training.structures_command.train", 2.0),
        Kind("airfoil card", base / "card", "card.json", mutations.of_json, "analyze airfoil case.json", None, 1.0),
        Kind("structural card", base / "card", "structure.json", mutations.of_json, f"{structure} --output out",
             configuration, 1.0),
    ]  # fmt: skip


def _cases(base: Path) -> list[Kind]:
    return [
        Kind(
            f"case {name}", base / "cases", f"{name}.json", mutations.of_json, f"analyze {name} {name}.json", None, 2.0
        )
        for name in ("airfoil", *CASES)
    ]


def _stored(base: Path) -> list[Kind]:
    run, hover, study = base / "run", base / "hover", base / "study"
    found = []
    for folder, name in ((hover, "report"), (run, "report of an aircraft")):
        weight = 1.0 if folder == hover else 0.3
        for victim in ("result.json", "analysis.json", "configuration.json", "history.csv", "evaluations.csv"):
            mutate = mutations.of_json if victim.endswith("json") else mutations.of_csv
            seconds = SECONDS if folder == hover else 4.0 * SECONDS
            found.append(Kind(f"{name}: {victim}", folder, victim, mutate, "report .", None, weight, seconds))
    point = "points/00_0"
    resume = "pareto noise-efficiency --points 2 --resume --quiet --output ."
    for victim in ("study.json", f"{point}/result.json"):
        found.append(Kind(f"report of a study: {victim}", study, victim, mutations.of_json, "report .", None, 1.0))
    for victim in ("study.json", f"{point}/point.json", f"{point}/result.json"):
        stop = "lpc_mdo.studies.runner.StudyRun._execute"
        found.append(Kind(f"resumed study: {victim}", study, victim, mutations.of_json, resume, stop, 1.0))
    for victim in ("result.json", "analysis.json", "configuration.json"):
        command, stop = "sensitivities . --verify", "lpc_mdo.studies.sensitivities.check"
        found.append(Kind(f"sensitivities: {victim}", run, victim, mutations.of_json, command, stop, 0.7))
    for victim in ("result.json", "configuration.json"):
        command, stop = "export geometry result.json --format stl --output out", "lpc_mdo.interop.shape_files._write"
        found.append(Kind(f"export: {victim}", run, victim, mutations.of_json, command, stop, 0.7))
    return found


def _other_programs(base: Path) -> list[Kind]:
    """Each needs a package that the others do without, or cannot stand beside."""
    decks = "nastran decks decks/design.csv"
    found = [
        Kind(f"NASTRAN: {name}", base / "decks", f"decks/{name}", mutate, decks, None, 1.0, SECONDS, "pyNastran")
        for name, mutate in (
            ("baseline_000.bdf", mutations.of_text),
            ("baseline_000.f06", mutations.of_text),
            ("design.csv", mutations.of_csv),
        )
    ]
    found += [
        Kind(f"STEP: {name}", base / "step", name, mutations.of_text, f"step {name}", None, 0.5, SECONDS, "OCP")
        for name in ("torus.step", "frustum.step")
    ]
    return found


def shares(found: Sequence[Kind], count: int) -> list[int]:
    """Inputs of each kind, at least one."""
    total = sum(kind.weight for kind in found)
    return [max(1, round(count * kind.weight / total)) for kind in found]


def make_base(base: Path, run_command: Callable[[Sequence[str]], int], run: Path | None = None) -> None:
    """Sound files of every kind, by the commands that write them; kept for the next call. Needs torch once.

    run: the folder of a finished optimization that is copied in place of a new one.
    """
    if (base / "done").exists():
        return
    shutil.rmtree(base, ignore_errors=True)
    for name in ("files", "cases", "card", "step"):
        (base / name).mkdir(parents=True)
    for name in ("vehicle.toml", "mission.toml"):
        text = resources.files("lpc_mdo.data").joinpath(name).read_text(encoding="utf-8")
        (base / "files" / name).write_text(text, encoding="utf-8")
    (base / "files" / "envelope.toml").write_bytes(
        resources.files("lpc_mdo.data").joinpath("full_envelope.toml").read_bytes()
    )
    shutil.copy(ROOT / "docs" / "examples" / "least_power.toml", base / "files" / "problem.toml")
    _write_tables(base / "files")
    for name, file in CASES.items():
        (base / "cases" / f"{name}.json").write_text(json.dumps(_read_part(name, file), indent=1))
    _write_cards(base)
    for name in ("torus.step", "frustum.step"):
        shutil.copy(ROOT / "tests" / "faults" / name, base / "step" / name)
    if run:
        shutil.copytree(run, base / "run")
    for arguments in (
        *([] if run else [["optimize", "--quiet", "--solver", "sqp", "--output", str(base / "run")]]),
        ["optimize", "--quiet", "--problem", "aeroacoustic", "--output", str(base / "hover")],
        ["pareto", "noise-efficiency", "--points", "2", "--quiet", "--output", str(base / "study")],
        ["optimize", "--quiet", "--time-limit", "2", "--output", str(base / "checkpoint" / "out")],
        ["export", "nastran", "--output", str(base / "decks" / "decks")],
    ):
        print(f"making files: lpc-mdo {' '.join(arguments)}", flush=True)
        run_command(arguments)
    (base / "decks" / "decks" / "baseline_000.f06").write_text(F06)
    for folder in ("run", "hover"):
        shutil.rmtree(base / folder / "figures")
        (base / folder / "report.html").unlink()
    for file in (base / "checkpoint" / "out").iterdir():
        if file.name != "checkpoint.json":
            shutil.rmtree(file) if file.is_dir() else file.unlink()
    (base / "done").touch()


def _read_part(name: str, file: str) -> dict[str, Any]:
    """What `analyze` reads of a reference case: damage to other codes' figures, which are passed over, would show nothing."""
    content = json.loads((REFERENCE / f"{file}.json").read_text(encoding="utf-8"))
    if name == "structures":
        keys = ("points", "segments", "section", "E", "density_for_mass", "loads", "fixed_points")
        return {"inputs": {key: content[key] for key in keys} | {"nu": 0.33}}
    case = {"inputs": content["inputs"]}
    if conditions := CONDITIONS.get(name):
        case["conditions"] = [{k: row[k] for k in conditions if k in row} for row in content["results"]]
    return case


def _write_cards(base: Path) -> None:
    section = '{"inputs": {"airfoil": %s, "alpha_deg": [0.0, 5.0], "reynolds": [1e6, 2e6], "mach": 0.1}}'
    (base / "cases" / "airfoil.json").write_text(section % '"naca4412"')
    (base / "card" / "case.json").write_text(section % '"card.json"')
    weights = resources.files("lpc_mdo.surrogates.weights")
    for name, source in (("card", "naca4412"), ("structure", "structural_mass_open")):
        for ending in ("json", "safetensors"):
            (base / "card" / f"{name}.{ending}").write_bytes(weights.joinpath(f"{source}.{ending}").read_bytes())


def _write_tables(folder: Path) -> None:
    data = ROOT / "training" / "data"
    for name, source, rows in (("polars", "naca4412", 400), ("samples", "structures_open", 300)):
        lines = gzip.decompress((data / f"{source}.csv.gz").read_bytes()).decode().splitlines()[: rows + 1]
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n")
    (folder / "saved.txt").write_text(SAVED_POLAR)
    points = [f"{0.5 * (1 + x):.5f} {y:.5f}" for x, y in _ellipse()]
    (folder / "section.dat").write_text("ellipse\n" + "\n".join(points) + "\n")


def _ellipse() -> list[tuple[float, float]]:
    return [(cos(2 * pi * k / 80), 0.06 * sin(2 * pi * k / 80) * (1 - cos(2 * pi * k / 80) ** 8)) for k in range(81)]
