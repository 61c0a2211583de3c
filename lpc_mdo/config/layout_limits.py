"""How far a layout may go before it is refused: assumed limits, since no rule of design fixes them.

Each leaves in every aircraft of this kind that somebody has flown or drawn in earnest, and shuts out slips of the pen.
"""

BALANCED = 0.01  # m: so near to the plane a centre of gravity or of drag needs no aileron to speak of
LENGTH_AGREES = 0.2  # of the fuselage's length: nose and rear are points of the skin, and need not be its ends
OVERHANG = 0.25  # of the fuselage's length behind its rear: a swept fin or a pusher's shaft may carry that far
BELOW_NOSE = 2.0  # fuselage heights down to which parts hang: the shipped gear's middle by 0.7
OVERLAP = 0.15  # of two radii together: what their bounds let the optimizer mend
LEAST_LOAD = 0.05  # of the battery: payload, gear and systems of the shipped aircraft are 1.5 of it
SOUND = 340.0  # m/s, that of the standard atmosphere at sea level: no polar here knows a supersonic tip
STEEP = 1.0  # m: a hub this far above or below the wing may stand on a pylon; farther, a boom must lead to it
LARGEST_TAIL = 1.0  # of the wing's area: a larger one would be the wing, of an aircraft with a canard
LARGEST_FIN = 0.5  # of the wing's area: four times the shipped share
LARGEST_DRAG = 0.25  # of the wing's area: six times the shipped share
STOUTEST = 0.5  # of its length: flow leaves so stout a body, which the drag build-up does not know
THICKEST_BOOM = 0.5  # of the fuselage's smaller side: a thicker one would be a second fuselage
LONGEST_STUB = 1.0  # lift rotor radii that a boom may reach beyond its hub: farther, it would be outside the disk
