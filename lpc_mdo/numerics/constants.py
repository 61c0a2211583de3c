"""Physical constants that several disciplines share."""

GRAVITY = 9.80665  # m/s^2, standard acceleration of free fall (ISO 80000-3)
