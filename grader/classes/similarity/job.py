"""Compares a class in a process of its own. A request on stdin, `Similarity` on
stdout."""

from __future__ import annotations

import resource
import sys
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path

import numpy as np

from grader.classes.similarity.matching import (
    COMMON_FROM,
    Work,
    candidates,
    clusters,
    common_prints,
    distinct,
    own_work,
    pair,
)
from grader.classes.similarity.reading import read_all, texts_of
from grader.classes.similarity.request import Request
from grader.classes.similarity.sources import read_starter
from grader.classes.similarity.tokens import Text
from grader.classes.similarity.tutorials import TUTORIALS
from grader.model.similarity import NotCompared, Pair, Similarity, TakenOut

LIBRARY = "copydetect"
MIN_LINES = 10
"""Independent solutions of a small lab share up to nine lines that anyone would write so."""
MEMORY_BYTES = 6 << 30
CPU_S = 1800
PRINTS_MAX = 20_000_000
PAIRS_MAX = 2_000
STARTER_NOTES = 20
LARGE_CLUSTER = 6


def run(request: Request) -> Similarity:
    """Compare."""
    starter, unread = _starter(request.starter)
    tutorials = texts_of("", TUTORIALS).texts
    texts, not_compared = _texts(request)
    several = len(texts) >= COMMON_FROM
    common = common_prints(list(texts.values())) if several else np.zeros(0, dtype=np.int64)
    taken_out = distinct([*(text.prints for text in (*starter, *tutorials)), common])
    works = [own_work(name, files, taken_out) for name, files in texts.items()]
    enough = [work for work in works if work.lines >= MIN_LINES]
    pairs, same_group, cut = _pairs(enough, request)
    found = clusters([(one.a, one.b) for one in pairs])
    return Similarity(
        library=LIBRARY,
        library_version=metadata.version(LIBRARY),
        threshold=request.threshold,
        min_lines=MIN_LINES,
        compared=len(works),
        pairs=tuple(pairs[:PAIRS_MAX]),
        clusters=found,
        taken_out=TakenOut(
            starter=tuple(text.path for text in starter),
            tutorials=tuple(text.path for text in tutorials),
            common=len(common) if several else None,
        ),
        too_little=tuple(work.id for work in works if work.lines < MIN_LINES),
        not_compared=tuple(not_compared),
        same_group=same_group,
        notes=(*unread, *_notes(request, len(works), found, cut=cut or len(pairs) > PAIRS_MAX)),
    )


def _starter(places: Sequence[Path]) -> tuple[tuple[Text, ...], list[str]]:
    """The starter code's fingerprints, and what to say of what cannot be taken out."""
    texts: list[Text] = []
    notes: list[str] = []
    for place in places:
        sources = read_starter(place)
        read = texts_of("", sources.files)
        texts += read.texts
        notes += [f"starter code: {one.file}: {one.reason}" for one in (*sources.left_out, *read.left_out)]
        if not sources.files:
            notes.append("starter code: holds no program in Python or C++")
    return tuple(texts), notes[:STARTER_NOTES]


def _texts(request: Request) -> tuple[dict[str, tuple[Text, ...]], list[NotCompared]]:
    """The submissions' fingerprints, as long as there is room for them."""
    texts: dict[str, tuple[Text, ...]] = {}
    left_out: list[NotCompared] = []
    held = 0
    for name, read in read_all(request.folders, request.jobs):
        left_out += read.left_out
        size = sum(len(text.prints) for text in read.texts)
        if held + size > PRINTS_MAX:
            left_out.append(NotCompared(id=name, reason="the class has too much code to compare all of it"))
        elif read.texts:
            texts[name] = read.texts
            held += size
        elif not read.left_out:
            left_out.append(NotCompared(id=name, reason="holds no program in Python or C++"))
    left_out.sort(key=lambda one: (one.id, one.file))
    return {name: texts[name] for name in sorted(texts)}, left_out


def _pairs(works: Sequence[Work], request: Request) -> tuple[list[Pair], int, bool]:
    """The pairs that a person should see, how many were left out for their group, and whether the rest was cut."""
    near, cut = candidates(works)
    found, same_group = [], 0
    for first, second in near:
        one = pair(works[first], works[second])
        if not _alike(one, request.threshold):
            continue
        if _same_group(one, request.groups):
            same_group += 1
        else:
            found.append(one)
    found.sort(
        key=lambda one: (-max(one.similarity_a, one.similarity_b), -one.lines_a - one.lines_b, one.a, one.b)
    )
    return found, same_group, cut


def _alike(one: Pair, threshold: float) -> bool:
    share = max(one.similarity_a, one.similarity_b)
    return share >= threshold and min(one.lines_a, one.lines_b) >= MIN_LINES


def _same_group(one: Pair, groups: Mapping[str, str]) -> bool:
    group = groups.get(one.a, "")
    return bool(group) and group == groups.get(one.b)


def _notes(request: Request, count: int, found: Sequence[Sequence[str]], *, cut: bool) -> list[str]:
    notes = []
    if count < COMMON_FROM and not request.starter:
        notes.append(
            f"fewer than {COMMON_FROM} submissions and no starter code: what the task itself makes alike is not "
            "taken out; give the handout's package, or a reference solution, with --starter"
        )
    if any(len(group) >= LARGE_CLUSTER for group in found):
        notes.append(
            f"{LARGE_CLUSTER} or more submissions hang together: they may have a source in common (a tutorial, "
            "code from the lecture); give it with --starter"
        )
    if cut:
        notes.append("more pairs are alike than are named here")
    return notes


def main() -> int:
    """The process's own limits come first: they hold for all that it starts."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S + 5))
    request = Request.model_validate_json(sys.stdin.buffer.read())
    sys.stdout.write(run(request).model_dump_json(by_alias=True))
    return 0


if __name__ == "__main__":
    sys.exit(main())
