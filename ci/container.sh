#!/usr/bin/env bash
# `grader ci github` in a container, as the user of the runner: the workspace can only be read there, the results and
# GitHub's two files of this step can be written. Variables go in by name, so that no shell reads their values.
#
# The sandbox inside makes user namespaces, mounts and a /proc of its own, which Docker's defaults forbid: its filter of
# system calls, its AppArmor profile, and its masks over /proc are off. The container has no network and no capability.
set -uo pipefail

lab=()
if [[ "${GRADER_LAB:-}" == https://*"#sha256:"* ]]; then # the container has no network; the grader compares the digest
  rubric="$(mktemp -d "$RUNNER_TEMP/lab-rubric.XXXXXXXX")/rubric.yaml"
  if ! curl --fail --silent --show-error --location --proto '=https' --max-time 60 --max-filesize 1000000 \
    --output "$rubric" -- "${GRADER_LAB%%#*}"; then
    printf '::error title=Not graded::the rubric could not be fetched: see the log\n'
    printf 'status=not-graded\npassed=false\n' >>"$GITHUB_OUTPUT"
    exit 3
  fi
  export GRADER_LAB="$rubric#${GRADER_LAB##*#}"
  lab=(--mount "type=bind,source=$rubric,target=$rubric,readonly")
fi

options=(
  --rm --init --network none --cap-drop ALL
  --user "$(id -u):$(id -g)"
  --security-opt seccomp=unconfined --security-opt apparmor=unconfined --security-opt systempaths=unconfined
  --mount "type=bind,source=$GITHUB_WORKSPACE,target=$GITHUB_WORKSPACE,readonly" --workdir "$GITHUB_WORKSPACE"
)
for path in "$GRADER_OUT" "$GITHUB_OUTPUT" "$GITHUB_STEP_SUMMARY"; do
  options+=(--mount "type=bind,source=$path,target=$path")
done
for name in GITHUB_OUTPUT GITHUB_STEP_SUMMARY GITHUB_WORKSPACE GITHUB_RUN_NUMBER \
  GRADER_{OUT,LAB,PATH,PACKAGE,PASS_MARK,FAIL_ON,STATIC,SANDBOX,ATTEMPTS}; do
  options+=(--env "$name")
done

docker run "${options[@]}" "${lab[@]}" --entrypoint grader "$GRADER_IMAGE" ci github
code=$?
if [ "$code" -ge 125 ] && [ "$code" -ne 130 ]; then # docker's own: the grader has not begun, or was killed
  printf '::error title=Not graded::the container could not be run, or was killed (exit code %d): see the log\n' "$code"
  printf 'status=not-graded\npassed=false\n' >>"$GITHUB_OUTPUT"
  exit 3
fi
exit "$code"
