"""What every function of the disciplines promises: gradients, leading dimensions, types, faults alone."""

import importlib
import inspect
import math
import pkgutil

import pytest
import torch
from promises_acoustics import PROMISES as ACOUSTICS
from promises_flight import PROMISES as FLIGHT
from promises_sizing import PROMISES as SIZING
from torch import Tensor
from torch.autograd import gradcheck

from lpc_mdo import disciplines

ALL = ACOUSTICS | FLIGHT | SIZING


@pytest.fixture(params=ALL)
def promise(request):
    return ALL[request.param]


def test_gradients_are_those_of_differences(promise):
    inputs = tuple(x.requires_grad_() for x in promise.inputs())
    # The step follows the size of each input: gradcheck's own is absolute.
    scales = tuple(x.detach().abs().clamp(min=1e-6) for x in inputs)
    ones = tuple(torch.ones_like(x).requires_grad_() for x in inputs)

    def of_shares(*shares: Tensor) -> Tensor:
        signs = (torch.sign(x.detach()) for x in inputs)
        return promise.function(
            *(sign * scale * share for sign, scale, share in zip(signs, scales, shares, strict=True))
        )

    assert gradcheck(of_shares, ones, eps=1e-5, atol=2e-5, rtol=2e-5, fast_mode=True)


def test_leading_dimensions_are_a_batch(promise):
    inputs = promise.inputs()
    batch = promise.function(*inputs)
    for i in range(3):
        torch.testing.assert_close(promise.function(*(x[i] for x in inputs)), batch[i], rtol=1e-9, atol=1e-11)
    twice = promise.function(*(torch.stack([x, x]) for x in inputs))
    torch.testing.assert_close(twice, torch.stack([batch, batch]), rtol=1e-9, atol=1e-11)
    assert promise.function(*(x[:0] for x in inputs)).shape == (0, *batch.shape[1:])


def test_single_precision_stays_single_and_agrees(promise):
    single, double = promise.function(*promise.inputs(torch.float32)), promise.function(*promise.inputs())
    assert single.dtype == torch.float32
    torch.testing.assert_close(single.double(), double, rtol=promise.single, atol=2e-3)


def test_a_fault_stays_in_its_element(promise):
    inputs = promise.inputs()
    whole = promise.function(*inputs)
    for faulty in range(len(inputs)):
        spoilt = [x.clone() for x in inputs]
        spoilt[faulty][1] = math.nan
        result = promise.function(*spoilt)
        # What needs the input turns into NaN, what does not keeps its value: never a third.
        is_kept = result[1] == whole[1]
        assert bool((result[1].isnan() | is_kept).all())
        torch.testing.assert_close(result[[0, 2]], whole[[0, 2]], rtol=1e-9, atol=1e-11)


def public_functions():
    """Names of all public functions of the disciplines, as defined there."""
    for module in pkgutil.iter_modules(disciplines.__path__):
        loaded = importlib.import_module(f"{disciplines.__name__}.{module.name}")
        for name, member in vars(loaded).items():
            member_of = inspect.unwrap(member) if callable(member) else None
            if inspect.isfunction(member_of) and member_of.__module__ == loaded.__name__ and not name.startswith("_"):
                yield name, member_of


# Where a public function is held to its promise: under another's name, of which it is a part, or in a test of its own.
ELSEWHERE = {
    "around": "inclined_rotor",
    "hub_loads": "inclined_rotor",
    "turn_of": "inclined_rotor",
    "forcing": "dynamic_inflow_loads",
    "blades_of": "blade_element_momentum",
    "section_flow": "blade_element_momentum",
    "filaments_of": "vortex_lattice",
    "solve_rings": "vortex_lattice",
    "require_sound_meshes": "a check without a result, test_vortex_clearance",
    "wake_passages": "names of surfaces, test_vortex_clearance",
    "lattice_of": "a mesh's topology: integers in and out, test_vortex_lattice",
    "third_octave_centers": "numbers in, test_sound",
    "require_audible": "refuses or does nothing, test_tonal_noise",
    "sphere_points": "a grid, test_noise_map",
    "ground_points": "a grid, test_noise_map",
    "hover_directivity": "a grid, test_noise_map",
    "ground_contour": "a grid, test_noise_map",
    "fly_over": "one flight heard on a grid, test_fly_over",
    "cell_energy": "a number of one cell, test_equivalent_circuit",
    "tabulated_voltage": "makes a function, test_equivalent_circuit",
    "longitudinal_levels": "whole numbers, test_dynamics",
    "lateral_levels": "whole numbers, test_dynamics",
}


def test_every_public_function_is_held_to_its_promise_and_says_what_it_does():
    promised = {name for key in ALL for name in key.split(", ")}
    functions = dict(public_functions())
    assert {name for name in functions if name not in promised} == set(ELSEWHERE)
    for name, function in functions.items():
        words = function.__doc__ or ""
        assert len(words.split()) >= 5, name
        takes_tensors = Tensor in inspect.get_annotations(function, eval_str=True).values()
        assert "(" in words or not takes_tensors or name in ELSEWHERE, f"{name} names no shapes"
        assert "Raises" in words or "raise ValueError" not in inspect.getsource(function), f"{name} names no errors"
