"""What is asked of a model outside its regime: stated in results, tables and reports instead of passing silently."""

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Flag:
    """One figure outside a model's regime.

    what: short name, the same for every flag of a kind; where: rotor, segment or part, empty where there is but one;
    value and limit: of the quantity that says so, in its unit; message: one sentence for people.
    """

    what: str
    where: str
    value: float | None
    limit: float | None
    message: str

    def content(self) -> dict[str, Any]:
        """As result files hold it."""
        return asdict(self)
