"""`lpc-mdo check`: does this installation compute what it should?"""

from pathlib import Path

import click

from lpc_mdo.commands.options import RUNS, output_option


@click.command("check")
@click.option("--gradients", "is_every_gradient", is_flag=True, help="Every variable, not one direction; slower.")
@click.option("--full", "is_full", is_flag=True, help="Every model against other codes, theory and experiments, too.")
@click.option(
    "--random-conditions",
    type=click.IntRange(1, 100_000_000),
    default=1_000_000,
    show_default=True,
    help="With --full: rotors at random; a million takes two minutes.",
)
@output_option("verification", "with --full: page, pictures and comparisons")
@click.option(
    "--publish", "is_published", is_flag=True, help="With --full: renew the source tree's page and data instead."
)
def command(
    is_every_gradient: bool, is_full: bool, random_conditions: int, output: Path | None, is_published: bool
) -> int:
    """Check on this machine: input files, surrogates, the model at the start, and its gradients.

    Exit code 0: all is well; 1: a check failed or a comparison missed its limit, the table says which.
    """
    for option, is_given in (("--output", output is not None), ("--publish", is_published)):
        if is_given and not is_full:
            raise click.UsageError(f"{option} needs --full")
    if output is not None and is_published:
        raise click.UsageError("--output and --publish exclude each other")
    from lpc_mdo.verification.self_check import run_checks

    code = run_checks(is_every_gradient)
    if is_full:
        from lpc_mdo.verification.full_check import run_full_check

        code = max(code, run_full_check(random_conditions, None if is_published else output or RUNS / "verification"))
    return code
