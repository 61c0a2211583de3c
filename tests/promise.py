"""What a function of the library promises, and the smallest inputs to hold it to that."""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class Promise:
    """A function of tensors (...,) or (..., k), and three examples of each, one a row."""

    function: Callable[..., Tensor]
    examples: tuple[list, ...]
    single: float = 1e-4  # relative tolerance in single precision

    def inputs(self, dtype: torch.dtype = torch.float64) -> tuple[Tensor, ...]:
        return tuple(torch.tensor(example, dtype=dtype) for example in self.examples)
