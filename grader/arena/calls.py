"""Service calls of a scenario: the request's bytes are the grader's, the answer is decoded by it."""

from __future__ import annotations

import base64
from collections.abc import Callable
from pathlib import Path

from grader.arena.process_environment import Place
from grader.arena.recorded import read_untrusted
from grader.arena.session import ArenaSession
from grader.evidence.events import ActorEvent
from grader.rubric.model import Call, Scenario

ANSWER_S = 10.0
TEXT_BYTES_MAX = 64 << 10

Tell = Callable[[str], None]


async def call_services(scenario: Scenario, arena: ArenaSession, tell: Tell) -> None:
    """Call each service once it is offered; requests and answers are events of `/grader/actor`."""
    for call in scenario.calls:
        tell(f"waiting for the service {call.service}")
        if await _offered(call.service, arena, scenario.until.first_message_s):
            await arena.wait(lambda: not arena.live.running, call.delay_s)
            tell(f"calling {call.service}")
            await _call(call, arena)


async def _offered(service: str, arena: ArenaSession, patience_s: float) -> bool:
    live = arena.live
    await arena.wait(lambda: service in live.services or not live.running, patience_s)
    return service in live.services


async def _call(call: Call, arena: ArenaSession) -> None:
    from grader.evidence.decode import ServiceType  # noqa: PLC0415 - numpy, which not every run needs

    try:
        type_ = ServiceType(call.type, _text(call.type, "srv", arena.place) or "", _messages(arena.place))
        data = base64.b64encode(type_.encode_request(call.request)).decode()
    except ValueError as error:
        arena.note(_answer(call, None, f"the grader could not call it: {error}"))
        return
    record = {
        "action": "call",
        "actor": "grader",
        "topic": call.service,
        "type": call.type,
        "value": call.request,
    }
    answer = await arena.call(ANSWER_S, service=call.service, type=call.type, data=data, record=record)
    if "data" not in answer:
        arena.note(_answer(call, None, answer["error"]))
        return
    value = type_.decode_response(base64.b64decode(answer["data"]))
    arena.note(_answer(call, value, "" if value is not None else f"the answer is no {call.type}"))


def _answer(call: Call, value: object, detail: str) -> ActorEvent:
    return ActorEvent(
        action="answer", actor="grader", topic=call.service, type=call.type, value=value, detail=detail
    )


def _messages(place: Place) -> Callable[[str], str | None]:
    return lambda type_: _text(type_, "msg", place)


def _text(type_: str, kind: str, place: Place) -> str | None:
    """The text of `<package>/<kind>/<Name>.<kind>`: the student's own, ROS's, or a stand-in's."""
    package, _, name = type_.partition("/")
    own = place.workspace.repaired / package
    for folder in (own, *(Path(p) / package for p in place.share_folders)):
        data = read_untrusted(folder / kind / f"{name}.{kind}", TEXT_BYTES_MAX + 1)
        if data is not None and len(data) > TEXT_BYTES_MAX:
            raise ValueError(f"{name}.{kind} is larger than {TEXT_BYTES_MAX >> 10} kB")
        if data is not None:
            return data.decode(errors="replace")
    return None
