"""What tables say of an outcome."""

from benchmarks.session import Outcome


def milliseconds(outcome: Outcome) -> str:
    return outcome.absence or f"{1e3 * outcome.median:.3g}"


def megabytes(outcome: Outcome) -> str:
    return "" if outcome.absence else f"{outcome.peak / 1e6:.0f}"


def runs(outcome: Outcome) -> str:
    return "" if outcome.absence else str(len(outcome.processor))


def ratio(outcome: Outcome, of: Outcome) -> str:
    """How many times as long as the other."""
    return "" if outcome.absence or of.absence else f"{outcome.median / of.median:.3g}"


def difference(relative: float) -> str:
    return f"{relative:.0e}"
