"""The models' verification as reports show it: comparisons with what is not ours, stored in the package by `lpc-mdo check`."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib import resources
from pathlib import Path
from typing import Any

from lpc_mdo.files.write import write_atomically

SCHEMA = "lpc-mdo/verification/1"
FILE = Path(str(resources.files("lpc_mdo.data").joinpath("verification.json")))


def write_verification(groups: Mapping[str, Sequence[Any]], file: Path = FILE) -> None:
    """Store the comparisons (`lpc_mdo.verification.comparison.Comparison`) of each group of models."""
    rows = {name: [asdict(row) | {"is_met": row.is_met} for row in group] for name, group in groups.items()}
    write_atomically(file, json.dumps({"schema": SCHEMA, "groups": rows}, indent=1) + "\n")


def stored_verification(file: Path = FILE) -> dict[str, list[dict[str, Any]]]:
    """The stored comparisons by group; none where nothing is stored. Raises ValueError for another schema."""
    if not file.exists():
        return {}
    content = json.loads(file.read_text(encoding="utf-8"))
    if content.get("schema") != SCHEMA:
        raise ValueError(f"{file}: schema = {content.get('schema')!r} is not allowed; it must be {SCHEMA!r}")
    return content["groups"]


def summary(groups: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[dict[str, str]]:
    """One line a group and partner: how many comparisons, how many within their limits, and the one nearest to its limit."""
    lines = []
    for name, rows in groups.items():
        for against in dict.fromkeys(row["against"] for row in rows):
            own = [row for row in rows if row["against"] == against]
            closest = max(own, key=_share)
            unit = closest.get("unit") or ""
            lines.append(
                {
                    "group": name,
                    "against": against,
                    "met": f"{sum(row['is_met'] for row in own)} of {len(own)}",
                    "quantity": f"{closest['model']}: {closest['quantity']}",
                    "difference": _short(closest["difference"], unit),
                    "limit": _short(closest["tolerance"], unit),
                }
            )
    return lines


def _share(row: Mapping[str, Any]) -> float:
    """Of its limit that a difference takes; one that may be zero only, or is no number, comes first if it is not met."""
    if not row["is_met"]:
        return float("inf")
    return abs(row["difference"]) / row["tolerance"] if row["tolerance"] else 0.0


def _short(value: float, unit: str) -> str:
    """A relative difference in per cent from a hundredth of a per cent on, others with their unit."""
    if unit:
        return f"{value:.2g} {unit}".replace("-", "−")
    text = f"{100.0 * value:.2g} %" if abs(value) >= 1e-4 or value == 0.0 else f"{value:.1e}"
    return text.replace("-", "−")
