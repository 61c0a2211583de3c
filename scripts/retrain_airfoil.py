"""From polars of a section to an aircraft that flies it: train its surrogate, then optimize with it.

    python scripts/retrain_airfoil.py                                  # the shipped polars of NACA 4412 again
    python scripts/retrain_airfoil.py my_section.dat                   # coordinates: XFOIL first
    python scripts/retrain_airfoil.py 2412 --data polars/              # polars that XFOIL saved, or a table

`--for wing` takes its maximum lift from the new polar instead of giving it to every rotor.
"""

import argparse
from pathlib import Path

import lpc_mdo
from lpc_mdo.optimization import Options
from lpc_mdo.training.airfoil_command import AirfoilRequest, train_airfoil


def flying(vehicle: lpc_mdo.Vehicle, card: str, part: str) -> lpc_mdo.Vehicle:
    """The vehicle with a trained polar on all its rotors, or on its wing."""
    if part == "wing":
        return vehicle.model_copy(update={"wing": vehicle.wing.model_copy(update={"polar": card})})
    rotors = tuple(rotor.model_copy(update={"airfoil": ((card, 1.0),)}) for rotor in vehicle.rotors)
    return vehicle.model_copy(update={"rotors": rotors})


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("airfoil", nargs="?", default="naca4412", help="designation or coordinate file")
    parser.add_argument("--data", type=Path, help="polars to learn; default: the shipped ones, or XFOIL's")
    parser.add_argument("--for", dest="part", choices=["rotors", "wing"], default="rotors", help="who flies it")
    parser.add_argument(
        "--output", type=Path, default=Path("runs/retrained_airfoil"), help="folder of weights and card"
    )
    parser.add_argument("--vehicle", help="vehicle file; default: the shipped one")
    parser.add_argument("--jobs", type=int, default=2, help="XFOIL runs at a time; default: 2")
    parser.add_argument("--time-limit", type=float, default=float("inf"), metavar="S", help="of the optimization")
    asked = parser.parse_args()

    try:
        options = Options(time_limit=asked.time_limit)
        vehicle, mission = lpc_mdo.load(asked.vehicle)
        card = train_airfoil(AirfoilRequest(asked.airfoil, asked.data, False, asked.output, asked.jobs, seed=0))
        problem = lpc_mdo.gross_weight_problem(flying(vehicle, str(card.resolve()), asked.part), mission)
    except (ValueError, OSError) as error:  # a file that cannot be used, in one sentence
        parser.error(str(error))

    result = lpc_mdo.optimize(problem, options=options)
    print(f"{result.status}: {result.message}")
    print(f"gross mass with {card}: {result.outputs['gross_mass_kg']:.2f} kg")
    return 0 if result.is_converged else 1


if __name__ == "__main__":
    raise SystemExit(main())
