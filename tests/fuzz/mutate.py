"""Bytes into other bytes: cuts, flips, splices, lengths that lie. All of it follows from the random generator."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable, Sequence

BYTES_MAX = 1 << 17
SLICE_MAX = 256
REPEATS = (2, 16, 256)
LENGTHS = tuple(
    struct.pack(form, value)
    for form, values in (
        ("<I", (0, 1, 0x7F, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)),
        ("<Q", (0, 1, 0x7FFFFFFF, 0xFFFFFFFF, 1 << 40, (1 << 63) - 1, (1 << 64) - 1)),
        (">I", (0, 0xFFFFFFFF)),
    )
    for value in values
)
WORDS = (
    b"\0", b"\n", b"\r\n", b"\xff\xfe", b"\xef\xbb\xbf", b"\xc0\xaf", b"\xed\xa0\x80", b"\\ud800", b"\xe2\x80\xae",
    b"\x1b[2J", b"-1", b"0", b"1e999", b"NaN", b"null", b"9" * 40, b"0x" + b"f" * 40, b"..", b"/", b"${", b"$(",
    b"[", b"{", b"(", b"<", b"]]>", b"&a ", b"*a", b"<<: ", b'"', b"'", b"=", b"%s", b"{0}", b"{}",
)  # fmt: skip

Mutation = Callable[[bytes, Sequence[bytes], random.Random], bytes]


def mutated(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    """One to four mutations of `data`, one after the other; `seeds` are what is spliced in."""
    for _ in range(rng.choice((1, 1, 2, 4))):
        data = rng.choice(MUTATIONS)(data, seeds, rng)[:BYTES_MAX]
    return data


def _truncate(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    return data[: _place(data, rng)]


def _flip(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    found = bytearray(data)
    for _n in range(rng.choice((1, 1, 4))):
        if found:
            found[rng.randrange(len(found))] ^= 1 << rng.randrange(8)
    return bytes(found)


def _delete(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    begin, end = _slice(data, rng)
    return data[:begin] + data[end:]


def _duplicate(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    begin, end = _slice(data, rng)
    return data[:end] + data[begin:end] * (rng.choice(REPEATS) - 1) + data[end:]


def _splice(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    other = rng.choice(seeds)
    begin, end = _slice(other, rng)
    place, rest = _slice(data, rng)
    return data[:place] + other[begin:end] + data[rng.choice((place, rest)) :]


def _cross(data: bytes, seeds: Sequence[bytes], rng: random.Random) -> bytes:
    other = rng.choice(seeds)
    return data[: _place(data, rng)] + other[_place(other, rng) :]


def _length(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    value, place = rng.choice(LENGTHS), _place(data, rng)
    return data[:place] + value + data[place + len(value) :]


def _word(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    place, word = _place(data, rng), rng.choice(WORDS)
    return data[:place] + word + data[place + rng.choice((0, len(word))) :]


def _nest(data: bytes, _: Sequence[bytes], rng: random.Random) -> bytes:
    """A short piece many times over, so that it opens what nothing closes."""
    begin, end = _slice(data[:2000], rng)
    return data[:begin] + data[begin : min(end, begin + 12)] * rng.choice((60, 2000)) + data[end:]


MUTATIONS: tuple[Mutation, ...] = (
    _truncate, _flip, _flip, _delete, _duplicate, _splice, _cross, _length, _length, _word, _word, _nest
)  # fmt: skip


def _place(data: bytes, rng: random.Random) -> int:
    return rng.randrange(len(data) + 1)


def _slice(data: bytes, rng: random.Random) -> tuple[int, int]:
    begin = _place(data, rng)
    return begin, min(len(data), begin + rng.randrange(1, SLICE_MAX))
