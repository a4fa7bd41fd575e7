"""Fresh roots: nothing of this machine is in them, and nothing of them stays."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from tests.fresh.room import Failed, Rooms, missing

pytestmark = [
    pytest.mark.full,
    pytest.mark.slow,
    pytest.mark.skipif(bool(missing()), reason=missing() or "-"),
]


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    with Rooms(tmp_path_factory.mktemp("rooms")) as rooms:
        yield rooms


def test_a_root_is_debian_without_this_machines_programs_variables_and_network(own, monkeypatch) -> None:
    monkeypatch.setenv("SECRET", "of this machine")
    root = own.fresh_root()
    seen = root.run(
        ["sh", "-c", "env; cat /etc/os-release; ls / /home; cat /proc/net/dev; ls -d /proc/[0-9]*"]
    ).stdout
    assert "bookworm" in seen
    assert "SECRET" not in seen
    assert "work" not in seen.split()
    assert "eth" not in seen
    assert seen.count("/proc/") < 8
    with pytest.raises(Failed, match="ended with 127"):
        root.run(["sh", "-c", "python3 --version"])


def test_a_root_on_another_sees_it_and_leaves_it_alone(own) -> None:
    first = own.fresh_root()
    first.run(["sh", "-c", "echo one >/etc/made; chown 1000 /etc/made"])
    second = own.fresh_root(on=first)
    assert (
        second.run(["sh", "-c", "cat /etc/made; stat -c %u /etc/made; echo two >/etc/made"]).stdout
        == "one\n1000\n"
    )
    assert (first.path / "etc" / "made").read_text() == "one\n"
    assert not (own.fresh_root().path / "etc" / "made").exists()


def test_an_ordinary_user_is_one(own) -> None:
    root = own.fresh_root()
    root.run(["useradd", "--uid", "1000", "--create-home", "someone"])
    done = root.run(["sh", "-c", "id -un; : >/etc/passwd"], user="someone", check=False)
    assert done.stdout.startswith("someone\n")
    assert done.returncode != 0


def test_a_root_may_have_this_machines_network_and_keeps_nothing_of_its_settings(own) -> None:
    root = own.fresh_root()
    assert "nameserver" in root.run(["cat", "/etc/resolv.conf"], network=True).stdout
    assert root.run(["sh", "-c", "ls /run/host; cat /etc/resolv.conf; env"]).stdout.splitlines() == [
        "HOME=/root",
        "PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
        "PWD=/",
    ]


def test_nothing_is_mounted_any_more_when_the_holder_was_killed(tmp_path) -> None:
    rooms = Rooms(tmp_path / "rooms")
    rooms.fresh_root().run(["true"])
    os.kill(rooms._holder.pid, signal.SIGKILL)
    rooms.close()
    assert str(tmp_path) not in Path("/proc/mounts").read_text()
    assert list((tmp_path / "rooms").iterdir()) == []
