"""Memory that evaluations free serves the next ones."""

import subprocess
import sys

import pytest

PAGES = """
import platform, resource
import torch
from lpc_mdo.numerics.memory import keep_freed_memory

def faults():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        parts = [torch.ones(1 << 18, dtype=torch.float64) for _ in range(4)]  # 2 MB each
        del parts
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

keep_freed_memory()
faults()
print(platform.libc_ver()[0], faults())
"""


@pytest.mark.skipif(sys.platform != "linux", reason="concerns the GNU C library alone")
def test_freed_arrays_are_not_handed_back_to_the_system():
    run = subprocess.run([sys.executable, "-c", PAGES], capture_output=True, text=True, check=True)
    library, faults = run.stdout.split()
    # 20 x 4 arrays have 40960 pages of 4 kB, a tenth of the huge ones.
    if library == "glibc":
        assert int(faults) < 80
