"""Promises of masses, drives, clearances, heat and cost: see `test_library_contract`."""

import torch
from promise import Promise

from lpc_mdo.disciplines.rotor_mass import RotorSize, mean_chord, rotor_mass_afdd00, rotor_mass_afdd82


def rotor_masses(radius, chord, tip_speed, blades, flap):
    size = RotorSize(radius, chord, tip_speed, blades, flap)
    laws = (rotor_mass_afdd82(size), rotor_mass_afdd00(size), rotor_mass_afdd00(size, 1.18))
    return torch.stack([part for law in laws for part in (law.blades, law.hub, law.total)], dim=-1)


PROMISES = {
    "rotor_mass_afdd82, rotor_mass_afdd00": Promise(
        rotor_masses,
        ([1.5, 1.2, 1.8], [0.15, 0.3, 0.4], [150.0, 190.0, 170.0], [2.0, 4.0, 3.0], [1.25, 1.03, 1.5]),
    ),
    "mean_chord": Promise(mean_chord, ([[0.3, 0.2], [0.4, 0.1], [0.2, 0.2]], [[1.0, 2.0], [2.0, 1.0], [0.5, 0.4]])),
}
