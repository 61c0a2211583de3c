"""Figures, one file each: `TITLE`, and `draw(run) -> Figure` from a stored run or study alone."""
