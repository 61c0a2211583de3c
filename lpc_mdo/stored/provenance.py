"""What stored files say of where they come from: versions and hashes, and the settings of a problem."""

from typing import Annotated, Any

from pydantic import AfterValidator

from lpc_mdo.files.values import Name, invalid, require_numbers

LONGEST = 1000  # characters of a text
TEXTS = ("version", "git", "configuration_sha256", "torch", "numpy", "scipy", "python", "platform")
SETTINGS = {  # that the shipped problems have, with their limits
    "noise_weight": (0.0, 1.0),
    "figure_of_merit": (0.0, 1.0),
    "speed_weight": (0.0, 1.0),
    "observer_distance_m": (1e-3, 1e6),
    "observer_elevation_deg": (-180.0, 180.0),
}


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and len(value) <= LONGEST


def _provenance(entries: dict[str, Any]) -> dict[str, Any]:
    """Raises ValueError, as validators do, for a version that is no text, a hash that is none, and a number that is none."""
    for name, value in entries.items():
        if name in TEXTS and not (_is_text(value) or (name == "git" and value is None)):
            raise ValueError(f"{name}{invalid(value, 'be text in quotes')}")
        if name == "surrogate_sha256" and not (isinstance(value, dict) and all(map(_is_text, value.values()))):
            raise ValueError(f"{name}{invalid(value, 'be a table of texts')}")
        is_whole = isinstance(value, int) and not isinstance(value, bool) and value >= 0
        if name in ("threads", "seed") and not (is_whole or (name == "seed" and value is None)):
            raise ValueError(f"{name}{invalid(value, 'be a whole number of at least 0')}")
    return entries


def _settings(entries: dict[str, Any]) -> dict[str, Any]:
    """Raises ValueError, as validators do, for a known one out of its limits."""
    for name, limits in SETTINGS.items():
        if name in entries:
            try:
                require_numbers(entries[name], (), *limits)
            except ValueError as error:
                raise ValueError(f"{name}{error}") from None
    return entries


Provenance = Annotated[dict[Name, Any], AfterValidator(_provenance)]
Settings = Annotated[dict[Name, Any], AfterValidator(_settings)]
