"""Starts a process tree: the programs that build its wall, and behind it the shell that becomes what is to run.

Programs of the machine that stand outside (setpriv, prlimit, bwrap) get a constant environment and constant arguments,
in a folder of the grader's. What comes from a submission, its variables and arguments, lies in a file in memory that
only the shell behind the wall reads, once it has leave. bwrap reads its own arguments from a pipe: they come when the
tree belongs to its control groups, so nothing of it ever runs outside of them.
"""

import base64
import contextlib
import os
import socket
import subprocess

HOST_ENV = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "LANG": "C.UTF-8"}
NOWHERE = "/"
FILTER = "seccomp"


class Launched:
    """`popen` is the outermost program. `lifeline` says that the shell is there, and takes the leave to go on; `info`
    is where bubblewrap tells of itself, `collect` what is handed over: descriptors, or None."""

    def __init__(self, popen, lifeline, info, collect, scratches):
        self.popen = popen
        self.lifeline = lifeline
        self.info = info
        self.collect = collect
        self.scratches = scratches


def launch(spec, stage, groups, scratches=()):
    """Start what `spec` says (grader/arena/process_environment.py, `ProcessEnvironment.spec`), on the files of an
    earlier life if it had one. Raises OSError."""
    with contextlib.ExitStack() as ours, contextlib.ExitStack() as theirs:
        lifeline, far = socket.socketpair()
        ours.callback(lifeline.close)
        theirs.callback(far.close)
        fds = {"lifeline": far.fileno()}
        collect = _pipe(ours, theirs, fds, "collect") if spec["collect"] else None
        fds["words"] = _file(theirs, "words", _words(spec, fds))
        info, gate, arguments = None, None, []
        if spec["wall"] is not None:
            scratches = scratches or _scratches(ours, stage, spec["wall"])
            info = _pipe(ours, theirs, fds, "info")
            if spec["filter"]:
                fds[FILTER] = _file(theirs, FILTER, base64.b64decode(spec["filter"]))
            arguments = list(_arguments(spec["wall"], stage, iter(scratches), fds))
            fds["args"], gate = _gate(theirs)
        shell = [_filled_in(word, fds) for word in spec["shell"]]
        walled = [spec["bwrap"], "--args", str(fds["args"]), "--"] if gate is not None else []
        popen = subprocess.Popen(
            [*spec["outer"], *walled, *shell],
            stdin=subprocess.PIPE if spec["stdin"] else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=HOST_ENV,
            cwd=stage.folder if gate is not None else NOWHERE,
            pass_fds=list(fds.values()),
            # Signals for its group (Ctrl-C) reach the tree alone.
            start_new_session=True,
        )
        _go_first(popen.pid)
        if groups is not None:
            groups.take([popen.pid])
        if gate is not None:
            with contextlib.suppress(BrokenPipeError):  # it has ended already, and said why
                os.write(gate, _join_words(arguments))
        # Started: our ends stay open. On any error before this line they are closed with theirs.
        ours.pop_all()
    return Launched(popen, lifeline, info, collect, scratches)


def _go_first(pid):
    """Where the machine has no memory left, this tree ends before the grader does."""
    with contextlib.suppress(OSError), open("/proc/{}/oom_score_adj".format(pid), "w") as file:
        file.write("1000")


def _words(spec, fds):
    """Return how many variables there are, the variables, and what is to be run: `place.HEAD` reads it."""
    variables = ["{}={}".format(name, value) for name, value in spec["env"].items()]
    # Only the grader's own commands have placeholders: a student's words are passed on as they are.
    argv = [_filled_in(word, fds) for word in spec["argv"]] if spec["collect"] else spec["argv"]
    return _join_words([str(len(variables)), *variables, *argv])


def _join_words(words):
    return b"".join(os.fsencode(word) + b"\0" for word in words)


def _scratches(ours, stage, wall):
    """Make new memory for each place of the wall that asks for it."""
    names = []
    for word in wall:
        if isinstance(word, dict) and "scratch" in word:
            names.append(stage.scratch(*word["scratch"]))
            ours.callback(stage.give_up, names[-1])
    return names


def _arguments(wall, stage, scratches, fds):
    """Yield bubblewrap's arguments. Words that are not text stand for what only the arena knows."""
    for word in wall:
        if isinstance(word, str):
            yield word
        elif "copy" in word:
            yield stage.copy(word["copy"])
        elif "scratch" in word:
            yield next(scratches)
        else:
            yield str(fds[word["descriptor"]])


def _file(stack, name, data):
    """Return a descriptor of a file in memory, at its beginning."""
    number = os.memfd_create(name)
    stack.callback(os.close, number)
    os.write(number, data)
    os.lseek(number, 0, os.SEEK_SET)
    return number


def _pipe(ours, theirs, fds, name):
    """Return our end of a pipe whose other end is theirs."""
    near, far = os.pipe()
    ours.callback(os.close, near)
    theirs.callback(os.close, far)
    fds[name] = far
    return near


def _gate(theirs):
    """Return both ends of a pipe, which close here: (their end, ours)."""
    near, far = os.pipe()
    theirs.callback(os.close, near)
    theirs.callback(os.close, far)
    return near, far


def _filled_in(argument, fds):
    for name, number in fds.items():
        argument = argument.replace("{" + name + "}", str(number))
    return argument
