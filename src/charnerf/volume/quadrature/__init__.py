"""Quadrature of the volume rendering integral: what the density is taken to be between its samples."""

from charnerf.volume.quadrature.base import AbstractQuadrature
from charnerf.volume.quadrature.constant import PiecewiseConstant
from charnerf.volume.quadrature.linear import PiecewiseLinear

__all__ = ["AbstractQuadrature", "PiecewiseConstant", "PiecewiseLinear"]
