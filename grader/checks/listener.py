"""Whether a listener prints what it hears, and if not, why."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated

from grader.checks.registry import Refers, check
from grader.checks.support.console_output import (
    Line,
    Probe,
    in_order,
    numbers_in,
    places_of,
    printed_lines,
    probes_on,
    text_places,
)
from grader.checks.support.exceptions import NUMBER_OF_PARTS
from grader.checks.support.exit_causes import explain_early_end, explain_error
from grader.checks.support.processes import (
    GlobalName,
    copied_topic,
    is_written_as,
    lives,
    named_at,
    not_started,
    run_slips,
    where_named,
)
from grader.checks.support.text import (
    IN_OWN_WORDS,
    OTHER_WORDS_SHARE,
    SPIN,
    TYPE_SLOT,
    VALUE,
    in_words,
    near_names,
    python_or_cpp,
    refuse_others,
    rename_if_meant,
    shown,
    subscriber,
    unfilled,
)
from grader.checks.support.topics import (
    call_in_comment,
    cite,
    files_that_run,
    misfit,
    refused_type,
    run_slip,
    topics_with,
)
from grader.evidence.run import Run
from grader.model.package import PackageFacts
from grader.model.python_slip import PythonSlip, SlipKind
from grader.model.record import Record
from grader.model.verdict import Verdict, failed, failed_or_blocked, grade_again, passed
from grader.wording import is_one_edit, join_words, plural, significant

UNCALLED: tuple[SlipKind, ...] = ("never-reached", "never-called")
"""Why a line of a script is never run; a function that nothing calls may also be a spare one."""
CALLBACK_HINT = (
    "print the message's .data in the callback, without a condition and with nothing slow beside it; "
    f"end with {SPIN}"
)


class HearsParams(Record):
    """A topic that the grader publishes on, and what the listener says of each message."""

    topic: Annotated[GlobalName, Refers("sent")]
    """A topic on which a probe or a step of the scenario sends, with its slash."""
    template: Annotated[str, refuse_others(VALUE)] = VALUE
    """What a line has to say about a message, where `{value}` is its text: `I heard {value}`. Capitals in the
    template's own words do not matter."""


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
        The grader publishes messages that it makes up for this run, one of them twice in a row. Each has to
        appear on stdout, on stderr or on /rosout, when it is sent or later. Other words on the line do not
        matter; a number has to stand alone (`12` is not in `127`). If the lab gives the line's own words
        (`I heard …`), they have to come before the message, in capitals or not; a message that is printed
        with other words earns half of its share.

    How to fix
        Subscribe with `rospy.Subscriber('<topic>', <Type>, callback)`, print `data.data` in the callback
        without any condition, and end with `rospy.spin()`. `rostopic pub <topic> <type> <value>` sends a
        message by hand.
    """
    form = "" if params.template == VALUE else f" as '{in_words(params.template)}'"
    expected = f"each message on {params.topic} is printed{form}, in order"
    probes = probes_on(run, params.topic)
    if not probes:
        return never_sent(package, run, params.topic).about(expected=expected)
    lines = printed_lines(run)
    places = places_of(run, probes, lines, params.template)
    missing = [] if places is None else [p for p, found in zip(probes, places, strict=True) if not found]
    if places is None:
        message = "it prints so many numbers that there is no telling which of them it heard"
        verdict = failed(message, hint="print each number once, in the callback")
    elif missing:
        verdict = _judge_missing(package, run, probes, missing, params)
    elif not in_order(places):
        message = f"what came on {params.topic} is printed, but not in the order in which it was sent"
        hint = "print in the callback itself, not later from a variable"
        verdict = failed(message, hint=hint).if_repeated()
    else:
        verdict = passed(f"prints each of the {len(probes)} messages on {params.topic}")
    first, last = (missing[0], missing[-1]) if missing else (probes[0], probes[-1])
    sent = cite(run, "/grader/actor", first.at_ns, last.at_ns)
    count = f"{len(probes) - len(missing)} of {plural(len(probes), 'message')} printed"
    return verdict.about(expected=expected, measured=verdict.measured or count, citations=(sent,))


def _misspelt_word(said: str, template: str) -> tuple[str, str] | None:
    """Return the only word of the template that a line has not, and what it has with one letter otherwise."""
    asked, words = (re.findall(r"[^\W\d_]+", text) for text in (template.replace(VALUE, ""), said))
    absent = [word for word in asked if word.casefold() not in map(str.casefold, words)]
    near = [(a, b) for a in absent for b in words if len(a) > 2 and is_one_edit(a.casefold(), b.casefold())]
    return near[0] if len(absent) == len(near) == 1 else None


def _other_words(
    probes: Sequence[Probe], missing: Sequence[Probe], lines: Sequence[Line], params: HearsParams
) -> Verdict | None:
    """All that is missing is printed in other words: half of its points. None where something is not there at all."""
    # A bare value has no words around it that could be others.
    if params.template == VALUE or not all(text_places(missing, lines, VALUE)):
        return None
    said = [line.text for line in lines if _without_blanks(missing[0].value) in _without_blanks(line.text)]
    seen = f": it prints {shown(said[0])!r}" if said else ""
    wanted = in_words(params.template)
    message = f"{_how_many(missing, probes)} printed, but not as '{wanted}'{seen}"
    blank = params.template.removesuffix(VALUE).endswith(" ")
    glued = params.template.replace(f" {VALUE}", VALUE)
    hint = f"print '{wanted}', {IN_OWN_WORDS}"
    # A String that is printed whole comes with the name of its field.
    if any(f'data: "{missing[0].value}"' in line for line in said):
        hint = f"print '{wanted}': of the message only its .data, which is the text"
    elif blank and said and all(text_places(missing, lines, glued)):
        hint = f"put a space between the words and the message: '{wanted}'"
    elif said and (mark := _mark_between(said[0], missing[0], params.template)):
        hint = f"print '{wanted}', with ' ' in place of {mark!r} between the words and the message"
        if place := unfilled(mark):
            hint = f"print '{wanted}': {place}{python_or_cpp(', in place of the + or the comma there', '')}"
    elif said and (misspelt := _misspelt_word(said[0], params.template)):
        hint = f"print '{wanted}': {misspelt[0]}, not {misspelt[1]}"
    # What is printed right counts in full, the rest by the share of other words.
    share = 1 - (1 - OTHER_WORDS_SHARE) * len(missing) / len(probes)
    all_of = plural(len(probes), "message")
    measured = f"{len(probes)} of {all_of} printed, {len(missing)} of them in other words"
    verdict = failed(message, hint=hint, measured=measured).in_part(share, "what is printed of each message")
    return verdict.about(said="".join(said[:1]))


def _mark_between(said: str, probe: Probe, template: str) -> str:
    """Return what stands between the template's words and the message on a line, "" if it is not just marks."""
    before, _, _ = said.partition(str(probe.value))
    _, words, mark = before.casefold().rpartition(template.partition(VALUE)[0].strip().casefold())
    # The `s` of a `%s` is a letter, yet no word.
    plain = not any(c.isalnum() for c in mark.replace(UNFILLED, ""))
    return mark if words and mark.strip() and plain else ""


UNFILLED = "%s"
"""What is printed as it is where the message is only joined to it, or printed behind it."""


def _some_in_other_words(
    probes: Sequence[Probe], missing: Sequence[Probe], lines: Sequence[Line], params: HearsParams
) -> Verdict | None:
    """Some of what is missing is printed, with other words around it. None where nothing is."""
    # A number may stand on any line by chance, so finding it proves nothing.
    if params.template == VALUE or any(isinstance(p.value, int) for p in missing):
        return None
    lost = [p for p, found in zip(missing, text_places(missing, lines, VALUE), strict=True) if not found]
    # Where none of them is printed, other words are not the reason.
    if len(lost) == len(missing):
        return None
    message = (
        f"{len(lost)} of {plural(len(probes), 'message')} not printed, the first of them {lost[0].value!r}; "
        f"what is printed is not '{in_words(params.template)}'"
    )
    return failed(message, hint=f"{CALLBACK_HINT}; print '{in_words(params.template)}'")


def _how_many(missing: Sequence[Probe], probes: Sequence[Probe]) -> str:
    if len(missing) == len(probes):
        return "each message is"
    return f"{len(missing)} of {plural(len(probes), 'message')} are"


def _without_blanks(text: object) -> str:
    return "".join(str(text).split())


def never_sent(package: PackageFacts, run: Run, topic: str) -> Verdict:
    """The grader sends when the node has subscribed; it never did, or it was not there."""
    if not lives(run):
        return not_started("the listener").about(measured="not started")
    subscribed = topics_with(run, "subscribers")
    measured = f"subscribed to {join_words(subscribed)}" if subscribed else "no subscription"
    differing = refused_type(run, topic, package)
    end = explain_early_end(package, run)
    # A refused type is a cause of its own, whatever ended the node later.
    if end is not None and differing is None:
        message = f"the node ended before any message was sent on {topic}: {end.cause}"
        return end.verdict(failed_or_blocked, message, measured="ended")
    verdict = differing or misfit(run, topic)
    slip = run_slip(package, run, "unregistered")
    if verdict is None and slip is not None:
        verdict = _taken_off(f"the node stops listening to {topic} before anything is sent", slip)
    elif verdict is None and (
        closed := [s for s in run_slips(package, run, "wrong-value") if s.name == "closed"]
    ):
        verdict = _taken_off(f"the node stops listening to {topic} before anything is sent", closed[0])
    # The grader sends once it sees the subscription, so this is not the node's fault.
    elif verdict is None and topic in subscribed:
        message = f"the node subscribed to {topic}, but the grader sent nothing"
        verdict = grade_again(message)
    elif verdict is None and (
        slip := run_slip(package, run, *(UNCALLED if not subscribed else UNCALLED[:1]))
    ):
        message = f"the node never subscribes to {topic}: {slip.message}"
        verdict = failed(message, hint=f"in {slip.file}, {slip.fix}", citations=(slip.place,))
    elif verdict is None:
        verdict = _without_subscriber(package, run, topic, subscribed)
        verdict = verdict or _never_subscribed(package, run, topic, subscribed)
    return verdict.about(measured=measured, citations=(cite(run, "/grader/graph"),))


def _without_subscriber(
    package: PackageFacts, run: Run, topic: str, subscribed: Sequence[str]
) -> Verdict | None:
    """The call that subscribes is in a comment, or it is missing, and a function that reads messages waits for it."""
    spare = run_slip(package, run, "callback-missing")
    used = bool(near_names(topic, subscribed)) or topic in topics_with(run, "publishers")
    spare = None if used or spare is None or not spare.name else spare
    gone = call_in_comment(package, run, "Subscriber") if spare or not subscribed else None
    slip = gone or spare
    if slip is None:
        return None
    message = f"the node never subscribes to {topic}: in {slip.file}, line {slip.line}, {slip.message}"
    if slip is gone:
        return failed(message, hint=slip.fix, citations=(slip.place,))
    message = (
        f"the node never subscribes to {topic}: {slip.message}, which line {slip.line} of {slip.file} defines"
    )
    fix = slip.fix.replace("(…, ", f"('{topic}', {TYPE_SLOT}, ")
    return failed(message, hint=f"in {slip.file}, {fix}", citations=(slip.place,))


def _never_subscribed(package: PackageFacts, run: Run, topic: str, subscribed: Sequence[str]) -> Verdict:
    """The node subscribes to other topics, or to none; one that publishes instead may be a copy of the talker."""
    near = near_names(topic, subscribed)
    other = f"; it subscribes to {join_words(near or subscribed)}" if subscribed else ""
    spare = run_slip(package, run, "callback-missing")
    callback = (spare.name if spare else "") or "callback"
    call = subscriber(topic, f"{TYPE_SLOT}, {callback}")
    # A topic on which the grader sends is meant to be there, so it is none to rename or to swap.
    spares = [one for one in subscribed if not probes_on(run, one)]
    meant = near or (subscribed if len(subscribed) == 1 else spares if len(spares) == 1 else ())
    end: SlipKind = "subscriber" if subscribed else "publisher"
    name = next(iter(meant), "" if subscribed else topic)
    cited = named_at(package, run, end, name) if name else ()
    hint = f"name the topic {topic} {where_named(cited, call)}" if near else f"add {call}"
    publishes = topic in topics_with(run, "publishers")
    if not subscribed and publishes:
        other = f", but publishes on {topic}, as a talker does"
        above = "" if spare and spare.name else f" with `def {callback}(msg):` above it,"
        hint = f"write {call} in place of the publisher,{above} and `rospy.spin()` in place of the loop"
    elif len(subscribed) == len(spares) == 1 and publishes and not near:
        other = f"{other}, and publishes on {topic}"
        hint = f"swap {topic} and {subscribed[0]}: it should subscribe to {topic}, and not publish on it"
    elif copied := copied_topic(package, run, "subscriber"):
        other = f"{other}, on {copied}"
        hint = f"write {topic} on the one of {copied} whose callback is for it"
    elif len(spares) == 1 and not near:
        hint += rename_if_meant(spares)
    verdict = failed(f"the node never subscribes to {topic}{other}", hint=hint, citations=cited)
    return verdict.about(said=" ".join(meant))


def _taken_off(message: str, slip: PythonSlip, more: str = "") -> Verdict:
    """Return the loss by the line that a slip names; `more` is why its fix helps."""
    hint = f"in {slip.file}, {slip.fix}{more}"
    return failed(f"{message}: {slip.message} ({slip.file})", hint=hint, citations=(slip.place,))


def _by_subscriber(
    package: PackageFacts, run: Run, probes: Sequence[Probe], missing: Sequence[Probe]
) -> Verdict | None:
    """A loop made another Subscriber in each turn, the only one was taken off, or its callback was still busy."""
    lost = f"{len(missing)} of {plural(len(probes), 'message')} not printed"
    if slip := run_slip(package, run, "subscribed-again"):
        return _taken_off(lost, slip)
    slip = run_slip(package, run, "unregistered")
    # Taken off, it hears nothing from then on: what is missing has to be the last ones.
    if slip is not None and list(missing) == list(probes[-len(missing) :]):
        return _taken_off(lost, slip)
    slip = run_slip(package, run, "stuck")
    if slip is not None and len(missing) == len(probes):
        return _taken_off(lost, slip)
    slip = run_slip(package, run, "callback-waits")
    # A callback that waits holds up later messages: where none at all is printed, there is another reason.
    if slip is None or len(missing) == len(probes):
        return None
    return _taken_off(f"{lost} in time", slip, ": no further message is read until the callback ends")


def _judge_missing(
    package: PackageFacts,
    run: Run,
    probes: Sequence[Probe],
    missing: Sequence[Probe],
    params: HearsParams,
) -> Verdict:
    """Some or all of what was sent was not printed: the likeliest reason that shows."""
    lines = printed_lines(run)
    # What is proven comes first; the last ones only read the pattern of what is missing.
    verdict = (
        _other_words(probes, missing, lines, params)
        or _judge_error(package, run)
        or _by_subscriber(package, run, probes, missing)
        or _by_callback(package, run, probes, missing, params)
        or _some_numbers(probes, missing, lines)
        or _only_again(probes, missing)
        or _some_in_other_words(probes, missing, lines, params)
        or _by_number(probes, missing, lines, _print_in_comment(package, run))
    )
    if verdict.hint != CALLBACK_HINT or params.template == VALUE:
        return verdict
    hint = CALLBACK_HINT.replace("the message's .data", f"'{in_words(params.template)}'", 1)
    return verdict.model_copy(update={"hint": hint})


def _print_in_comment(package: PackageFacts, run: Run) -> PythonSlip | None:
    found = (call_in_comment(package, run, call) for call in ("loginfo", "print", "logwarn", "logerr"))
    return next(filter(None, found), None)


def _judge_error(package: PackageFacts, run: Run) -> Verdict | None:
    """An error in the callback, which rospy reports and outlives, or the node's end."""
    if end := explain_early_end(package, run):
        return end.verdict(failed, f"the node ended before it had printed everything: {end.cause}")
    if twice := run_slip(package, run, "defined-twice"):
        return failed(f"a callback never runs: {twice.message}", hint=twice.fix, citations=(twice.place,))
    if end := explain_error(package, run):
        verdict = end.verdict(failed, f"an error stops the node from printing: {end.cause}")
        all_of_it = f"{NUMBER_OF_PARTS}, and each is to be printed"
        return verdict.model_copy(update={"hint": verdict.hint.replace(NUMBER_OF_PARTS, all_of_it)})
    slip = run_slip(package, run, "callback-called", "callback-missing")
    # A function that no Subscriber is given may be for another topic than the one that was sent on.
    if slip is not None and not (slip.name and slip.kind == "callback-missing"):
        message = f"ROS calls no function of the script for a message: {slip.message}"
        return failed(message, hint=slip.fix, citations=(slip.place,))
    return None


def _some_numbers(probes: Sequence[Probe], missing: Sequence[Probe], lines: Sequence[Line]) -> Verdict | None:
    """Typical ways to lose zero, or all negative numbers, and print the others."""
    values = [p.value for p in missing if isinstance(p.value, int)]
    heard = {p.value for p in probes if isinstance(p.value, int) and p not in missing}
    # A value that is printed one time and not the other is not lost for its sign.
    if not values or not heard or heard.intersection(values):
        return None
    if set(values) == {0}:
        return failed("0 is not printed", hint="0 counts as false: print without `if data.data:`")
    # Only where exactly the negative numbers are missing is the sign the reason.
    if any(v >= 0 for v in values) or any(v < 0 for v in heard):
        return None
    printed = {n for line in lines for n in numbers_in(line.text)}
    # An Int8 that is read as a byte without a sign is 256 more.
    as_unsigned = all(v + 256 in printed for v in values)
    how = (
        f"are printed as positive ones, {values[0]} as {values[0] + 256}"
        if as_unsigned
        else "are not printed at all"
    )
    message = f"negative numbers {how}" + ("" if as_unsigned else f", {values[0]} for instance")
    return failed(message, hint="print the message's .data as it is: an Int8 goes from -128 to 127")


def _only_again(probes: Sequence[Probe], missing: Sequence[Probe]) -> Verdict | None:
    printed = {str(p.value) for p in probes if p not in missing}
    if not all(str(p.value) in printed for p in missing):
        return None
    message = f"{missing[0].value!r} came twice but was printed only once"
    return failed(message, hint="print every message in the callback, even one that came before")


def _by_callback(
    package: PackageFacts, run: Run, probes: Sequence[Probe], missing: Sequence[Probe], params: HearsParams
) -> Verdict | None:
    """What the source of the topic's callback says of it: it prints nothing of a message, or not each of them."""
    kinds, files = ("not-printed", "printed-in-part"), files_that_run(package, run)
    told = [s for s in package.slips if s.kind in kinds and s.file in files]
    # a name in a variable is not known
    found = [s for s in told if not s.name or is_written_as(s.name, params.topic)]
    if not found and len(missing) == len(probes):
        found = [s for s in package.slips if s.kind == "swallows" and s.file in files]
    few = 2 * len(missing) < len(probes)  # another number may happen to be one that was sent
    if len(found) != 1 or (found[0].kind == "not-printed" and few):
        return None
    slip, lines, gone = found[0], printed_lines(run), _print_in_comment(package, run)
    # A print further down that is commented out is the likelier reason.
    if gone is not None and gone.file == slip.file and gone.line > slip.line:
        return None
    verdict = _some_numbers(probes, missing, lines) or _only_again(probes, missing)
    verdict = verdict or _by_number(probes, missing, lines, None)
    form = f", as '{in_words(params.template)}'" if params.template != VALUE and "print" in slip.fix else ""
    hint = f"in {slip.file}, {slip.fix}{form}"
    return verdict.explained(f"in {slip.file}, {slip.message}", hint, (slip.place,))


def _by_number(
    probes: Sequence[Probe], missing: Sequence[Probe], lines: Sequence[Line], gone: PythonSlip | None
) -> Verdict:
    """Nothing, only the first, or some. `gone` is the call that prints, where it is commented out."""
    after = [line.text for line in lines if line.at_ns >= probes[0].at_ns and line.text.strip()]
    if len(missing) == len(probes):
        seen = f"it prints {shown(after[0]).strip(' :')!r}" if after else "it prints nothing at all"
        sent = f"; {probes[0].value!r} was sent first" if isinstance(probes[0].value, str) else ""
        message = f"none of the messages that were sent was printed{sent}; {seen}"
        if gone is not None:
            message = f"{message}; in {gone.file}, line {gone.line}, {gone.message}"
            return failed(message, hint=gone.fix, citations=(gone.place,))
        return failed(message, hint=CALLBACK_HINT).about(said="".join(after[:1]))
    if len(missing) == len(probes) - 1 and missing[0] is not probes[0]:
        waits = python_or_cpp("wait_for_message(…)", "waitForMessage(…)")
        hint = (
            f"print each message in a callback, and end with {SPIN}; {waits} would wait for one message only"
        )
        return failed("only the first message is printed", hint=hint)
    value = missing[0].value
    first = significant(value) if isinstance(value, int) else repr(value)
    message = f"{len(missing)} of {plural(len(probes), 'message')} not printed, the first of them {first}"
    # Messages missing here and there may be the machine's doing: another run has to show it, too.
    return failed(message, hint=CALLBACK_HINT).if_repeated()
