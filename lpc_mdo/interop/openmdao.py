"""Disciplines as OpenMDAO components: tensors in, tensors out, exact partials from autograd. Extra: openmdao."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import ArrayLike
from openmdao.api import ExplicitComponent
from torch import Tensor

Function = Callable[..., Mapping[str, Tensor]]


@dataclass(frozen=True)
class Port:
    """An input or output of a component: its start value (whose shape counts) and its unit as OpenMDAO writes it."""

    value: ArrayLike
    unit: str | None = None  # none: a pure number


class DisciplineComponent(ExplicitComponent):  # type: ignore[misc]  # OpenMDAO has no annotations
    """Any function of tensors as an OpenMDAO component.

    `function` takes float64 tensors by the names of `inputs` and returns tensors by the names of `outputs`, of the
    shapes given there. Partials are exact, one backward pass for each output number; which output depends on which input
    is read off the graph at the start values. Raises ValueError in `setup` where names or shapes do not fit.
    """

    def __init__(self, function: Function, inputs: Mapping[str, Port], outputs: Mapping[str, Port], **options: Any):
        self.function, self.ports_in, self.ports_out = function, dict(inputs), dict(outputs)
        super().__init__(**options)

    def setup(self) -> None:
        for name, port in self.ports_in.items():
            self.add_input(name, val=np.asarray(port.value, dtype=float), units=port.unit)
        for name, port in self.ports_out.items():
            self.add_output(name, val=np.asarray(port.value, dtype=float), units=port.unit)
        given = {name: _tensor(port.value).requires_grad_(True) for name, port in self.ports_in.items()}
        answer = self.function(**given)
        if set(answer) != set(self.ports_out):
            raise ValueError(f"outputs {sorted(answer)} are not allowed; declared are {sorted(self.ports_out)}")
        for name, value in answer.items():
            declared = np.shape(self.ports_out[name].value)
            if tuple(value.shape) != declared:
                raise ValueError(f"{name} of shape {tuple(value.shape)} is not allowed; declared is {declared}")
            if inputs := [key for key, slope in _gradients(value.sum(), given).items() if slope is not None]:
                self.declare_partials(name, inputs)

    def compute(self, inputs: Any, outputs: Any) -> None:
        with torch.no_grad():
            answer = self.function(**{name: self._shaped(name, inputs) for name in self.ports_in})
        for name, value in answer.items():
            outputs[name] = value.numpy()

    def compute_partials(self, inputs: Any, partials: Any) -> None:
        given = {name: self._shaped(name, inputs).requires_grad_(True) for name in self.ports_in}
        for output, value in self.function(**given).items():
            rows = [_gradients(component, given) for component in value.flatten()]
            for name in given:
                slopes = [row[name] for row in rows]
                if any(slope is not None for slope in slopes):
                    nothing = torch.zeros_like(given[name])
                    filled = [nothing if slope is None else slope for slope in slopes]
                    partials[output, name] = torch.stack([slope.flatten() for slope in filled]).numpy()

    def _shaped(self, name: str, inputs: Any) -> Tensor:
        """OpenMDAO hands scalars over as arrays of one number; the function gets the declared shape."""
        return _tensor(inputs[name]).reshape(np.shape(self.ports_in[name].value))


def _tensor(value: ArrayLike) -> Tensor:
    return torch.from_numpy(np.array(value, dtype=float))


def _gradients(output: Tensor, inputs: Mapping[str, Tensor]) -> dict[str, Tensor | None]:
    """Gradient of a scalar by input; None where the graph connects nothing."""
    if not output.requires_grad:
        return dict.fromkeys(inputs)
    slopes = torch.autograd.grad(output, list(inputs.values()), retain_graph=True, allow_unused=True)
    return dict(zip(inputs, slopes, strict=True))
