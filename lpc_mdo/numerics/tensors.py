"""Numbers as tensors."""

import torch
from torch import Tensor


def tensor(values: object) -> Tensor:
    """float64, of a number or nested lists of numbers."""
    return torch.tensor(values, dtype=torch.float64)
