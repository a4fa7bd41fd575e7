"""What a submission must not get at: files, services and variables, each with a secret in it."""

from __future__ import annotations

import os
import socket
import threading
from pathlib import Path

from tests.hostile.room.world import run

TOP = Path("/srv/grading")
HANDED_IN = TOP / "handed-in"
RESULTS = TOP / "results"
SCRATCH = TOP / "scratch"
RUNTIME = TOP / "runtime"
RUBRIC = TOP / "course" / "rubric.yaml"
OTHER = HANDED_IN / "other-student"
PORT = 8080
ABSTRACT = "\0hostile-canary"
SOCKET = TOP / "canary.sock"


def place(secret: str, rubric: str, home: Path) -> None:
    """Write the files. `home` is that of the user who grades. Each one's secret tells where it is from."""
    for folder in (HANDED_IN, RESULTS, SCRATCH, RUBRIC.parent, OTHER):
        folder.mkdir(parents=True)
    SCRATCH.chmod(0o1777)
    RUNTIME.mkdir(mode=0o700)
    os.chown(RUNTIME, home.stat().st_uid, home.stat().st_gid)
    shadow = Path("/etc/shadow")
    shadow.write_text(f"root:{secret}-shadow:19000:0:99999:7:::\n", encoding="utf-8")
    shadow.chmod(0o640)
    _file(home / ".ssh" / "id_rsa", secret, 0o600)
    _file(home / ".netrc", secret, 0o600)
    _file(Path("/root/.ssh/id_rsa"), secret, 0o600)
    _file(OTHER / "lab" / "src" / "talker.py", secret)
    _file(RESULTS / "other-student" / "result.json", secret)
    _file(TOP / "marks.csv", secret)
    _file(TOP / "course" / "solution" / "talker.py", secret)
    _file(SCRATCH / "of-another-program" / "notes", secret)
    RUBRIC.write_text(f"# {secret}-rubric\n{rubric}", encoding="utf-8")
    for folder in ("/tmp", "/var/tmp", "/dev/shm", "/opt", "/var/lib", "/mnt", "/run"):
        _file(Path(folder) / "canary", secret)
    run("ipcmk", "--shmem", "4096")


def _file(path: Path, secret: str, mode: int = 0o644) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{secret}{str(path).replace('/', '-')}\n", encoding="utf-8")
    path.chmod(mode)


class Services:
    """The machine's own: a port of the loopback, a socket with a path, one with an abstract name."""

    def __init__(self, secret: str) -> None:
        self.asked: list[str] = []
        self._secret = secret
        self._listen("port", socket.AF_INET, ("127.0.0.1", PORT))
        self._listen("abstract", socket.AF_UNIX, ABSTRACT)
        self._listen("path", socket.AF_UNIX, str(SOCKET))
        os.chmod(SOCKET, 0o777)  # noqa: PTH101, S103 - as open as can be

    def _listen(self, name: str, family: int, address: object) -> None:
        listener = socket.socket(family)
        listener.bind(address)
        listener.listen()
        threading.Thread(target=self._serve, args=(name, listener), daemon=True).start()

    def _serve(self, name: str, listener: socket.socket) -> None:
        while True:
            connection, _ = listener.accept()
            self.asked.append(name)
            connection.sendall(f"{self._secret}-service-{name}\n".encode())
            connection.close()
