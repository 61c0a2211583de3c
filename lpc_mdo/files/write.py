"""Writing files so that a killed run, or a full disk, leaves none half written, and a folder holds one process's work."""

import contextlib
import errno
import fcntl
import os
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from lpc_mdo.files.read import ConfigurationError

LOCK = ".lock"
FAULTS_OF_THE_MACHINE = (
    *(errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG, errno.ENOMEM, errno.EMFILE, errno.ENFILE, errno.EROFS),
    *(errno.EPIPE, errno.ESTALE, errno.ETIMEDOUT, errno.ECONNRESET, errno.ECONNABORTED),
)
UNLOCKABLE = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)


def is_of_the_machine(error: OSError) -> bool:
    """The machine failed (a full disk, a lost connection): nothing that was asked for is wrong."""
    return isinstance(error, ConnectionError) or error.errno in FAULTS_OF_THE_MACHINE


def write_atomically(file: Path, content: str | bytes) -> None:
    """Write a whole file or none of it; text as UTF-8. Raises OSError that names the file."""
    write_together({file: content.encode() if isinstance(content, str) else content})


def append(file: Path, content: str) -> None:
    """Add text to a file's end, as UTF-8, on the disk when this returns. Raises OSError that names the file."""
    try:
        with file.open("ab") as stream:
            stream.write(content.encode())
            stream.flush()
            os.fsync(stream.fileno())
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(file)) from None


def write_together(contents: Mapping[Path, bytes]) -> None:
    """Write files that belong together, each whole: all are on the disk before the first takes its name.

    Raises OSError that names a file, with nothing left behind, if one cannot be written.
    """
    partial = {file: file.with_name(file.name + ".partial") for file in contents}
    try:
        for file, data in contents.items():
            _write(partial[file], data, file)
        for file in contents:
            os.replace(partial[file], file)
    finally:
        for file in partial.values():
            file.unlink(missing_ok=True)


def _write(partial: Path, data: bytes, file: Path) -> None:
    try:
        with partial.open("wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(file)) from None


def make_folder(folder: Path, name: str = "--output") -> None:
    """Make the folder if it is not there. Raises ConfigurationError where that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        if is_of_the_machine(error):
            raise
        reason = "it exists and is not a folder" if folder.exists() else error.strerror
        raise ConfigurationError(f"{name} {folder} is not allowed; {reason}.") from None


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Within it no other process works in the folder, which is made if it is not there, and goes again if work that fails
    leaves it empty.

    Raises ConfigurationError if one does. However a process ends, its lock ends with it.
    """
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    make_folder(folder)
    try:
        with _held(folder):
            yield
    except BaseException:
        with contextlib.suppress(OSError):  # not empty
            for place in made:
                place.rmdir()
        raise


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    file = folder / LOCK
    while True:
        with _opened(file) as stream:
            _take(stream, folder)
            if not _is_at(file, stream.fileno()):
                continue  # its last holder has just removed it
            try:
                yield
            finally:
                file.unlink(missing_ok=True)
            return


def _opened(file: Path) -> BinaryIO:
    try:
        return file.open("ab")
    except OSError as error:
        if is_of_the_machine(error):
            raise
        raise ConfigurationError(f"--output {file.parent} is not allowed; {error.strerror}.") from None


def _take(stream: BinaryIO, folder: Path) -> None:
    try:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise ConfigurationError(
            f"--output {folder} is in use: another process writes there; name another folder or wait."
        ) from None
    except OSError as error:
        if error.errno not in UNLOCKABLE:
            raise
        warnings.warn(f"{folder} cannot be locked; see that no other process writes there", stacklevel=3)


def _is_at(file: Path, descriptor: int) -> bool:
    """The open file is still the one of that name."""
    try:
        return os.path.samestat(file.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
