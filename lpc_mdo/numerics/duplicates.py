"""Equal members of a batch, so that what is dear is done once for all of them.

Mirrored rotors are equal, and of the designs beside a point, of which a solver asks for gradients to difference, each differs
in one variable: most of its rotors and flight conditions are those of the point itself.
"""

import torch
from torch import Tensor


def distinct_rows(*parts: Tensor) -> tuple[Tensor, Tensor]:
    """First occurrences (distinct,) among rows that are equal bit for bit, and of each row (row,) the place of its equal.

    parts (row, ...): what together makes a row.
    """
    joined = torch.cat([part.detach().flatten(1) for part in parts], dim=-1).contiguous()
    found: dict[bytes, int] = {}
    first, place = [], []
    for i, row in enumerate(joined.cpu().numpy()):
        key = row.tobytes()
        if key not in found:
            found[key] = len(first)
            first.append(i)
        place.append(found[key])
    index = {"dtype": torch.long, "device": joined.device}
    return torch.tensor(first, **index), torch.tensor(place, **index)
