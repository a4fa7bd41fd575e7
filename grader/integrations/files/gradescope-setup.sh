#!/usr/bin/env bash
# Gradescope runs this once, as root, when it builds the image: ROS 1 from the system's archive, then the grader.
set -euo pipefail
cd -P "$(dirname "${BASH_SOURCE[0]}")"

export DEBIAN_FRONTEND=noninteractive
if ! bash system.sh --system-only; then
  echo "setup: this image cannot have ROS 1. Under Configure Autograder choose Base Image OS Ubuntu, Version 22.04, Variant Base, and update the autograder; setup.sh runs on Debian 12, too." >&2
  exit 1
fi
if [ -f needs.sh ]; then bash needs.sh; fi
python3 -m venv /opt/ros-lab-grader
/opt/ros-lab-grader/bin/python -m pip install --quiet --no-cache-dir --disable-pip-version-check ./*.whl
chmod -R go-rwx . # the rubric is nobody's who is graded
/opt/ros-lab-grader/bin/grader doctor || true # told in the build's output; what is missing, each result says
