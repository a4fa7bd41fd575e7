"""Fuzzes at random: `python -m tests.fuzz --minutes 20 [--target NAME …]`. What it finds joins the corpus."""

from __future__ import annotations

import argparse
import random
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator, Sequence

from hypothesis import HealthCheck, Phase, given, settings
from hypothesis.errors import HypothesisWarning

from tests.fuzz.grammars import GRAMMARS
from tests.fuzz.minimise import minimised
from tests.fuzz.mutate import mutated
from tests.fuzz.parent import Outcome, Runner
from tests.fuzz.targets import TARGETS, Target

TURN = 200
POOL_MAX = 400


class Session:
    """Goes round the targets. An input that a parser answers in a new way becomes a seed for the rest of the run."""

    def __init__(self, targets: Sequence[Target], runner: Runner, seed: int) -> None:
        self._targets = targets
        self._runner = runner
        self._rng = random.Random(seed)  # noqa: S311 - no secret
        self.cases: Counter[str] = Counter()
        self.findings: dict[tuple[str, str], Outcome] = {}
        self._shapes: set[tuple[str, str]] = set()
        self._pools = {target.name: list(target.seeds.values()) or [b""] for target in targets}

    def run(self, seconds: float) -> None:
        """Every target gets its turns; the last one is finished."""
        deadline_s = time.monotonic() + seconds
        while time.monotonic() < deadline_s:
            for target in self._targets:
                for case in self._mutated(target):
                    self._try(target, case)
                self._structured(target)
                if time.monotonic() > deadline_s:
                    return

    def _mutated(self, target: Target) -> Iterator[bytes]:
        pool = self._pools[target.name]
        for _ in range(TURN):
            yield mutated(self._rng.choice(pool), pool, self._rng)

    def _structured(self, target: Target) -> None:
        strategy = GRAMMARS[target.name]()

        @settings(
            max_examples=TURN // 2,
            database=None,
            deadline=None,
            phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )
        @given(strategy)
        def grown(data: bytes) -> None:
            self._try(target, data)

        grown()

    def _try(self, target: Target, data: bytes) -> None:
        outcome = target.run(self._runner, data)
        self.cases[target.name] += 1
        if outcome.finding:
            self._found(target, data, outcome)
        elif (target.name, outcome.shape) not in self._shapes:
            self._shapes.add((target.name, outcome.shape))
            if len(self._pools[target.name]) < POOL_MAX:
                self._pools[target.name].append(data)

    def _found(self, target: Target, data: bytes, outcome: Outcome) -> None:
        key = (target.name, outcome.signature)
        if key in self.findings:
            return
        self.findings[key] = outcome
        small = minimised(data, lambda case: target.run(self._runner, case).signature == outcome.signature)
        target.folder.mkdir(exist_ok=True)
        path = target.folder / f"found-{outcome.signature}"
        path.write_bytes(small)
        print(f"\n{path}: {outcome}", flush=True)


def main() -> int:
    options = _parse()
    warnings.simplefilter("ignore", HypothesisWarning)
    runner, began_s = Runner(), time.monotonic()
    session = Session([TARGETS[name] for name in options.target], runner, options.seed)
    try:
        session.run(options.minutes * 60)
    except KeyboardInterrupt:
        print()
    finally:
        runner.close()
    for name, count in sorted(session.cases.items()):
        found = [signature for target, signature in session.findings if target == name]
        print(f"{name:16} {count:9} cases  {', '.join(found) or 'nothing found'}")
    print(
        f"{session.cases.total()} cases, {len(session.findings)} findings, {time.monotonic() - began_s:.0f} s"
    )
    return 1 if session.findings else 0


def _parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz", description="Fuzzes the parsers of foreign data."
    )
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument(
        "--target", nargs="+", choices=sorted(TARGETS), default=sorted(TARGETS), metavar="NAME"
    )
    parser.add_argument("--seed", type=int, default=random.SystemRandom().getrandbits(32))
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
