"""What `tests/test_limited_child.py` has run in a child with limits; it needs nothing but the standard library."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Iterator


def take_memory() -> Iterator[int]:
    yield 1
    yield len(bytes(1 << 30))


def take_processor_time() -> Iterator[int]:
    yield 1
    while True:
        pass


def take_time() -> Iterator[int]:
    yield 1
    time.sleep(60)


def write_much(path: str) -> Iterator[int]:
    yield 1
    with open(path, "wb") as file:  # noqa: PTH123 - as little as can be is loaded
        yield file.write(bytes(2 << 20))


def crash() -> Iterator[int]:
    yield 1
    os._exit(9)


def say_much() -> Iterator[str]:
    for _ in range(100):
        yield "x" * 99


def look_around() -> Iterator[object]:
    yield sorted(os.environ)
    yield os.getcwd()  # noqa: PTH109 - as above
    yield [path for path in sys.path if path.endswith("site-packages")]


def repeat(*values: object) -> Iterator[object]:
    yield from values


REMEMBERED: list[int] = []


def remember() -> Iterator[dict[str, int]]:
    REMEMBERED.append(1)
    yield {"own": os.getpid(), "parent": os.getppid(), "remembered": len(REMEMBERED)}
