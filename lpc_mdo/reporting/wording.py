"""Names of code and of stored numbers in words."""

UNIT_ENDINGS = ("_Wh_per_kg", "_m_per_s", "_dba", "_deg", "_rpm", "_kg", "_m2", "_m", "_W")


def words(name: str) -> str:
    """A name of code in words."""
    return name.replace("_", " ")


def quantity(name: str) -> str:
    """A stored number's name in words, without the unit at its end."""
    ending = next((unit for unit in UNIT_ENDINGS if name.endswith(unit)), "")
    return words(name.removesuffix(ending))
