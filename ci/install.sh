#!/usr/bin/env bash
# Installs the grader of this checkout into $GRADER_HOME/venv; with `--no-ros` for the static part alone, else with
# ROS 1, compilers and bubblewrap as far as they are missing and apt has them. Where nothing is to be done it is quick.
# $GRADER_CACHE names a folder in which what pip and apt fetch is kept.
set -euo pipefail
root="$(cd -P "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
home="$(realpath -m -- "${GRADER_HOME:?a folder for the grader}")"
cache="${GRADER_CACHE:+$(realpath -m -- "$GRADER_CACHE")}"
cd -- "$root" # a job begins in the student's folder, in which Python would look for its own modules first
stamp="$root $(git -C "$root" rev-parse HEAD 2>/dev/null || cksum <"$root/pyproject.toml")"

say() { printf 'install: %s\n' "$*" >&2; }

die() {
  say "$@"
  exit 3
}

as_root() {
  if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo -n "$@"; fi
}

# Images of Debian throw away what apt fetches; the cache is to have it.
keep_apt_packages() {
  if [ -z "$cache" ] || [ "$(id -u)" -ne 0 ] || [ ! -d /etc/apt/apt.conf.d ]; then return 0; fi
  mkdir -p "$cache/apt/partial"
  rm -f /etc/apt/apt.conf.d/docker-clean
  printf 'Dir::Cache::Archives "%s";\nBinary::apt-get::APT::Keep-Downloaded-Packages "true";\n' "$cache/apt" \
    >/etc/apt/apt.conf.d/90-ros-lab-grader
}

fits() { # Python 3.10 or newer that can make virtual environments
  "$1" -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 10))' 2>/dev/null
}

# Sets `python` to one that fits.
find_python() {
  for python in python3 python3.{14,13,12,11,10} /usr/bin/python3; do
    if command -v "$python" >/dev/null && fits "$python"; then return 0; fi
  done
  return 1
}

apt_python() {
  command -v apt-get >/dev/null || return 1
  as_root apt-get -q update </dev/null || true
  as_root env DEBIAN_FRONTEND=noninteractive apt-get -q -y install --no-install-recommends \
    ca-certificates python3-venv </dev/null
}

# ROS Noetic's own Ubuntu has Python 3.8: uv brings a newer one, beside the one that ROS's nodes run with.
uv_python() {
  python3 -m venv "$home/uv" && "$home/uv/bin/python" -m pip install -qq uv || return 1
  "$home/uv/bin/uv" python install --quiet --install-dir "$home/python" 3.12 || return 1
  python="$(printf '%s\n' "$home"/python/*/bin/python3.12 | head -n 1)"
  fits "$python"
}

provide_python() {
  if find_python; then return 0; fi
  say "looking for a Python of 3.10 or newer"
  if apt_python && find_python; then return 0; fi
  uv_python || die "this needs Python 3.10 or newer with its venv module, as python3 on PATH"
}

if [ -x "$home/venv/bin/grader" ] && [ "$(cat "$home/installed" 2>/dev/null)" = "$stamp" ]; then
  exit 0
fi
mkdir -p "$home"
if [ -n "$cache" ]; then
  export PIP_CACHE_DIR="$cache/pip"
  keep_apt_packages
fi
provide_python
if [ "${1:-}" != --no-ros ]; then
  PATH="$(dirname "$(command -v "$python")"):$PATH" "$root/scripts/setup.sh" --system-only >&2 ||
    say "going on with what is here; the grader says what it lacks"
fi
say "installing the grader with $("$python" --version)"
"$python" -m venv --clear "$home/venv"
"$home/venv/bin/python" -m pip --disable-pip-version-check --no-input install -qq "$root" >&2 ||
  die "pip could not install the grader: see above"
printf '%s' "$stamp" >"$home/installed"
