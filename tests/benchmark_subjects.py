"""Subjects that cost nothing, for the tests of the benchmark; run in processes of their own, so nothing heavy is imported."""

from benchmarks.subject import Task


def prepare_sum(count: int) -> Task:
    return Task(lambda: sum(range(count)), lambda: {"sum": sum(range(count))})


def prepare_noise() -> Task:
    print("what packages print at their import")
    return Task(lambda: print("and while they run"), lambda: {"is_heard": False})


def prepare_failure() -> Task:
    raise ArithmeticError("no such wing")
