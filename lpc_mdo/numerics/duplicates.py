"""Equal members of a batch, so that what is dear is done once for all of them.

Mirrored rotors are equal, and of the designs beside a point, of which a solver asks for gradients to difference, each differs
in one variable: most of its rotors and flight conditions are those of the point itself.
"""

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class DistinctRows:
    """first (distinct,): first occurrences among rows that are equal bit for bit; place (row,): each row's among them."""

    first: Tensor
    place: Tensor

    @property
    def are_all(self) -> bool:
        return len(self.first) == len(self.place)

    def of(self, rows: Tensor) -> Tensor:
        """(distinct, ...) of (row, ...)."""
        return rows if self.are_all else rows.index_select(0, self.first)

    def spread(self, distinct: Tensor) -> Tensor:
        """(row, ...) of (distinct, ...)."""
        return distinct if self.are_all else distinct.index_select(0, self.place)


def distinct_rows(*parts: Tensor) -> DistinctRows:
    """What is distinct among rows, each made of what `parts` (row, ...) have of it."""
    joined = torch.cat([part.detach().flatten(1) for part in parts], dim=-1).contiguous()
    found: dict[bytes, int] = {}
    first: list[int] = []
    place: list[int] = []
    for i, row in enumerate(joined.cpu().numpy()):
        key = row.tobytes()
        if key not in found:
            found[key] = len(first)
            first.append(i)
        place.append(found[key])
    return DistinctRows(*(torch.tensor(rows, dtype=torch.long, device=joined.device) for rows in (first, place)))
