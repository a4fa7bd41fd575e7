"""An instructor's tests of the student's functions, while a run is recorded.

The tests run with the grader's rights, and the functions that they call in the sandbox. Each call and its answer are
events of `/grader/actor`, from which the tests are judged (`rubric/pytest_check.py`):

```text
pytest, with the grader's rights ⇄ socket ⇄ call_functions ⇄ stdin, stdout ⇄ ros/functions.py, in the sandbox ⇄ child
```
"""

from __future__ import annotations

import asyncio
import base64
import json
import socket
import time
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grader.arena.session import ArenaSession
from grader.evidence.events import ActorEvent

if TYPE_CHECKING:
    from grader.arena.steps import Tell

MARK = "@grader"
CALL_S = 15.0
"""The process in the sandbox gives an answer sooner, as long as it lives (`LIMIT_S` in `ros/functions.py`)."""
TOGETHER_S = 60.0
"""What all calls may take; later ones are not made, and count as too late."""
LATE, ENDED = json.dumps({"fault": "late"}), json.dumps({"fault": "ended"})


async def call_functions(process: str, tests: Path, arena: ArenaSession, tell: Tell) -> None:
    """Run the tests of the file, and call in the process what they call."""
    from grader.rubric.pytest_check import record_calls  # noqa: PLC0415 - few runs have tests

    tell(f"running {tests.name}")
    ours, theirs = socket.socketpair()
    reader, writer = await asyncio.open_connection(sock=ours)
    session = asyncio.ensure_future(asyncio.to_thread(record_calls, tests, theirs))
    try:
        left_s = TOGETHER_S
        for number in count():
            line = (await reader.readline()).decode().strip()
            if not line:
                break
            begun_s = time.monotonic()
            request = {"id": number, **json.loads(line)}
            # What is called with a change is tried only, and one that makes all tests pass is told
            noted = "change" not in request
            if noted:
                call = ActorEvent(action="type", actor="grader", value=json.dumps(request), detail=process)
                arena.note(call)
            told, late = "small_changes" in request, left_s <= 0
            answer = "{}" if told else LATE if late else await _call(process, request, arena)
            left_s -= time.monotonic() - begun_s
            if noted:
                arena.note(ActorEvent(action="answer", actor="grader", value=answer, detail=process))
            writer.write(f"{answer}\n".encode())
    finally:
        writer.close()
        await session


async def _call(process: str, request: dict[str, Any], arena: ArenaSession) -> str:
    """Return the answer as JSON."""
    line, printed = json.dumps(request), arena.watch_console(process)
    # A student's function prints as it likes: only what comes after this request can be its answer.
    printed.clear()
    data = base64.b64encode(f"{line}\n".encode()).decode()
    arena.send(do="type", name=process, data=data, record=None)
    begin = f"{MARK} {request['id']} "

    def found() -> str | None:
        return next((one.removeprefix(begin) for one in printed if one.startswith(begin)), None)

    await arena.wait(lambda: found() is not None or process in arena.live.ended, CALL_S)
    return found() or (ENDED if process in arena.live.ended else LATE)
