"""Physical constants and units that several disciplines share."""

GRAVITY = 9.80665  # m/s^2, standard acceleration of free fall (ISO 80000-3)

# Exact by definition: international yard and pound (1959); horsepower of 550 ft lbf/s.
FOOT = 0.3048  # m
POUND = 0.45359237  # kg
HORSEPOWER = 550.0 * FOOT * POUND * GRAVITY  # W
