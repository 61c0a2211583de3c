"""Which room of the package may import which, and that no modules import each other in a circle."""

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import lpc_mdo

PACKAGE = Path(lpc_mdo.__file__).parent

# Every room, from the ground up: what it may import besides itself.
ROOMS = {
    "numerics": set(),
    "files": set(),
    "optimization": {"numerics"},
    "airfoils": {"numerics", "files"},
    "surrogates": {"numerics", "files", "airfoils"},
    "disciplines": {"numerics"},
    "structures": {"numerics", "files", "surrogates", "disciplines"},
    "config": {"numerics", "files", "airfoils"},
    "geometry": {"numerics", "files", "airfoils", "config"},
    "model": {"numerics", "files", "airfoils", "surrogates", "disciplines", "structures", "config", "geometry"},
}
_UPPER = ("problems", "stored", "reporting", "studies", "cases", "interop", "training", "verification", "commands")
for _room in _UPPER:  # each of these may import every room before it, and the command line imports them all
    ROOMS[_room] = set(ROOMS)
LONG = 300  # lines of a file
# Modules that stand in the package itself, by the room that they belong to.
LOOSE = {"config": "config", "layout": "config", "layout_checks": "config", "cli": "commands", "__main__": "commands"}


def modules() -> Iterator[tuple[str, Path]]:
    """Name and file of every module, those of the linked folders among them."""
    for folder in (PACKAGE, *(place for place in PACKAGE.rglob("*") if place.is_dir())):
        yield from _in(folder)
    for link in (place for place in PACKAGE.iterdir() if place.is_symlink()):
        for folder in (link, *(place for place in link.rglob("*") if place.is_dir())):
            yield from _in(folder)


def _in(folder: Path) -> Iterator[tuple[str, Path]]:
    name = ".".join(("lpc_mdo", *folder.relative_to(PACKAGE).parts))
    for file in folder.glob("*.py"):
        yield (name if file.stem == "__init__" else f"{name}.{file.stem}"), file


FILES = dict(modules())
TREES = {name: ast.parse(file.read_text(encoding="utf-8")) for name, file in FILES.items()}


def imported(tree: ast.AST) -> set[str]:
    """Our modules that the nodes of a tree import, wherever they stand."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names = (f"{node.module}.{alias.name}" for alias in node.names)
            found |= {name if name in FILES else str(node.module) for name in names}
    return found & FILES.keys()


def when_loaded(tree: ast.Module) -> set[str]:
    """Those that are imported while the module itself is loaded."""
    found: set[str] = set()
    waiting: list[ast.AST] = list(tree.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) or _is_for_types(node):
            continue
        if isinstance(node, ast.Import | ast.ImportFrom):
            found |= imported(node)
        waiting += list(ast.iter_child_nodes(node))
    return found


def _is_for_types(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def room(module: str) -> str:
    parts = module.split(".")
    if len(parts) == 1:
        return "package"
    return parts[1] if parts[1] in ROOMS and parts[1] not in LOOSE else LOOSE.get(parts[1], "model")


def test_long_files_say_why():
    """One can be read in one sitting; a longer one says at its top why it is whole."""
    root = Path(__file__).parents[1]
    places = [root / folder for folder in ("lpc_mdo", "surrogates", "training", "scripts")]
    files = {file for place in places for file in place.rglob("*.py")}
    silent = []
    for file in files:
        text = file.read_text(encoding="utf-8")
        why = ast.get_docstring(ast.parse(text)) or ""
        if len(text.splitlines()) > LONG and f"More than {LONG} lines because" not in why:
            silent.append(str(file.relative_to(root)))
    assert not silent, f"longer than {LONG} lines without a reason: {', '.join(sorted(silent))}"


def test_every_folder_of_the_package_is_a_room():
    folders = {
        name.split(".")[1] for name, file in FILES.items() if name.count(".") == 1 and file.name == "__init__.py"
    }
    assert folders - ROOMS.keys() == {"data"} & folders


def test_rooms_import_only_what_lies_below_them():
    wrong = [
        f"{name} imports {other}"
        for name, tree in TREES.items()
        if room(name) != "package"
        for other in imported(tree)
        if room(other) not in ROOMS[room(name)] | {room(name), "package"}
    ]
    assert not wrong, "\n".join(wrong)


def test_no_modules_import_each_other_in_a_circle():
    graph = {name: when_loaded(tree) - {name} for name, tree in TREES.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        raise AssertionError(" -> ".join(error.args[1])) from None


def test_verification_is_loaded_by_the_check_alone():
    users = {name for name, tree in TREES.items() if any(room(other) == "verification" for other in imported(tree))}
    assert {name for name in users if room(name) != "verification"} == {"lpc_mdo.commands.check"}
