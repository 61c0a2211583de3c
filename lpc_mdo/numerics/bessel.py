"""Bessel functions of the first kind with integer order, differentiable to any order."""

import torch
from scipy.special import jv
from torch import Tensor


class _BesselJ(torch.autograd.Function):
    """Value from SciPy; derivative from J'_n = (J_{n-1} - J_{n+1})/2, which is this function again."""

    @staticmethod
    def forward(ctx, order: Tensor, x: Tensor) -> Tensor:
        ctx.save_for_backward(order, x)
        value = jv(order.detach().cpu().numpy(), x.detach().cpu().numpy())
        return torch.as_tensor(value, dtype=x.dtype, device=x.device)

    @staticmethod
    def backward(ctx, gradient: Tensor) -> tuple[None, Tensor]:
        order, x = ctx.saved_tensors
        slope = 0.5 * (bessel_j(order - 1, x) - bessel_j(order + 1, x))
        return None, (gradient * slope).sum_to_size(x.shape)


def bessel_j(order: Tensor, x: Tensor) -> Tensor:
    """J_order(x), element by element over the broadcast shape; `order` holds integers and carries no gradient."""
    return _BesselJ.apply(order, x)
