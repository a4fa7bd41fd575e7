"""The services that the grader offers in a run: their types, their answers as bytes, and what they were asked.

The arena answers by itself (`ros/services.py`) and says what came: each request becomes an event of `/grader/actor`.
"""

from __future__ import annotations

import base64
from typing import TYPE_CHECKING, Any

from grader.arena.session import ArenaSession
from grader.errors import ArenaError
from grader.evidence.events import MISFIT, OTHER_TYPE, ActorEvent
from grader.model.definition import other_fields
from grader.rubric.model import Served

if TYPE_CHECKING:
    from grader.evidence.message_values import ServiceTypes

FAILS = "the service cannot do it"
"""What a client of one that `fails` is told."""


class ServedServices:
    """Offers them, and notes what they are asked."""

    def __init__(self, served: tuple[Served, ...], arena: ArenaSession) -> None:
        self._served = {one.name: one for one in served if one.service}
        self._arena = arena
        self._types: dict[str, ServiceTypes] = {}
        arena.on_request = self._note_request
        arena.on_other_type = self._note_other_type

    def offer(self) -> None:
        """Register them with the master, before anything is started."""
        for one in self._served.values():
            self._offer(one)

    def _offer(self, one: Served) -> None:
        from grader.evidence.message_values import Moment  # noqa: PLC0415 - numpy, which not every run needs

        try:
            types = self._types[one.name] = self._find(one.type, one.definition)
            now_ns, total = self._arena.ros_now_ns(), len(one.in_turn)
            answers = [types.response.encode(a, Moment(n, total, now_ns)) for n, a in enumerate(one.in_turn)]
        except ValueError as error:
            self._refuse(one, str(error))
            return
        fields = {"service": one.name, "type": one.type, "md5sum": types.md5sum, "delay_s": one.delay_s}
        encoded = [base64.b64encode(answer).decode() for answer in answers]
        self._arena.send(
            do="serve", fields={**fields, "answers": encoded, "error": FAILS if one.fails else ""}
        )

    def _find(self, type_: str, text: str | None = None) -> ServiceTypes:
        """Return a type by the text of its `.srv` file. Raises ValueError where there is none, or it is none."""
        from grader.evidence.message_values import ServiceTypes  # noqa: PLC0415 - as above

        place = self._arena.place
        text = place.type_text(type_, "srv") if text is None else text
        if text is None:
            raise ValueError(f"there is no srv/{type_.partition('/')[2]}.srv")
        return ServiceTypes(type_, text, lambda name: place.type_text(name, "msg"))

    def _refuse(self, one: Served, error: str) -> None:
        """Only the student's own file may be other than the rubric thinks: else it is this machine that lacks it."""
        if one.definition is not None or not self._arena.place.is_own(one.type):
            raise ArenaError(f"the grader cannot offer {one.name}: {error}", hint="grader doctor")
        about = {"topic": one.name, "type": one.type}
        self._arena.note(ActorEvent(action="note", actor="grader", **about, detail=f"{MISFIT}{error}"))

    def _note_request(self, time_ns: int, fields: dict[str, Any]) -> None:
        one = self._served[fields["service"]]
        request = self._types[one.name].request.decode(base64.b64decode(fields["data"]))
        response = None if one.fails else one.in_turn[fields["answer"]]
        detail = f"the request is no {one.type}" if request is None else FAILS if one.fails else ""
        about = {"topic": one.name, "type": one.type, "value": {"request": request, "response": response}}
        event = ActorEvent(action="serve", actor=fields["caller"], **about, detail=detail)
        self._arena.note(event, time_ns)

    def _note_other_type(self, time_ns: int, fields: dict[str, Any]) -> None:
        """A client says no more than its type's MD5 sum: which type that is, files of the package and of ROS say."""
        one, place = self._served[fields["service"]], self._arena.place
        found = next((t for t in place.service_types() if self._has_sum(t, fields["md5sum"])), None)
        own = place.type_text(one.type, "srv") if found == one.type else None
        differs = other_fields(one.type, own, one.definition) if own and one.definition else ""
        about = {"topic": one.name, "type": found, "value": one.type}
        detail = f"{OTHER_TYPE}: {differs}" if differs else OTHER_TYPE
        self._arena.note(ActorEvent(action="note", actor=fields["caller"], **about, detail=detail), time_ns)

    def _has_sum(self, type_: str, md5sum: str) -> bool:
        try:
            return self._find(type_).md5sum == md5sum
        except ValueError:
            return False
