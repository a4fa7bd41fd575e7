#!/usr/bin/env bash
# The action's first step: decides where the grader runs, and brings it there. Outputs: `how` (native or container),
# `image`, and `results`, an empty folder.
set -euo pipefail
root="$(cd -P "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
export GRADER_HOME="$RUNNER_TEMP/ros-lab-grader"
local_image=ros-lab-grader:action

say() { printf 'prepare: %s\n' "$*"; }

die() { # the texts are ours: nothing in them is anybody else's
  printf '::error title=%s::%s\n' "$1" "$2"
  printf 'status=%s\n' "$3" >>"$GITHUB_OUTPUT"
  exit "$4"
}

output() { printf '%s=%s\n' "$1" "$2" >>"$GITHUB_OUTPUT"; }

static="${GRADER_STATIC:-false}"

is_static() {
  case "${static,,}" in true | yes | on | 1) return 0 ;; *) return 1 ;; esac
}

docker_works() { command -v docker >/dev/null && docker info >/dev/null 2>&1; }

# Sets `how`. What is here costs least, then what apt has, then a container.
choose() {
  how=native
  if is_static; then return; fi
  case "${GRADER_CONTAINER:-auto}" in
    never) return ;;
    always) how=container ;;
    auto) if ! "$root/scripts/setup.sh" --has-ros >/dev/null 2>&1 && docker_works; then how=container; fi ;;
    *) die "Wrong input" "container: write auto, always or never" wrong-input 2 ;;
  esac
  if [ "$how" = container ] && ! docker_works; then
    die "Not graded" "container: always, but there is no docker here that answers" not-graded 3
  fi
}

# Ubuntu 24.04 keeps bubblewrap from making namespaces. A runner of GitHub's own is thrown away after the job; on
# anybody else's machine this is not ours to change.
allow_namespaces() {
  local switch=kernel.apparmor_restrict_unprivileged_userns
  if [ "$(sysctl -n "$switch" 2>/dev/null || true)" != 1 ]; then return; fi
  if [ "${RUNNER_ENVIRONMENT:-}" = github-hosted ] && sudo -n sysctl -q -w "$switch=0"; then
    say "unprivileged user namespaces are allowed now, for the sandbox"
  else
    say "$switch is 1: there will be no sandbox; 'sudo sysctl -w $switch=0' allows it"
  fi
}

build_image() {
  printf '::group::Building the image\n'
  docker build --tag "$local_image" "$root" ||
    die "Not graded" "the grader's image could not be built: see the log" not-graded 3
  printf '::endgroup::\n'
}

install_here() {
  local options=()
  if is_static; then options=(--no-ros); fi
  printf '::group::Installing the grader\n'
  "$root/ci/install.sh" "${options[@]}" || die "Not graded" "the grader could not be installed: see the log" not-graded 3
  printf '::endgroup::\n'
}

if [ "$(uname -s)" != Linux ] && ! is_static; then
  die "Wrong input" "nodes run on Linux only: use runs-on: ubuntu-latest, or static: true" wrong-input 2
fi
choose
output how "$how"
output results "$(mktemp -d "$RUNNER_TEMP/lab-results.XXXXXXXX")"
if ! is_static; then allow_namespaces; fi
if [ "$how" = native ]; then
  install_here
elif [ -z "${GRADER_IMAGE:-}" ]; then
  build_image
  output image "$local_image"
else
  output image "$(printf '%s' "$GRADER_IMAGE" | tr -d '\r\n')"
fi
say "the grader runs here: $how"
