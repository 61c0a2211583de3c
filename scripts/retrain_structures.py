"""From sized structures to an aircraft that is weighed by them: train the surrogate of structural mass, then optimize with it.

python scripts/retrain_structures.py                       # the shipped samples again
python scripts/retrain_structures.py --data samples.csv    # your own, or what training.nastran_ingest wrote
"""

import argparse
import json
from pathlib import Path

import lpc_mdo
from lpc_mdo.optimization import Options
from lpc_mdo.training.structures_command import StructuresRequest, train_structures


def settings(card: Path) -> list[str]:
    """KEY=VALUE that weigh the aircraft by a trained surrogate."""
    source = json.loads(card.read_text(encoding="utf-8"))["name"]
    file = json.dumps(str(card.resolve()))
    return [f'vehicle.structure.source="{source}"', f"vehicle.structure.surrogate_file={file}"]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="table of samples (.csv, .csv.gz); default: the shipped ones")
    parser.add_argument(
        "--output", type=Path, default=Path("runs/retrained_structures"), help="folder of weights and card"
    )
    parser.add_argument("--vehicle", help="vehicle file; default: the shipped one")
    parser.add_argument("--time-limit", type=float, default=float("inf"), metavar="S", help="of the optimization")
    asked = parser.parse_args()

    try:
        options = Options(time_limit=asked.time_limit)
        lpc_mdo.load(asked.vehicle)
        card = train_structures(StructuresRequest(asked.data, False, 2, 0, asked.output))
        vehicle, mission = lpc_mdo.load(asked.vehicle, None, settings(card))
        problem = lpc_mdo.gross_weight_problem(vehicle, mission)
    except (ValueError, OSError) as error:  # a file that cannot be used, in one sentence
        parser.error(str(error))

    result = lpc_mdo.optimize(problem, options=options)
    print(f"{result.status}: {result.message}")
    print(f"gross mass with {card}: {result.outputs['gross_mass_kg']:.2f} kg")
    return 0 if result.is_converged else 1


if __name__ == "__main__":
    raise SystemExit(main())
