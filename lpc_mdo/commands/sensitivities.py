"""`lpc-mdo sensitivities`: what a stored optimum answers to."""

from pathlib import Path

import click


@click.command("sensitivities")
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--verify", "is_verifying", is_flag=True, help="Optimize again with 1 % less and more; a minute or so.")
@click.option("--of", "labels", multiple=True, help="With --verify: what to change, as the table calls it; repeatable.")
def command(run: Path, is_verifying: bool, labels: tuple[str, ...]) -> int:
    """Show what the optimum in the run folder RUN answers to, for one per cent more of limits, bounds and parameters.

    With --verify, optima found anew stand beside what the envelope theorem says, also in RUN/sensitivities.json.
    Exit code 0: done; 1: an optimum could not be certified; 2: bad input.
    """
    from lpc_mdo.studies import sensitivities

    if labels and not is_verifying:
        raise click.UsageError("--of is not allowed without --verify; the table shows everything.")
    return sensitivities.verify(run, labels) if is_verifying else sensitivities.show(run)
