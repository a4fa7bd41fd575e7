#!/usr/bin/env bash
# The action's second step: grades, tells GitHub, and ends as `fail-on` says.
set -euo pipefail
here="$(cd -P "$(dirname "${BASH_SOURCE[0]}")" && pwd)"

if [ "${GRADER_HOW:-}" = container ]; then
  exec "$here/container.sh"
fi
exec "$RUNNER_TEMP/ros-lab-grader/venv/bin/grader" ci github
