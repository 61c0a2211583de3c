"""From a design to everything that may be asked of it: a schedule of operating points, and the stages that evaluate them.

`schedule` expands aircraft and mission into operating points, once. The stages - flight, weights, propulsion, aerodynamics, trim,
noise, energy - each call their discipline once with all their points. `analyzer` runs them in order; `analysis` is what comes out.
"""
