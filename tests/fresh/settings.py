"""How this machine reaches its packages, for commands in a fresh root that may use the network.

Nothing of it is written into the root: what has a path is bound read-only for the time of the command.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from urllib.parse import urlsplit

HOST = "/run/host"
PROXIES = ("http_proxy", "https_proxy", "no_proxy", "HTTP_PROXY", "HTTPS_PROXY", "NO_PROXY")
CERTIFICATES = Path("/etc/ssl/certs/ca-certificates.crt")
FOLDERS = ("find-links", "extra-index-url", "index-url")


def network_settings() -> tuple[dict[str, str], list[str]]:
    """Environment variables, and arguments of bubblewrap."""
    env = {name: os.environ[name] for name in PROXIES if name in os.environ}
    binds = _bind(Path("/etc/resolv.conf"), "/etc/resolv.conf") + _bind(Path("/etc/hosts"), "/etc/hosts")
    if CERTIFICATES.exists():
        binds += _bind(CERTIFICATES, f"{HOST}/certificates.crt")
        names = ("SSL_CERT_FILE", "PIP_CERT", "REQUESTS_CA_BUNDLE", "GIT_SSL_CAINFO")
        env.update(dict.fromkeys(names, f"{HOST}/certificates.crt"))
    for key, value in _pip().items():
        env[f"PIP_{key.upper().replace('-', '_')}"] = value
        binds += [word for path in _paths(value) for word in _bind(path, str(path))]
    proxy = _apt_proxy()
    return env | ({"http_proxy": proxy} if proxy else {}), binds


def _bind(path: Path, target: str) -> list[str]:
    return ["--ro-bind", str(path.resolve()), target] if path.exists() else []


def _pip() -> dict[str, str]:
    """What pip is told here about where packages are, by its files and its environment."""
    ask = [sys.executable, "-m", "pip", "config", "list"]
    done = subprocess.run(ask, capture_output=True, text=True, check=False)
    lines = [line for line in done.stdout.splitlines() if "=" in line]
    found: dict[str, str] = {}
    for line in lines:
        name, _, value = line.partition("=")
        key = name.strip(":").rpartition(".")[2]
        if key in {*FOLDERS, "trusted-host"}:
            found[key] = value.strip("'\"").replace("\\n", " ")
    return found


def _paths(value: str) -> list[Path]:
    """Folders of this machine among the places of packages: of `file:///a/simple` the folder `/a`."""
    places = [urlsplit(word).path if word.startswith("file:") else word for word in value.split()]
    return [Path("/", *Path(p).parts[1:3]) for p in places if p.startswith("/")]


def _apt_proxy() -> str:
    ask = ["apt-config", "dump", "--format", "%v", "Acquire::http::Proxy"]
    return subprocess.run(ask, capture_output=True, text=True, check=False).stdout.strip()
