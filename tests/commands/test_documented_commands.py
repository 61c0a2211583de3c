"""Every command of README and documentation: it exists as written, and runs, whole or up to its first long step.

Commands run in the order of their page, in this process and in a folder of its own, which holds what `make optimize`, the first
command of README, leaves. What takes long is cut short by one rule:

- an optimization (optimize, pareto, sweep, starts) runs up to its first iteration, where it is stopped as by Ctrl-C; the
  folder that it would have left is then a copy of one run that was made as written, `lpc-mdo optimize`;
- a command of LONG runs with the options that stand there added, or with the groups of comparisons that stand there;
- a command of READ_ONLY is read (command, options and files exist), and not run, for the reason that stands there.
"""

import importlib.util
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from lpc_mdo.cli import main
from lpc_mdo.studies import runs
from lpc_mdo.studies.runner import StudyRun
from lpc_mdo.verification import atmosphere, full_check, rotors

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
PROGRAMS = (
    "lpc-mdo",
    r"python3?(?:\.\d+)?",
    "make",
    "pip3?",
    "source",
    "git",
    r"\.venv[\w-]*/bin/\w+",
    "pytest",
    "ruff",
)
YOURS = {  # files that the reader is to bring
    "case.json": ROOT / "tests" / "reference" / "bem_lift_rotor_axial.json",
    "mission_with_descent.toml": ROOT / "docs" / "examples" / "mission_with_descent.toml",
    "least_power.toml": ROOT / "docs" / "examples" / "least_power.toml",
    "samples.csv": None,
    "my_samples.csv": None,
    "my_polars.csv": None,
    "my_polars": None,
    "my_section.dat": None,
}
LONG = {
    "check --full": ["--random-conditions", "1000"],
    "sensitivities": ["--of", "fixed masses and payload"],
}
READ_ONLY = {
    "train airfoil": "XFOIL runs, or a fit of two minutes: tests/training/test_train_airfoil.py",
    "train structures": "fits and sizing of minutes, or the reader's samples: tests/surrogates/test_structural_mass.py, test_sizing.py",
    "--cluster": "a scheduler that is not there: tests/studies/test_runner.py",
    "--format step": "the CAD kernel may be missing: tests/geometry/test_cad.py",
}
SHELL = ("make ", "source ", "python3 -m venv ", ".venv-nastran/")  # `make` is asked whether it knows the target
PLACEHOLDER = re.compile(r"\b[A-Z]{1,}(_[A-Z]+)*(\.[a-z]+)?\b|\.\.\.")
INPUTS = ("vehicle", "mission", "problem", "start", "case", "data", "source", "run")


def blocks(page: Path) -> list[str]:
    """Command lines of a page's shell blocks, without their remarks."""
    lines = []
    for block in re.findall(r"^ *```sh\n(.*?)^ *```", page.read_text(), flags=re.DOTALL | re.MULTILINE):
        lines += [shlex.join(shlex.split(line, comments=True)) for line in block.replace("\\\n", " ").splitlines()]
    return [line for line in lines if line]


def in_text(page: Path) -> list[str]:
    """Commands in a page's running text that have no placeholder in them."""
    prose = re.sub(r"^ *```.*?^ *```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    found = re.findall(r"`((?:lpc-mdo|python|make|pip)\s[^`]*)`", prose.replace("\n", " "))
    return [command for command in found if not PLACEHOLDER.search(command)]


def elsewhere(text: str) -> list[str]:
    """Lines that look like commands in blocks that are not marked as sh: of another language, of none, or indented."""
    prose = re.sub(r"^( *)```(?:sh|python)\n.*?^\1```", "", text, flags=re.DOTALL | re.MULTILINE)
    fenced = re.findall(r"^ *(?:```|~~~)[^\n]*\n(.*?)^ *(?:```|~~~)", prose, flags=re.DOTALL | re.MULTILINE)
    indented = re.findall(r"(?:^|\n)\s*\n((?:(?: {4,}|\t)[^\n]*\n)+)", prose)
    return [
        line
        for line in "\n".join([*fenced, *indented]).splitlines()
        if re.match(rf"\s*(?:[$>%]\s+)?(?:{'|'.join(PROGRAMS)})\s+[-\w./]", line)
    ]


def parsed(arguments: list[str]) -> click.Context:
    """The context of the innermost command. Raises click.UsageError for what does not exist."""
    command, context = main, main.make_context("lpc-mdo", list(arguments))
    while isinstance(command, click.Group):
        _, command, rest = command.resolve_command(context, [*context._protected_args, *context.args])
        context = command.make_context(command.name, rest, parent=context)
    return context


def extras_exist(command: str) -> None:
    """Of this package, wherever it is installed from."""
    known = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    named = re.findall(r"(?:lpc-mdo|\.)\[([\w,-]+)\]", command)
    assert named, command
    assert set(",".join(named).split(",")) <= known.keys(), command


def options_of_script(command: str) -> None:
    words = shlex.split(command)
    script = ROOT / words[1]
    assert script.is_file(), command
    shown = subprocess.run([sys.executable, script, "--help"], capture_output=True, text=True, check=True).stdout
    assert all(word in shown for word in words[2:] if word.startswith("--")), command


def test_no_command_hides_in_a_block_that_is_not_marked_as_shell():
    for page in PAGES:
        assert not elsewhere(page.read_text()), f"{page.name}: mark the block with sh"


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("```\nlpc-mdo optimize\n```\n", 1),
        ("```console\n$ lpc-mdo check\nok\n$ make test\n```\n", 2),
        ("~~~bash\npython scripts/choices.py\n~~~\n", 1),
        ("so:\n\n    lpc-mdo optimize\n    pip install x\n\nand\n", 2),
        ("1. so\n\n   ```\n   lpc-mdo check\n   ```\n", 1),
        ("```sh\nlpc-mdo optimize\n```\n\n   ```python\n   make = 3\n   ```\n", 0),
        ("```\nlpc-mdo: vehicle.toml: wrong\n```\n", 0),
    ],
)
def test_hidden_commands_are_found(text, count):
    assert len(elsewhere(text)) == count


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_in_running_text_exist(page):
    for command in in_text(page):
        words = shlex.split(command)
        if words[0] == "make":
            subprocess.run([*words, "--dry-run"], cwd=ROOT, capture_output=True, check=True)
        elif words[0] == "pip":
            extras_exist(command)
        elif words[:2] == ["python", "-m"]:
            assert importlib.util.find_spec(words[2]), f"{page.name}: {command}"
        elif words[0] == "python":
            options_of_script(command)
        elif len(words) > 1:
            try:
                parsed(words[1:])
            except (click.MissingParameter, click.BadOptionUsage, click.exceptions.Exit):
                continue  # named, not written out; or asked for its help
            except click.UsageError as error:
                raise AssertionError(f"{page.name}: {command}: {error.format_message()}") from None


def test_commands_in_messages_exist():
    """What messages and docstrings of the package tell people to run, as far as options are written out."""
    for file in sorted((ROOT / "lpc_mdo").rglob("*.py")):
        for command in re.findall(r"\blpc-mdo ((?:[a-z]+(?: [a-z]+)?)(?: --[a-z][a-z-]+)*)", file.read_text()):
            name, *rest = command.split()
            if name not in main.commands:  # "an lpc-mdo command"
                continue
            found = main.commands[name]
            if isinstance(found, click.Group) and rest and rest[0] in found.commands:
                found = found.commands[rest.pop(0)]
            known = {option for parameter in found.params for option in parameter.opts}
            assert {word for word in rest if word.startswith("--")} <= known, f"{file.name}: lpc-mdo {command}"


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The folder that `lpc-mdo optimize` leaves."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        done = CliRunner().invoke(main, ["optimize"])
        assert done.exit_code == 0, done.output
    return folder / "runs" / "baseline"


def stop(*arguments, **options):
    raise KeyboardInterrupt


def run_line(line: str, finished: Path) -> None:
    words = shlex.split(line)[1:]
    context = parsed(words)
    for name in INPUTS:
        given = context.params.get(name)
        file = Path(given) if isinstance(given, str) and given.endswith(".toml") else given
        if isinstance(file, Path):
            assert file.exists() or str(file) in YOURS, f"{line}: nothing makes {file}"
            if not file.exists() and YOURS[str(file)]:
                shutil.copy(YOURS[str(file)], file)
    if any(key in " ".join(words) for key in READ_ONLY):
        return
    for key, more in LONG.items():
        words += more if " ".join(words).startswith(key) else []
    done = CliRunner().invoke(main, words)
    stopped = context.info_name in ("optimize", "pareto", "sweep")
    assert done.exit_code == (1 if stopped else 0), f"{line}: {done.output}"
    assert stopped == ("lpc-mdo: stopped" in done.stderr), f"{line}: {done.output}"
    for file in Path().rglob("configuration.json"):  # of the run that was stopped
        if not (file.parent / "result.json").exists():
            shutil.copytree(finished, file.parent, dirs_exist_ok=True)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_of_shell_blocks_run_as_written(page, finished, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tests").symlink_to(ROOT / "tests")
    shutil.copytree(finished, tmp_path / "runs" / "baseline")
    monkeypatch.setattr(runs, "minimum", stop)
    monkeypatch.setattr(StudyRun, "_execute", stop)
    monkeypatch.setattr(full_check, "GROUPS", {"Rotors": rotors.comparisons, "Atmosphere": atmosphere.comparisons})
    for line in blocks(page):
        if line.startswith("make "):
            subprocess.run([*shlex.split(line), "--dry-run"], cwd=ROOT, capture_output=True, check=True)
        elif line.startswith("python scripts/"):
            options_of_script(line)
        elif line.startswith("lpc-mdo "):
            run_line(line, finished)
        else:
            assert line.startswith(SHELL), f"{page.name}: {line} is no command that this test knows"
