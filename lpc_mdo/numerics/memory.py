"""How the process holds its memory: what an evaluation frees serves the next one."""

import ctypes
import platform

TRIM_THRESHOLD, TOP_PAD, MMAP_THRESHOLD = -1, -2, -3  # parameters of mallopt, malloc.h of the GNU C library
LARGEST_ON_HEAP = 1 << 25  # bytes, the most that the library allows
KEPT = 1 << 30  # bytes
AT_ONCE = 1 << 26  # bytes by which the heap grows


def keep_freed_memory() -> None:
    """Ask the GNU C library to keep freed memory for reuse; no other library is asked.

    By default it hands every array beyond some 100 kB back to the system, which clears each page anew when the next
    evaluation asks for it: a tenth to a quarter of the time of a batch of designs. Holds for the whole process.
    """
    if platform.libc_ver()[0] == "glibc":
        library = ctypes.CDLL(None)
        for parameter, value in ((MMAP_THRESHOLD, LARGEST_ON_HEAP), (TRIM_THRESHOLD, KEPT), (TOP_PAD, AT_ONCE)):
            library.mallopt(parameter, value)
