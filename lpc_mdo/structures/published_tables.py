"""Elasticities of the published regressions at their baseline, to stand beside our own.

Derived from the three tables of coefficients in github.com/LSDOlab/CADDEE_alpha (2023, 2024) and
github.com/MariusLRuh/lift_plus_cruise_weights (2022): d ln m / d ln x. The tables are fits to different runs of sizings;
their scatter is the tolerance of any comparison.
"""

from dataclasses import dataclass

ELASTICITY_INPUTS = ("wing_area_m2", "wing_aspect_ratio", "fuselage_length_m", "battery_mass_kg", "cruise_speed_m_s")


@dataclass(frozen=True)
class PublishedFit:
    """One row of a table: mass in kg at the baseline, elasticities in the order ELASTICITY_INPUTS."""

    group: str
    year: int
    mass: float
    elasticities: tuple[float, float, float, float, float]


# Members of our components that make up a group of the tables.
GROUPS = {
    "wing": ("wing",),
    "booms": ("boom_inner_port", "boom_outer_port", "boom_inner_starboard", "boom_outer_starboard"),
    "fuselage": ("fuselage",),
}
GROUPS["wing+booms+fuselage"] = GROUPS["wing"] + GROUPS["booms"] + GROUPS["fuselage"]

PUBLISHED_FITS = (
    PublishedFit("wing", 2024, 274.589, (0.7924, 1.3919, 0.0263, -0.0947, 0.0504)),
    PublishedFit("wing", 2022, 233.847, (1.2969, 1.1850, 0.1696, 0.1384, -0.0363)),
    PublishedFit("booms", 2024, 118.053, (0.5525, 0.5554, -0.0071, 0.0013, -0.0031)),
    PublishedFit("booms", 2022, 115.508, (0.5336, 0.5769, -0.0318, -0.0117, -0.0076)),
    PublishedFit("fuselage", 2024, 329.315, (0.0602, -0.0150, 1.1828, 0.1144, 0.0120)),
    PublishedFit("fuselage", 2022, 368.163, (-0.0839, 0.1505, 1.3486, 0.0658, 0.1991)),
    PublishedFit("wing+booms+fuselage", 2023, 721.870, (0.4520, 0.6456, 0.4978, 0.0562, -0.0271)),
)
