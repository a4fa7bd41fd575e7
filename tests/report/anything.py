"""Results with any text in every field."""

from __future__ import annotations

from collections.abc import Iterator

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from grader.model.result import (
    AUTHOR_CHARS,
    COMMENT_CHARS,
    AppliedOverride,
    Automatic,
    CriterionResult,
    ErrorInfo,
    GradingResult,
    Lateness,
    Note,
    SubmissionInfo,
)
from grader.model.verdict import EvidenceCitation, FileCitation, Status
from tests.report.hostile import result
from tests.report.nasty import TEXTS
from tests.support.a_class import criterion

FIELDS = ("id", "title", "check", "scenario", "message", "expected", "measured", "hint", "reproduce")
SOME = settings(suppress_health_check=[HealthCheck.too_slow])


def spoiled(texts: Iterator[str], status: str = "fail") -> GradingResult:
    """A result with the next of these texts in each field that holds one."""
    citations = (
        FileCitation(file=next(texts), line=3),
        EvidenceCitation(evidence=next(texts), topic=next(texts), from_ns=0, to_ns=10**9),
    )
    fields = {name: next(texts) for name in FIELDS}
    one = CriterionResult(**fields, status=Status(status), points=0, max_points=5, citations=citations)
    return result(
        submission=SubmissionInfo(
            id=next(texts), source=next(texts), commit=next(texts), digest=next(texts), package=next(texts)
        ),
        criteria=(one, criterion("other", Status.BLOCKED, 0, 5, message=next(texts))),
        notes=(Note(scenario=next(texts), actor=next(texts), kind="refused", text=next(texts)),),
        overrides=(decided(one, texts),),
        late=Lateness(note=next(texts), points_before=5, points=4, text=next(texts)),
        error=ErrorInfo(kind=next(texts), message=next(texts), hint=next(texts)),
        status="error",
    )


def decided(of_criterion: CriterionResult, texts: Iterator[str]) -> AppliedOverride:
    """Its person's texts are as long as they may be, and UTF-8."""
    comment, author = (next(texts).encode("utf-8", "backslashreplace").decode() for _ in range(2))
    return AppliedOverride(
        criterion=of_criterion.id,
        points=0,
        comment=comment[:COMMENT_CHARS],
        author=author[:AUTHOR_CHARS],
        automatic=Automatic(status=Status.PASS, points=5, message=next(texts)),
        was=Automatic(status=Status.FAIL, points=0, message=next(texts)),
        changed=True,
    )


def of(text: str) -> Iterator[str]:
    while True:
        yield text


@st.composite
def results(draw) -> GradingResult:
    """Each field has its own text; the sign at the end keeps a field from being left out for having none."""
    texts = draw(st.lists(TEXTS, min_size=4, max_size=12))
    some = (text + "a" for _ in range(100) for text in texts)
    return spoiled(some, draw(st.sampled_from([s.value for s in Status])))


HUGE = ("x" * 10**6, "\U000e0001" * 10**6, "&" * 10**6, "*" * 10**6, "/a.b " * 200_000)
