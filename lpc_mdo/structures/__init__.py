"""Frames of beams, the airframe built of them, and its sizing: shared by analysis and training."""
