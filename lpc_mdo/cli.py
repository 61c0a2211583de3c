"""The lpc-mdo command: its subcommands are the modules of `lpc_mdo.commands` that define `command`."""

import contextlib
import errno
import os
import pkgutil
import sys
import warnings
from collections.abc import Callable, Iterator
from importlib import import_module
from typing import Any

import click

from lpc_mdo import commands

FAILED, BAD_INPUT = 1, 2
LONGEST_LINE = 800  # characters of a refusal: the place stands at its beginning, the rule at its end


class _Group(click.Group):
    """Turns every fault of the input into one line on standard error and exit code 2; of the machine, exit code 1."""

    def main(self, *args: Any, **kwargs: Any) -> Any:
        kwargs["standalone_mode"] = False
        warnings.formatwarning = _each_once()
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # a terminal without some sign shows "?"
        try:
            code = super().main(*args, **kwargs)
        except click.ClickException as error:
            code = _refused(BAD_INPUT, " ".join(error.format_message().split()))  # choices have lines of their own
        except OSError as error:
            code = _failed(error)
        except ValueError as error:
            code = _refused(BAD_INPUT, str(error))
        except MemoryError:
            code = _refused(FAILED, "the memory of this machine does not suffice")
        except (KeyboardInterrupt, click.Abort):
            code = _refused(FAILED, "stopped")
        _let_go_of_output()
        sys.exit(code if isinstance(code, int) else 0)


def _refused(code: int, text: str) -> int:
    with contextlib.suppress(OSError):  # nobody reads it
        for line in text.splitlines():
            click.echo(f"lpc-mdo: {_readable(line)}", err=True)
    return code


def _readable(line: str) -> str:
    """A sentence with its middle left out where it quotes more of a file, or of an option, than anybody reads."""
    half = LONGEST_LINE // 2
    return line if len(line) <= LONGEST_LINE else f"{line[:half]} ... {line[-half:]}"


def _failed(error: OSError) -> int:
    """A file that is not what it should be is bad input; a full disk or a lost connection is not."""
    from lpc_mdo.files.write import is_of_the_machine

    if not is_of_the_machine(error):
        return _refused(BAD_INPUT, _of_a_path(error))
    if error.errno == errno.EPIPE:  # who reads our output has seen enough
        return FAILED
    place = f"{error.filename}: " if error.filename else ""
    return _refused(FAILED, f"{place}{error.strerror or error}")


def _of_a_path(error: OSError) -> str:
    """What is wrong with a path that was given, in words."""
    from lpc_mdo.files.faults import shortened

    if error.filename is None:
        return str(error)
    rule = "; each of its parts must have at most 255 bytes" if error.errno == errno.ENAMETOOLONG else ""
    return f"{shortened(str(error.filename))} cannot be used: {(error.strerror or '').lower()}{rule}"


def _let_go_of_output() -> None:
    """Write what is left; where nobody takes it, leave nothing for Python to complain of at its end."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            with contextlib.suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _each_once() -> Callable[..., str]:
    """Formats a warning as one line, the same text again as nothing: Python forgets what it showed when filters change."""
    told: set[str] = set()

    def line(message: Warning | str, *details: object) -> str:
        is_new = str(message) not in told
        told.add(str(message))
        return f"lpc-mdo: {message}\n" if is_new else ""

    return line


@click.group(cls=_Group, no_args_is_help=False, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="lpc-mdo", prog_name="lpc-mdo")
def main() -> None:
    """Differentiable design of the Lift+Cruise electric air taxi."""


def _subcommands() -> Iterator[click.Command]:
    for module in pkgutil.iter_modules(commands.__path__):
        found = getattr(import_module(f"{commands.__name__}.{module.name}"), "command", None)
        if isinstance(found, click.Command):
            yield found


for subcommand in _subcommands():
    main.add_command(subcommand)
