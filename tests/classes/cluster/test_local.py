"""The cluster that `--cluster local` starts, as another user of the machine meets it."""

from __future__ import annotations

import json
import os
import socket
import ssl
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from grader.classes.cluster.connect import LOCAL, connect
from tests.classes.cluster.sockets import listening_ports, tree_of

if TYPE_CHECKING:
    from distributed.security import Security

KEY = b"PRIVATE KEY"
OUTSIDE = """
import json, logging, sys
from distributed import Client
from distributed.security import Security

logging.disable(logging.CRITICAL)
address, files = json.load(sys.stdin)
try:
    client = Client(address, timeout=120, security=Security(**files))
except (OSError, TypeError, RuntimeError, ValueError) as error:
    print("refused", type(error).__name__)
else:
    print("let in")
    client.close()
"""


@pytest.fixture(scope="module")
def temporary(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where temporary files go, with a scratch folder of Dask's that another user made."""
    folder = tmp_path_factory.mktemp("temporary")
    (folder / "dask-scratch-space").mkdir()
    (folder / "dask-scratch-space").chmod(0o777)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", str(folder))
        patch.setattr("tempfile.tempdir", None)
        yield folder


@pytest.fixture(scope="module")
def keys() -> Iterator[list[Path]]:
    """The files from which this process, which holds scheduler and nannies, has loaded a key."""
    loaded = []
    load = ssl.SSLContext.load_cert_chain

    def noted(self: ssl.SSLContext, certfile: str, keyfile: str | None = None, **more: Any) -> None:
        path = Path(keyfile or certfile)
        assert path.parent.stat().st_mode & 0o077 == 0, f"others can read {path}"
        loaded.append(path)
        load(self, certfile, keyfile, **more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ssl.SSLContext, "load_cert_chain", noted)
        yield loaded


@pytest.fixture(scope="module")
def before() -> list[int]:
    return listening_ports(os.getpid())


@pytest.fixture(scope="module")
def client(before: list[int], temporary: Path, keys: list[Path]) -> Iterator[Any]:
    with connect(LOCAL) as client:
        client.wait_for_workers(os.cpu_count() or 1)
        yield client


@pytest.fixture(scope="module")
def ports(before: list[int], client: Any) -> list[int]:
    """Those on which this process and its own listen since there is a cluster."""
    return [port for port in listening_ports(os.getpid()) if port not in before]


@pytest.mark.full
def test_nothing_listens_but_scheduler_nannies_and_workers(client: Any, ports: list[int]) -> None:
    known = client.scheduler_info(n_workers=-1)
    addresses = [known["address"], *known["workers"], *(one["nanny"] for one in known["workers"].values())]
    assert {address.partition("://")[0] for address in addresses} == {"tls"}
    assert sorted(int(address.rpartition(":")[2]) for address in addresses) == ports
    assert known["services"] == {}


def test_every_port_refuses_who_has_no_certificate_of_the_cluster(ports: list[int]) -> None:
    foreign = _security()
    context = foreign.get_connection_args("client")["ssl_context"]
    bare = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    for one in (context, bare):
        one.check_hostname, one.verify_mode = False, ssl.CERT_NONE
    assert len(ports) >= 3
    for port in ports:
        for one in (context, bare):
            with pytest.raises(ssl.SSLError), _connected(port) as plain, one.wrap_socket(plain) as secured:
                secured.recv(1)
        with _connected(port) as plain:
            plain.sendall(b"\0" * 64)
            assert _told(plain) == b""


@pytest.mark.full
@pytest.mark.parametrize("protocol", ["tcp", "tls"])
@pytest.mark.parametrize("certificates", ["none", "foreign"])
def test_a_client_without_the_certificates_is_refused(client: Any, protocol: str, certificates: str) -> None:
    files = _files(_security()) if certificates == "foreign" else {}
    said = _outside(f"{protocol}://{client.scheduler.address.partition('://')[2]}", files)
    assert said.startswith("refused")


@pytest.mark.full
def test_one_that_has_them_would_be_let_in(client: Any) -> None:
    assert _outside(client.scheduler.address, _files(client.security)) == "let in"


def test_no_key_is_where_others_can_read_it(client: Any, temporary: Path, keys: list[Path]) -> None:
    assert keys
    assert not any(path.exists() for path in keys)
    looked_at = 0
    for pid in tree_of(os.getpid()):
        for name in ("cmdline", "environ"):
            with suppress(FileNotFoundError, ProcessLookupError):  # it has ended by now
                assert KEY not in Path(f"/proc/{pid}/{name}").read_bytes()
                looked_at += 1
    assert looked_at
    left = [path for path in temporary.rglob("*") if path.is_file() and KEY in path.read_bytes()]
    assert left == []


@pytest.mark.full
def test_no_process_imports_from_a_folder_that_another_user_made(client: Any, temporary: Path) -> None:
    paths = [*_paths(), *(path for found in client.run(_paths).values() for path in found)]
    inside = [Path(path).relative_to(temporary) for path in paths if Path(path).is_relative_to(temporary)]
    tops = {temporary / path.parts[0] for path in inside}
    assert tops
    assert not any(top.stat().st_mode & 0o077 for top in tops)


def _paths() -> list[str]:
    return list(sys.path)


def _security() -> Security:
    """Certificates that no cluster knows."""
    from distributed.security import Security  # noqa: PLC0415 - takes half a second to load

    return Security.temporary()


def _files(security: Security) -> dict[str, str]:
    return {name: getattr(security, name) for name in ("tls_ca_file", "tls_client_cert", "tls_client_key")}


def _outside(address: str, files: dict[str, str]) -> str:
    """What becomes of a client in a process of its own."""
    told = json.dumps([address, files])
    done = subprocess.run(
        [sys.executable, "-c", OUTSIDE], input=told, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def _connected(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), timeout=60)


def _told(connection: socket.socket) -> bytes:
    """What comes before the connection ends, without what TLS itself says of its refusal."""
    try:
        said = connection.recv(64)
    except ConnectionResetError:
        return b""
    return b"" if said[:1] == b"\x15" else said
