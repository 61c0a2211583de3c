"""The points of a stored study as a table in Markdown, and for weight against speed what more speed costs.

python scripts/study_table.py STUDY_FOLDER
"""

import argparse
from pathlib import Path

from lpc_mdo.reporting import wording
from lpc_mdo.reporting.flag_lines import study_flag_lines
from lpc_mdo.reporting.stored import read_study
from lpc_mdo.reporting.weight_parts import PARTS, weight_parts


def row(cells: list[str]) -> None:
    print("| " + " | ".join(cells) + " |")


def heading(cells: list[str]) -> None:
    row(cells)
    print("|---" * len(cells) + "|")


def quantity(name: str, unit: str) -> str:
    return wording.quantity(name) + ("" if unit == "1" else f", {unit}")


def number(value: float | None, text: str = ".5g") -> str:
    return "–" if value is None else f"{value:{text}}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="folder with study.json")
    study = read_study(parser.parse_args().folder)
    content = study.content
    parameter, axes = content["parameter"], content["axes"]
    shown = [i for i, axis in enumerate(axes) if axis["name"] != parameter["name"]]
    heads = [
        quantity(parameter["name"], parameter["unit"]),
        *(quantity(axes[i]["name"], axes[i]["unit"]) for i in shown),
    ]
    heading(
        [
            *heads,
            "slope by multipliers",
            "by points",
            "status",
            *(["on the front"] if content["kind"] == "pareto" else []),
        ]
    )
    for point in content["points"]:
        cells = [number(point["value"])]
        cells += ["–" if point["position"] is None else number(point["position"][i], ".7g") for i in shown]
        cells += [number(point["slope"][key]) for key in ("from_multipliers", "from_points")]
        cells.append(point["status"])
        row([*cells, *(["yes" if point["is_on_front"] else "no"] if content["kind"] == "pareto" else [])])
    for line in study_flag_lines(content["points"], wording.quantity(parameter["name"])):
        print(f"\nOutside the models' regime: {line.text}.")
    parts = weight_parts(study)
    if len(parts) > 1:
        slowest = parts[0]
        print()
        heading(["cruise speed, m/s", "gross mass, kg", *(f"{name}, kg" for name in PARTS)])
        row([f"{slowest.speed:.2f}", f"{slowest.total:.1f}", *(f"{slowest.parts[name]:.1f}" for name in PARTS)])
        for point in parts[1:]:
            speed, mass = (
                100.0 * (a / b - 1.0) for a, b in ((point.speed, slowest.speed), (point.total, slowest.total))
            )
            changes = (f"{point.parts[name] - slowest.parts[name]:+.1f}" for name in PARTS)
            row([f"{point.speed:.2f} ({speed:+.1f} %)", f"{point.total:.1f} ({mass:+.2f} %)", *changes])


if __name__ == "__main__":
    main()
