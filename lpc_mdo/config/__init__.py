"""Vehicle and mission files: TOML with units in the keys in, validated frozen objects in SI units out."""

from lpc_mdo.config.bounds import Bound, Bounds
from lpc_mdo.config.loading import baseline, load
from lpc_mdo.config.mission import Mission, Requirements
from lpc_mdo.config.rotors import RotorSpecification
from lpc_mdo.config.surfaces import LiftingSurface, VerticalTail
from lpc_mdo.config.vehicle import Battery, Fuselage, Vehicle
from lpc_mdo.files.read import ConfigurationError

__all__ = [
    "Battery",
    "Bound",
    "Bounds",
    "ConfigurationError",
    "Fuselage",
    "LiftingSurface",
    "Mission",
    "Requirements",
    "RotorSpecification",
    "Vehicle",
    "VerticalTail",
    "baseline",
    "load",
]
