"""The standard atmosphere against the tables of ISO 2533."""

import torch

from lpc_mdo.disciplines.atmosphere import standard_atmosphere
from lpc_mdo.verification.comparison import Between, Comparison

ISO_2533 = (  # geopotential altitude m; temperature K, pressure Pa, density kg/m^3, speed of sound m/s
    (0.0, 288.15, 101325.0, 1.2250, 340.294),
    (1500.0, 278.40, 84556.0, 1.0581, 334.487),
    (11000.0, 216.65, 22632.0, 0.36392, 295.069),
)


def comparisons() -> list[Comparison]:
    table = torch.tensor(ISO_2533, dtype=torch.float64)
    air = standard_atmosphere(table[:, 0])
    between = Between("atmosphere", "tables of ISO 2533 at sea level, 1.5 and 11 km")
    columns = {
        "temperature, K": air.temperature,
        "pressure, Pa": air.pressure,
        "density, kg/m^3": air.density,
        "speed of sound, m/s": air.speed_of_sound,
    }
    return [
        between.relative(quantity, ours, table[:, i + 1], 5e-5, "digits of the tables")
        for i, (quantity, ours) in enumerate(columns.items())
    ]
