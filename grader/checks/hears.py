"""Whether a listener prints what it hears."""

from __future__ import annotations

from collections.abc import Sequence

from grader.checks.registry import check
from grader.checks.support.printed import (
    Line,
    Probe,
    in_order,
    places_of,
    printed_lines,
    probes_on,
    text_places,
)
from grader.checks.support.text import shown
from grader.checks.support.unheard import never_sent, not_printed
from grader.checks.support.wording import VALUE, in_words
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.record import Record
from grader.model.verdict import EvidenceCitation, Verdict, failed, passed
from grader.wording import plural


class HearsParams(Record):
    """`template` is what a line has to say of a text, `{value}` being the message: `I heard {value}`.

    Whether the template's own words are in capitals does not matter.
    """

    topic: str
    template: str = VALUE


@check("hears", params=HearsParams)
def hears(package: PackageFacts, run: Run, params: HearsParams) -> Verdict:
    """The listener prints each message that it hears.

    What it checks
        That every message on the topic appears in what the node prints or logs, in the order in which it
        was sent.

    Why it matters on a robot
        A subscriber that drops some messages, zero or negative numbers for instance, works on most days. On
        the robot those are the readings that matter.

    How it is measured
        The grader publishes messages that it makes up for this run, one text twice running. Each has to be
        on stdout, on stderr or on /rosout, at its time or later. Other words on the line do not matter; a
        number has to stand for itself (`12` is not in `127`). Where the lab gives the line's own words (`I
        heard …`), they have to stand before the message, in capitals or not.

    How to fix
        Subscribe with `rospy.Subscriber('<topic>', <Type>, callback)`, print `data.data` in the callback
        without any condition, and end with `rospy.spin()`. `rostopic pub <topic> <type> <value>` sends a
        message by hand.
    """
    form = "" if params.template == VALUE else f" as '{in_words(params.template)}'"
    expected = f"each message on {params.topic} is printed{form}, in order"
    probes = probes_on(run, params.topic)
    if not probes:
        return never_sent(package, run, params.topic).model_copy(update={"expected": expected})
    lines = printed_lines(run)
    places = places_of(run, probes, lines, params.template)
    missing = [] if places is None else [p for p, found in zip(probes, places, strict=True) if not found]
    if places is None:
        message = "it prints so many numbers that it cannot be told which of them it heard"
        verdict = failed(message, hint="print each number once, in the callback")
    elif missing:
        verdict = _other_words(probes, missing, lines, params) or not_printed(
            package, run, probes, missing, lines
        )
    elif not in_order(places):
        message = f"what came on {params.topic} is printed, but not in the order in which it was sent"
        verdict = failed(message, hint="print in the callback itself, not later from a variable")
    else:
        verdict = passed(f"prints each of the {len(probes)} messages on {params.topic}")
    first, last = (missing[0], missing[-1]) if missing else (probes[0], probes[-1])
    sent = EvidenceCitation(
        evidence=run.evidence, topic="/grader/actor", from_ns=first.at_ns, to_ns=last.at_ns
    )
    return verdict.model_copy(
        update={
            "expected": expected,
            "measured": f"{len(probes) - len(missing)} of {plural(len(probes), 'message')} printed",
            "citations": (*verdict.citations, sent),
        }
    )


def _other_words(
    probes: Sequence[Probe], missing: Sequence[Probe], lines: Sequence[Line], params: HearsParams
) -> Verdict | None:
    """All that is missing is printed, with other words around it; None where something is not there at all."""
    if params.template == VALUE or not all(text_places(missing, lines, VALUE)):
        return None
    said = [line.text for line in lines if _squeezed(missing[0].value) in _squeezed(line.text)]
    seen = f": it prints {shown(said[0])!r}" if said else ""
    wanted = in_words(params.template)
    message = f"{_how_many(missing, probes)} printed, but not as '{wanted}'{seen}"
    blank = params.template.removesuffix(VALUE).endswith(" ")
    glued = params.template.replace(f" {VALUE}", VALUE)
    if any(f'data: "{missing[0].value}"' in line for line in said):
        return failed(message, hint="print data.data, which is the text: data is the whole message around it")
    if blank and said and all(text_places(missing, lines, glued)):
        return failed(message, hint=f"put a blank between the words and the message: '{wanted}'")
    return failed(message, hint=f"print '{wanted}', with the handout's own words")


def _how_many(missing: Sequence[Probe], probes: Sequence[Probe]) -> str:
    if len(missing) == len(probes):
        return "each message is"
    return f"{len(missing)} of {plural(len(probes), 'message')} are"


def _squeezed(text: object) -> str:
    return "".join(str(text).split())
