"""The process of one subject: `python -m benchmarks.worker TARGET ARGUMENTS`, driven by lines on standard input.

It answers each line with one line of JSON: "check" with what the task computes, "run" with the processor time of a run (s)
and the largest memory that the process has held so far (bytes).
"""

import json
import os
import resource
import sys
import time
from importlib import import_module

KIBIBYTE = 1 if sys.platform == "darwin" else 1024  # unit of ru_maxrss


def peak_memory() -> int:
    """Largest resident set of this process so far, bytes."""
    return KIBIBYTE * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def main(target: str, arguments: str) -> None:
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what packages print must not end up between the answers

    def answer(content: dict) -> None:
        answers.write(json.dumps(content) + "\n")
        answers.flush()

    module, function = target.split(":")
    task = getattr(import_module(module), function)(**json.loads(arguments))
    answer({})  # ready
    for line in sys.stdin:
        if line.strip() == "check":
            answer(task.check())
            continue
        begin = time.process_time()
        task.run()
        answer({"processor_s": time.process_time() - begin, "peak_bytes": peak_memory()})


if __name__ == "__main__":
    main(*sys.argv[1:])
