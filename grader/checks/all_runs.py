"""All runs of one submission, for what is judged from more than one of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.verdict import Verdict


class NotRecorded(Exception):
    """A run or the package was asked for that is not there; `verdict` says why, and what follows from it."""

    def __init__(self, verdict: Verdict) -> None:
        super().__init__(verdict.message)
        self.verdict = verdict


class NoSuchScenario(KeyError):
    """A scenario was asked for that the rubric does not have: a slip in the check itself."""

    def __str__(self) -> str:
        return str(self.args[0])


class Evidence(Mapping[str, Run]):
    """The runs by scenario, and `package`, the run of the build. Iterating gives those that were recorded.

    A scenario that was not recorded raises NotRecorded, one that the rubric does not have NoSuchScenario.
    """

    def __init__(
        self, found: Mapping[str, Run | Verdict], *, scenario: str | None, package: PackageFacts | Verdict
    ) -> None:
        self._found = dict(found)
        self._scenario = scenario
        self._package = package

    def __getitem__(self, scenario: str) -> Run:
        if scenario not in self._found:
            raise NoSuchScenario(f"there is no scenario {scenario!r}, only {', '.join(self._found)}")
        found = self._found[scenario]
        if isinstance(found, Verdict):
            raise NotRecorded(found)
        return found

    def __contains__(self, scenario: object) -> bool:
        return isinstance(self._found.get(str(scenario)), Run)

    def __iter__(self) -> Iterator[str]:
        return (name for name, run in self._found.items() if isinstance(run, Run))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def run(self) -> Run:
        """The run of the criterion's own scenario. Raises NoSuchScenario where it names none."""
        if self._scenario is None:
            raise NoSuchScenario("the criterion names no scenario, so there is no run: add scenario: to it")
        return self[self._scenario]

    @property
    def package(self) -> PackageFacts:
        """What the package's files say. Raises NotRecorded where no package was handed in."""
        if isinstance(self._package, Verdict):
            raise NotRecorded(self._package)
        return self._package
