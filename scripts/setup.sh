#!/usr/bin/env bash
# Sets up what `make demo` and `make test` need: ROS 1 where it is missing, and .venv with the grader in it; for the
# tests of pages a browser too, but with `--no-browser`. Runs again in a moment when there is nothing to do.
# `--system-only` installs the packages of the system that grading needs, and nothing else: for images of containers.
# `--has-ros` only says, by its exit code, whether ROS 1 is here or could be installed.
set -euo pipefail
cd -P "$(dirname "${BASH_SOURCE[0]}")/.."

# The grader runs nodes with these, and cannot do without them where ROS 1 comes from Debian.
ros_packages=(
  catkin rosbash rosout libroscpp-dev libstd-msgs-dev libgeometry-msgs-dev
  python3-rospy python3-rosmaster python3-roslaunch python3-rospkg python3-rosbag
  python3-rosmsg python3-rosnode python3-rosparam python3-rosservice python3-rostest python3-rostopic
  python3-rosgraph-msgs python3-std-msgs python3-std-srvs
  python3-geometry-msgs python3-nav-msgs python3-sensor-msgs
)
# Students' packages may name these in find_package(), and import the last three (Noetic's rospy brings numpy along):
# installed where apt has them and root is to be had.
ros_extras=(
  ros-message-generation libnav-msgs-dev libsensor-msgs-dev libstd-srvs-dev
  ros-std-msgs ros-std-srvs ros-geometry-msgs ros-nav-msgs ros-sensor-msgs
  python3-actionlib python3-tf2-ros python3-numpy
)
# Program to find on PATH, and the package that has it (`ip` is for the tests of hostile submissions). The grader does
# without those of the second line, and so do its tests: those of pages are skipped.
tools=(bwrap:bubblewrap git:git cmake:cmake make:make g++:g++ ip:iproute2 ssh-keygen:openssh-client)
browser_tools=(chromium:chromium node:nodejs npm:npm)
shell_tools=(zsh:zsh fish:fish man:man-db groff:groff-base mandoc:mandoc)
debootstrap=mmdebstrap # makes the bare Debian of the tests in fresh roots, which only root can run
page_tools=tests/browser # with its own package.json
# What an image needs besides: to make a virtual environment, and to fetch repositories over https.
image_packages=(ca-certificates python3-venv)

say() { printf 'setup: %s\n' "$*"; }

die() {
  printf 'setup: %s\n' "$*" >&2
  exit 1
}

# Where ROS 1 is, if not in Debian's packages: the same order as the grader's own search.
ros_elsewhere() {
  local root
  if [ "${GRADER_ROS_SETUP:-}" = none ]; then return 0; fi # asked to do without
  if [ -n "${GRADER_ROS_SETUP:-}" ]; then
    [ -f "$GRADER_ROS_SETUP" ] || die "GRADER_ROS_SETUP names $GRADER_ROS_SETUP, which is not there"
    return 0
  fi
  for root in /opt/ros/*/; do # ROS 2 lies here too, and has no master
    if [ -f "$root/setup.bash" ] && [ -x "$root/bin/rosmaster" ]; then return 0; fi
  done
  if [ -d /usr/share/rospy ]; then return 1; fi
  [ -n "${CONDA_PREFIX:-}" ] && [ -x "$CONDA_PREFIX/bin/rosmaster" ]
}

# Those of the named packages that are not installed, one a line.
not_installed() {
  printf '%s\n' "$@" | grep -vxF -f <(
    dpkg-query -W -f='${db:Status-Status} ${Package}\n' "$@" 2>/dev/null | sed -n 's/^installed //p'
  )
}

# Sets `missing` to the packages to install.
find_missing() {
  local tool
  missing=()
  for tool in "${tools[@]}"; do
    command -v "${tool%%:*}" >/dev/null || missing+=("${tool#*:}")
  done
  if ros_elsewhere; then return; fi
  command -v dpkg-query >/dev/null ||
    die "no ROS 1 here, and this is no Debian or Ubuntu: install ROS 1 (RoboStack has it for other systems) and name its setup.bash in GRADER_ROS_SETUP"
  mapfile -t -O "${#missing[@]}" missing < <(not_installed "${ros_packages[@]}")
}

# Sets `as_root` to what goes before a command that root has to run.
find_root() {
  as_root=()
  if [ "$(id -u)" -eq 0 ]; then return 0; fi
  command -v sudo >/dev/null || return 1
  if sudo -n true 2>/dev/null; then
    as_root=(sudo -n)
  elif [ -t 0 ]; then
    as_root=(sudo)
  else
    return 1
  fi
}

apt_install() {
  command -v apt-get >/dev/null || die "install these programs first: $*"
  find_root || die "ask an administrator for these packages: apt-get install --no-install-recommends $*"
  say "installing $*"
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=300)
  "${apt[@]}" update </dev/null || say "apt-get update failed; going on with the package lists that are here"
  local package wanted=("$@") unknown=()
  for package in "$@"; do
    apt-cache show "$package" >/dev/null 2>&1 || unknown+=("$package")
  done
  [ "${#unknown[@]}" -eq 0 ] ||
    die "apt knows no ${unknown[*]}: Debian 12 and Ubuntu 22.04 have ROS 1; elsewhere install it and name its setup.bash in GRADER_ROS_SETUP"
  if [[ " $* " == *" python3-rospy "* ]]; then
    mapfile -t -O "${#wanted[@]}" wanted < <(known_to_apt "${ros_extras[@]}")
  fi
  "${apt[@]}" install --no-install-recommends "${wanted[@]}" </dev/null || die "apt-get could not install $*"
}

# Those of the named packages that apt can install, one a line.
known_to_apt() {
  local package
  for package in "$@"; do
    if apt-cache show "$package" >/dev/null 2>&1; then printf '%s\n' "$package"; fi
  done
}

# On a machine that had ROS before, the extras may be missing. Tried once for each set of names.
install_extras() {
  local wanted known tried=.venv/setup-extras
  if ros_elsewhere; then return; fi
  mapfile -t wanted < <(not_installed "${ros_extras[@]}")
  if [ "${#wanted[@]}" -eq 0 ] || [ "$(cat "$tried" 2>/dev/null)" = "${wanted[*]}" ]; then return; fi
  if ! command -v apt-get >/dev/null || ! find_root; then return; fi
  mapfile -t known < <(known_to_apt "${wanted[@]}")
  if [ "${#known[@]}" -gt 0 ]; then
    say "installing ${known[*]}"
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=300 \
      install --no-install-recommends "${known[@]}" </dev/null ||
      say "going on without them: packages that name them in find_package() will not build here"
  fi
  printf '%s' "${wanted[*]}" >"$tried"
}

# What the tests of pages need. Tried once for each set of names, and for each package-lock.json.
install_browser() {
  local tool wanted=() tried=.venv/setup-browser
  for tool in "${browser_tools[@]}"; do
    command -v "${tool%%:*}" >/dev/null || wanted+=("${tool#*:}")
  done
  if [ "${#wanted[@]}" -gt 0 ] && [ "$(cat "$tried" 2>/dev/null)" != "${wanted[*]}" ]; then
    printf '%s' "${wanted[*]}" >"$tried"
    apt_try "${wanted[@]}" || say "no ${wanted[*]} here: the tests of pages in a browser will be skipped"
  fi
  install_page_tools
}

# For the tests of completion and of the man page, which do without any of them. Tried once.
install_shells() {
  local tool wanted=() tried=.venv/setup-shells
  for tool in "${shell_tools[@]}"; do
    command -v "${tool%%:*}" >/dev/null || wanted+=("${tool#*:}")
  done
  if [ "${#wanted[@]}" -eq 0 ] || [ "$(cat "$tried" 2>/dev/null)" = "${wanted[*]}" ]; then return; fi
  printf '%s' "${wanted[*]}" >"$tried"
  apt_try "${wanted[@]}" || say "no ${wanted[*]} here: the tests that need them will be skipped"
}

# Tried once.
install_debootstrap() {
  local tried=.venv/setup-debootstrap
  if [ "$(id -u)" -ne 0 ] || command -v "$debootstrap" >/dev/null || [ -e "$tried" ]; then return; fi
  touch "$tried"
  apt_try "$debootstrap" || say "no $debootstrap here: the tests in fresh roots will be skipped"
}

apt_try() { # as far as it can be done without asking anybody
  command -v apt-get >/dev/null && find_root || return 1
  say "installing $*"
  local apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=300)
  "${apt[@]}" update </dev/null || true
  "${apt[@]}" install --no-install-recommends "$@" </dev/null
}

install_page_tools() {
  local stamp="$page_tools/node_modules/.setup-stamp" lock
  if [ ! -f "$page_tools/package-lock.json" ] || ! command -v npm >/dev/null; then return; fi
  lock="$(cksum <"$page_tools/package-lock.json")"
  if [ "$(cat "$stamp" 2>/dev/null)" = "$lock" ]; then return; fi
  say "installing what $page_tools measures pages with"
  if npm --prefix "$page_tools" ci --ignore-scripts --no-audit --no-fund --loglevel=error </dev/null; then
    printf '%s\n' "$lock" >"$stamp"
  else
    say "npm could not: the tests of pages in a browser will be skipped"
  fi
}

fits() { # Python 3.10 or newer that can make virtual environments
  "$1" -c 'import ensurepip, sys, venv; sys.exit(sys.version_info < (3, 10))' 2>/dev/null
}

# Sets `python` to one that fits.
find_python() {
  for python in python3 /usr/bin/python3 python3.{14,13,12,11,10}; do
    if command -v "$python" >/dev/null && fits "$python"; then return 0; fi
  done
  return 1
}

ready() {
  [ -x .venv/bin/grader ] && [ "$(cat .venv/setup-stamp 2>/dev/null)" = "$1" ] && .venv/bin/python -c 'import grader' 2>/dev/null
}

whole() { # not half-made, not moved here from another folder, its Python still there
  grep -qsF "$PWD/.venv/bin/python" .venv/bin/pip && fits .venv/bin/python &&
    .venv/bin/python -m pip --version >/dev/null 2>&1
}

make_venv() {
  if ! whole; then
    if ! find_python; then
      command -v apt-get >/dev/null && apt_install python3-venv
      find_python || die "this needs Python 3.10 or newer with its venv module, as python3 on PATH"
    fi
    say "making .venv with $("$python" --version)"
    "$python" -m venv --clear .venv
  fi
  say "installing the grader into .venv"
  .venv/bin/python -m pip --disable-pip-version-check --no-input install -qq -e '.[dev]' ||
    die "pip could not install the grader: see above, then run make setup again"
  printf '%s\n' "$1" >.venv/setup-stamp
}

install_system() {
  local known
  mapfile -t -O "${#missing[@]}" missing < <(not_installed "${image_packages[@]}")
  if [ "${#missing[@]}" -gt 0 ]; then
    apt_install "${missing[@]}"
  fi
  if ! ros_elsewhere; then
    mapfile -t known < <(known_to_apt $(not_installed "${ros_extras[@]}"))
    if [ "${#known[@]}" -gt 0 ]; then apt_try "${known[@]}"; fi
  fi
  find_python || die "this needs Python 3.10 or newer with its venv module, as python3 on PATH"
}

ros_possible() {
  local package
  if ros_elsewhere; then return 0; fi
  command -v dpkg-query >/dev/null && command -v apt-get >/dev/null || return 1
  mapfile -t missing < <(not_installed "${ros_packages[@]}")
  if [ "${#missing[@]}" -eq 0 ]; then return 0; fi
  find_root || return 1
  "${as_root[@]}" apt-get -q update </dev/null || true
  for package in "${missing[@]}"; do
    apt-cache show "$package" >/dev/null 2>&1 || return 1
  done
}

if [ "${1:-}" = --has-ros ]; then
  ros_possible
  exit
fi
find_missing
if [ "${1:-}" = --system-only ]; then
  install_system
  exit
fi
if [ "${#missing[@]}" -gt 0 ]; then
  apt_install "${missing[@]}"
fi
stamp="$(cksum <pyproject.toml) $PWD"
if ! ready "$stamp"; then
  make_venv "$stamp"
fi
# Each time: the processes that read scripts and run arenas keep no bytecode, and would compile what has changed in every grading.
.venv/bin/python -m compileall -q grader || true
install_extras
if [ "${1:-}" != --no-browser ]; then
  install_browser
  install_shells
  install_debootstrap
fi
