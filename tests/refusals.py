"""What the tests of refusals share: files given to a command, and what a refusal is."""

from pathlib import Path

RUN = "optimize --quiet --output run"


def write(files):
    for name, content in files.items():
        file = Path(name)
        file.parent.mkdir(parents=True, exist_ok=True)
        if content is None:
            file.mkdir()
        else:
            file.write_bytes(content if isinstance(content, bytes) else content.encode())


def everything():
    """Every path below the current folder with its content."""
    return {str(path): path.read_bytes() if path.is_file() else None for path in Path().rglob("*")}


def assert_refused(code, output, message, expected):
    assert code == 2, (output, message)
    assert output == ""
    assert "Traceback" not in message
    assert message.startswith("lpc-mdo: ")
    assert len(message.splitlines()) == 1, message
    for fragment in expected:
        assert fragment in message
