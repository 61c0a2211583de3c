"""One name for a section wherever one is asked for: a designation, a shipped polar, a card, or a coordinate file."""

import json
import re
from functools import cache
from importlib import resources
from pathlib import Path

from lpc_mdo.airfoils.shape import AirfoilShape, airfoil_shape
from lpc_mdo.files.faults import shortened
from lpc_mdo.files.read import is_there
from lpc_mdo.surrogates.airfoil import AirfoilPolar, load_airfoil
from lpc_mdo.surrogates.cards import AIRFOIL_SCHEMA

OTHER_NAMES = {"ls10417": "ls417", "gaw1": "ls417"}  # without blanks and marks


@cache
def shipped_airfoils() -> tuple[str, ...]:
    """Names of the polars that come with the package."""
    files = [file for file in resources.files("lpc_mdo.surrogates.weights").iterdir() if file.name.endswith(".json")]
    return tuple(
        sorted(
            file.name.removesuffix(".json")
            for file in files
            if json.loads(file.read_text())["schema"] == AIRFOIL_SCHEMA
        )
    )


def resolve_airfoil(name: str, folder: Path = Path(), key: str = "airfoil") -> AirfoilPolar:
    """The trained polar of 'NACA 4412', 'naca4412', '4412', 'LS(1)-0417', a card (NAME.json) or a coordinate file.

    Paths are relative to `folder`. Coordinates have a polar if they are those of a shipped one, or of a card of the same
    name beside them. Raises ValueError that says what the name, given under `key`, must be, or how to make the polar that is missing.
    """
    try:
        return _resolved(name, folder)
    except ValueError as error:
        said = str(error)
        if said.startswith("airfoil = "):
            raise ValueError(f"{key}{said.removeprefix('airfoil')}") from None
        raise ValueError(f"{key} = {shortened(name)} is invalid: {said}") from None


def _resolved(name: str, folder: Path) -> AirfoilPolar:
    if (known := _shipped_name(name)) is not None:
        return load_airfoil(known)
    file = folder / Path(name).expanduser()
    if name.lower().endswith(".json"):
        return load_airfoil(str(file))
    try:
        shape = airfoil_shape(name if _is_designation(name) else str(file))
    except ValueError as error:
        if (name.strip() and is_there(file)) or _is_designation(name):
            raise
        raise ValueError(
            f"airfoil = {shortened(name)} is invalid: it must be one of {', '.join(shipped_airfoils())}, the card of a trained "
            "polar (NAME.json), or a coordinate file that has one"
        ) from error
    if (polar := _trained_beside(shape, file)) is not None:
        return polar
    raise ValueError(
        f"airfoil = {shortened(name)} is invalid: it has no trained polar; `lpc-mdo train airfoil --airfoil "
        f"{shape.designation or file} --output runs/{shape.name}` makes one, then name runs/{shape.name}/{shape.name}.json"
    )


def _shipped_name(name: str) -> str | None:
    bare = re.sub(r"[^a-z0-9]", "", name.lower()) if not re.search(r"[/\\]|\.\w+$", name) else name
    bare = OTHER_NAMES.get(bare, bare)
    return next((known for known in shipped_airfoils() if known in (bare, f"naca{bare}")), None)


def _is_designation(name: str) -> bool:
    return re.fullmatch(r"(?:naca)?[ -]?\d{4,5}", name.strip().lower()) is not None


def _trained_beside(shape: AirfoilShape, file: Path) -> AirfoilPolar | None:
    """The polar whose card says that it was trained for this very section: a shipped one, or one beside the file."""
    beside = [] if shape.designation else [str(file.with_name(f"{shape.name}.json"))]
    for card in (*shipped_airfoils(), *beside):
        if card in beside and not Path(card).is_file():
            continue
        polar = load_airfoil(card)
        if polar.card.get("section", {}).get("key") == shape.key:
            return polar
    return None
