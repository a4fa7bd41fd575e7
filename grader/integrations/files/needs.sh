#!/usr/bin/env bash
# Installs what the lab needs besides, as root: made from `needs` of its rubric.
set -euo pipefail
export DEBIAN_FRONTEND=noninteractive
apt-get update -qq
