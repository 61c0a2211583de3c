"""Files in and out: every reader is bounded and refuses in one sentence; every writer leaves whole files or none."""
