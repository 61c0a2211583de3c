"""One row of the verification table, and where the figures of others lie."""

import json
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

REFERENCE = Path(__file__).parents[2] / "tests" / "reference"


@dataclass(frozen=True)
class Comparison:
    """A model against something that is not ours."""

    model: str
    against: str
    quantity: str
    difference: float  # relative unless the quantity says otherwise
    tolerance: float  # what the difference may be
    reason: str  # why it differs

    @property
    def is_met(self) -> bool:
        """False for a difference that is not a number, too."""
        return abs(self.difference) <= self.tolerance


@cache
def reference(name: str) -> dict[str, Any]:
    """A reference file. Raises FileNotFoundError outside a source tree, which alone holds them."""
    file = REFERENCE / f"{name}.json"
    if not file.is_file():
        raise FileNotFoundError(f"{file} is missing; comparisons with references need the source tree")
    return json.loads(file.read_text(encoding="utf-8"))
