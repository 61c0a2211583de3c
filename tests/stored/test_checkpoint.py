"""The checkpoint of a run: written whole after every step, but for its history, which only grows."""

import json
from dataclasses import asdict

from lpc_mdo.optimization.result import Progress
from lpc_mdo.stored.checkpoint import FILE, HISTORY, CheckpointWriter


def record(i):
    return asdict(Progress("Newton", i, 1.0, 0.0, -1, float("nan"), float("nan"), i, 0.1 * i))


def test_records_are_written_once_and_leftovers_of_another_process_go(tmp_path):
    history = tmp_path / HISTORY
    history.write_text('{"phase": "of a run that was killed"}\n{"phase": "Newt')
    kept, rows = CheckpointWriter(tmp_path, "digest", "sqp"), [record(0)]
    kept.write({"x": [1.0], "history": rows})
    assert [json.loads(line)["iteration"] for line in history.read_text().splitlines()] == [0]
    first = history.stat().st_ino
    for i in (1, 2):
        rows.append(record(i))
        kept.write({"x": [1.0 + i], "history": rows})
    kept.write({"x": [9.0], "history": rows})
    assert history.stat().st_ino == first  # added to, not replaced
    assert [json.loads(line)["iteration"] for line in history.read_text().splitlines()] == [0, 1, 2]
    content = json.loads((tmp_path / FILE).read_text())
    assert (content["records"], content["state"]) == (3, {"x": [9.0]})
