"""Both ends of the front between noise and efficiency in hover under every acoustic convention, beside the published ones.

    python scripts/noise_conventions.py [--set KEY=VALUE ...]

Blades of the lift rotors alone, 250 ft away at 45 degrees. At noise weight 0 the level is no part of the optimization, at 1
the figure of merit is none; the published study has 0.78 at 91 dB(A) and 0.64 at 81 dB(A). Figures of merit are also shown over the
best of their model, which makes models of different profile drag comparable.
"""

import argparse

from lpc_mdo.config import ConfigurationError, load
from lpc_mdo.disciplines.hover_noise import HARMONICS
from lpc_mdo.problems.aeroacoustic import WeightedSum, aeroacoustic_problem
from lpc_mdo.studies.runs import optimize

PUBLISHED = {0.0: (0.78, 91.0), 1.0: (0.64, 81.0)}  # figure of merit and dB(A) by noise weight
KEYS = ("figure_of_merit_mean", "sound_pressure_level_dba", "sound_pressure_level_unweighted_db")


def end(convention: str, weight: float, overrides: list[str]) -> tuple[str, list[float]]:
    """Status, mean figure of merit, level by the convention and unweighted level of one end."""
    inputs = load(overrides=[*overrides, f"mission.requirements.acoustic_convention={convention}"])
    result = optimize(aeroacoustic_problem(*inputs, WeightedSum(weight)))
    return result.status, [result.outputs[key] for key in KEYS]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="as in lpc-mdo optimize")
    overrides = parser.parse_args().set
    try:
        load(overrides=overrides)
    except ConfigurationError as error:
        parser.error(str(error))
    heads = (
        "convention",
        "noise weight",
        "figure of merit",
        "over the best",
        "level, dB(A)",
        "unweighted, dB",
        "status",
    )
    print(f"| {' | '.join(heads)} |\n|{'---|' * len(heads)}")
    for weight, (merit, level) in PUBLISHED.items():
        print(f"| published | {weight:g} | {merit} | {merit / PUBLISHED[0.0][0]:.2f} | {level:g} | | |")
    for convention in HARMONICS:
        best = 1.0
        for weight in PUBLISHED:
            status, (merit, level, plain) = end(convention, weight, overrides)
            best = merit if weight == 0.0 else best
            cells = f"{merit:.3f} | {merit / best:.2f} | {level:.1f} | {plain:.1f} | {status}"
            print(f"| `{convention}` | {weight:g} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
