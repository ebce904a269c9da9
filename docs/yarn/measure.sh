#!/usr/bin/env bash
# Numbers and curves of the yarn experiments in docs/yarn-level.md.
# Usage: docs/yarn/measure.sh [results]   (from the root; SELVEDGE=path of the program)
set -euo pipefail
cd "$(dirname "$0")/../.."
selvedge=${SELVEDGE:-target/debug/selvedge}
out=${1:-target/yarn}
mkdir -p "$out"

# run NAME SCENE [--set ...]: results and a table of the steps in $out/NAME
run() {
  local name=$1 scene=$2
  shift 2
  "$selvedge" run "scenes/yarn/$scene.toml" -o "$out/$name" --set output.report=false "$@" >"$out/$name.log" 2>&1
  "$selvedge" export "$out/$name" --format csv >/dev/null
}

run capstan capstan
run rib-stretch rib-stretch
# Before the pull, stretched, five seconds after it, and the same time without it.
for mu in 0 0.1 0.3 1; do
  for time in 1 2 8; do
    run "overstretch-$mu-$time" overstretch --set "yarn.wool.friction=$mu" --set "simulation.duration=$time"
  done
  run "overstretch-$mu-alone" overstretch --set "yarn.wool.friction=$mu" --set simulation.duration=8 \
    --set "attachment.0.motion.1.translation=[0, 0, 0]" --set "attachment.1.motion.1.translation=[0, 0, 0]"
done
python3 docs/yarn/curves.py "$out" docs/images
