#!/usr/bin/env bash
# Six patterns of one yarn on a sphere: a row of a table for each.
# Usage: docs/yarn/patterns.sh [results]   (from the root; SELVEDGE=path of the program)
set -euo pipefail
cd "$(dirname "$0")/../.."
selvedge=${SELVEDGE:-target/debug/selvedge}
out=${1:-target/yarn}
mkdir -p "$out"
echo "| pattern | points | processor [s] | largest, mean strain [%] | deepest in the sphere [mm] | lowest, highest point [mm] |"
echo "|---|---|---|---|---|---|"
row() {
  local name=$1 scene=$2
  shift 2
  "$selvedge" run "scenes/yarn/$scene.toml" -o "$out/$name" --set assembly.threads=1 "$@" >"$out/$name.log" 2>&1 || true
  python3 - "$name" "$out/$name" <<'P'
import json, sys
name, folder = sys.argv[1:]
try:
    s = json.load(open(f"{folder}/summary.json"))
except OSError:
    sys.exit(print(f"| {name} | no result |"))
ys = [float(l.split()[2]) for l in open(f"{folder}/final.obj") if l.startswith("v ")]
print(
    f"| {name} | {s['points']} | {s['cpu_s']:.0f} | {100 * s['max_abs_edge_strain']:.2f}, {100 * s['mean_abs_edge_strain']:.2f} "
    f"| {1e3 * s['max_penetration_m']:.3f} | {1e3 * min(ys):.1f}, {1e3 * max(ys):.1f} |"
    + ("" if s["status"] in ("finished", "converged") else f" {s['status']}: {s['reason']}")
)
P
}
row garter six-patterns
row rib six-patterns --set cloth.0.chart=rib-2x2 --set 'cloth.0.stitches=[20, 20]'
row plain-weave six-patterns-weave
row feather-and-fan six-patterns --set cloth.0.chart=feather-and-fan
row openwork-diamonds six-patterns --set cloth.0.chart=openwork-diamonds --set 'cloth.0.stitches=[19, 20]'
row flame-chevron six-patterns --set cloth.0.chart=flame-chevron --set 'cloth.0.stitches=[16, 20]'
