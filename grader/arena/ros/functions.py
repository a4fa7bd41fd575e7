"""Calls functions of a package's Python files, one JSON request a line on stdin: `functions.py PACKAGE_FOLDER`.

The answers are lines on stdout, `@grader` and JSON. A request has `id`, `test`, `file`, `function`, `args` and
`kwargs`. Each test has a child process of its own, which imports the files. What it prints goes to stderr. With
`change`, a number, the function is called as the small change of that number makes it.

Standard library only, Python 3.8. This process imports nothing of the package's.
"""

import contextlib
import importlib.util
import json
import os
import select
import signal
import sys
import time
import traceback
from pathlib import Path

from small_changes import change

MARK = "@grader"
LIMIT_S = 10.0
CHANGED_LIMIT_S = 1.0
ANSWER_BYTES_MAX = 3900
MESSAGE_CHARS = 300
OTHERS_MAX = 8


def main(folder):
    # The arena stops programs by SIGINT: a KeyboardInterrupt would leave a traceback in the log
    signal.signal(signal.SIGINT, lambda *_: os._exit(0))
    child = test = None
    for line in sys.stdin:
        request = json.loads(line)
        # A new process for each test: what one test changes in a module must not reach the next
        about = request["test"], request.get("change")
        if child is None or child.ended or about != test:
            if child is not None:
                child.end()
            child, test = Child(folder), about
        limit_s = CHANGED_LIMIT_S if "change" in request else LIMIT_S
        print(MARK, request["id"], child.answer(line, limit_s), flush=True)


class Child:
    """A process that imports the package's files, and calls what it is asked to."""

    def __init__(self, folder):
        requests, self._requests = os.pipe()
        self._answers, answers = os.pipe()
        self.ended = False
        # A process and not a thread: only a process can be stopped in the middle of an endless loop
        self._pid = os.fork()
        if self._pid == 0:
            os.close(self._requests)
            os.close(self._answers)
            serve(folder, requests, answers)
        os.close(requests)
        os.close(answers)

    def answer(self, line, limit_s):
        """Return the answer as JSON. Without one, the child has ended, or is ended."""
        data, until_s = b"", time.monotonic() + limit_s
        with contextlib.suppress(BrokenPipeError):  # the answers end, too
            os.write(self._requests, line.encode())
        # The child writes as it likes: part of a line, nothing, or too much
        while not data.endswith(b"\n"):
            left_s = until_s - time.monotonic()
            if left_s <= 0 or not select.select([self._answers], [], [], left_s)[0]:
                return self._fault("late")
            chunk = os.read(self._answers, 4096)
            data += chunk
            if not chunk:
                return self._fault("ended")
            if len(data) > ANSWER_BYTES_MAX:
                return self._fault("long")
        return data.decode("ascii", "replace").strip()

    def _fault(self, fault):
        self.end()
        return json.dumps({"fault": fault})

    def end(self):
        if not self.ended:
            self.ended = True
            os.kill(self._pid, signal.SIGKILL)
            os.waitpid(self._pid, 0)
            os.close(self._requests)
            os.close(self._answers)


def serve(folder, requests, answers):
    """Answer requests until there are none. What the package prints goes to stderr; its stdin is empty."""
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    # Only answers may be on stdout, or a `print` of the package's could pass for one
    os.dup2(2, 1)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    # Otherwise a script that reads its arguments would find the folder in them
    sys.argv = [""]
    modules, changed = {}, {}
    with os.fdopen(requests) as lines:
        for line in lines:
            # `json.dumps` writes ASCII only and no line ends, so that an answer is one line
            found = answer(folder, json.loads(line), modules, changed)
            data = json.dumps(dict(found, changed=changed) if changed else found).encode()
            os.write(answers, data + b"\n")
    os._exit(0)


def answer(folder, request, modules, changed):  # noqa: PLR0911 - each answer is one
    """Return what came of the call; the small change that it was made with, if any, is noted in `changed`."""
    name, function, source = request["file"], request["function"], None
    try:
        if name not in modules:
            path = find(folder, name)
            if path is None:
                return {"missing": "the package has no " + name}
            try:
                if "change" in request:
                    changed.update(change(path, function, request["change"]))
                    source = changed.pop("source", None)
                    if source is None:
                        return {"missing": "no more changes"}
                modules[name] = load(path, source)
            except BaseException as error:  # noqa: BLE001 - as below
                return dict(describe(error, folder), imports=name)
        called = getattr(modules[name], function, None)
        if not callable(called):
            return {
                "missing": "{} has no function {}{}".format(name, function, others(modules[name], function))
            }
        given = called(*decode(request["args"]), **dict(decode(request["kwargs"])))
    except BaseException as error:  # noqa: BLE001 - whatever the package's code raises, SystemExit too
        return describe(error, folder)
    try:
        return {"value": encode(given)}
    except Exception:  # noqa: BLE001 - a class of their own may raise anything
        return {"other": type(given).__name__[:MESSAGE_CHARS]}


def find(folder, name):
    """Return the file at its place, or the one of that name that lies least deep."""
    if (Path(folder) / name).is_file():
        return Path(folder) / name
    found = sorted(Path(folder).rglob(Path(name).name), key=lambda path: (len(path.parts), str(path)))
    return next((path for path in found if path.is_file()), None)


def load(path, source=None):
    """Import the file, which finds what lies beside it. Its name is not `__main__`. `source` takes the place of what it
    holds."""
    # As Python does for a script that it runs
    sys.path.insert(0, str(path.parent))
    spec = importlib.util.spec_from_file_location(path.stem, str(path))
    module = importlib.util.module_from_spec(spec)
    # Before it is executed, as `import` does, for modules that import each other
    sys.modules[path.stem] = module
    if source is None:
        spec.loader.exec_module(module)
    else:
        exec(compile(source, str(path), "exec"), module.__dict__)  # noqa: S102 - in the sandbox
    return module


def others(module, asked):
    """Return which functions the file has instead, with their lines; the one alone that differs by its capitals."""
    given = [f for f in vars(module).values() if hasattr(f, "__code__")]
    found = [f for f in given if f.__module__ == module.__name__]
    for f in found:
        if f.__name__.lower() == asked.lower():
            return "; line {} calls it {}".format(f.__code__.co_firstlineno, f.__name__)
    shown = ["{} (line {})".format(f.__name__, f.__code__.co_firstlineno) for f in found[:OTHERS_MAX]]
    return ", only " + ", ".join(shown) if shown else ""


def describe(error, folder):
    """Return what was raised, and the last line of the package's own that took part."""
    frames = [(f.filename, f.lineno, f.line or "") for f in traceback.extract_tb(error.__traceback__)]
    # A file that does not compile was never run, so that no frame names it
    if isinstance(error, SyntaxError) and error.filename:
        frames.append((error.filename, error.lineno, (error.text or "").strip()))
    # Students can change only their own lines, not those of a library that raised it
    own = [frame for frame in frames if frame[0].startswith(folder + os.sep)]
    # A check that expects ValueError accepts a class of their own that is derived from it
    builtin = next(base.__name__ for base in type(error).__mro__ if base.__module__ == "builtins")
    try:
        message = str(error).strip().split("\n")[0]
    except Exception:  # noqa: BLE001 - their own class
        message = ""
    about = {"raised": type(error).__name__, "builtin": builtin, "message": message[:MESSAGE_CHARS]}
    if not own:
        return about
    file, line, source = own[-1]
    return dict(about, file=os.path.relpath(file, folder), line=line, source=source[:MESSAGE_CHARS])


def encode(value):
    """Return the value as JSON has it, tuples, sets and dicts with their names. Raises TypeError."""
    if hasattr(value, "tolist"):  # numpy's
        value = value.tolist()
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, list):
        return [encode(item) for item in value]
    if isinstance(value, tuple):
        return {"tuple": [encode(item) for item in value]}
    if isinstance(value, (set, frozenset)):
        return {"set": [encode(item) for item in value]}
    # Known by what genpy gives each message, as nothing of ROS is imported here
    if hasattr(value, "__slots__") and hasattr(value, "_md5sum"):  # a message
        value = {name: getattr(value, name) for name in value.__slots__}
    if isinstance(value, dict):
        return {"dict": [[encode(key), encode(item)] for key, item in value.items()]}
    raise TypeError


def decode(value):
    """Reverse `encode`."""
    if isinstance(value, list):
        return [decode(item) for item in value]
    if not isinstance(value, dict):
        return value
    ((kind, items),) = value.items()
    return {"tuple": tuple, "set": set, "dict": dict}[kind](decode(items))


if __name__ == "__main__":
    main(sys.argv[1])
