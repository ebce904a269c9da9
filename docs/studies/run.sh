#!/usr/bin/env bash
# Makes the results behind docs/accuracy-vs-time.md again, and the page.
#
#   docs/studies/run.sh [SIZE...]     sizes: nano (default), coarse, fine
#
# The studies of a scene share a folder, and so the runs that they have in common.
# What is there already is kept: delete out/studies for new times. STUDY_OPTIONS
# goes to every study, for example STUDY_OPTIONS="--repeat 3"; ONLY names the
# tables to make, for example ONLY="matrix precision", and SPLITTINGS the columns of
# Table 1. ONLY="stack" makes Table 8; ONLY="garments" makes Table 7 on the sewing
# patterns of GARMENTS, a folder with garments/*.json and bodies/*.obj, with edges of
# EDGE metres (0.02), on THREADS threads (1; wall time with more). ONLY="yarns" makes those of cloth of yarns.
set -euo pipefail
cd "$(dirname "$0")/../.."
selvedge=${SELVEDGE:-target/release/selvedge}
test -x "$selvedge" || cargo build --release
sizes=("$@")
test ${#sizes[@]} -gt 0 || sizes=(nano)
only=${ONLY:-newton linear matrix precision preconditioner reorder scatter cumulative}

# The settings that the paper chose, for whatever is not varied.
chosen=(--set integrator.residual_norm=paper --set integrator.newton_tolerance=1e-3
    --set solver.tolerance=1e-2 --set integrator.step_splitting=0.75 --set assembly.threads=1)
# A reference that differs in tolerances alone, as the paper's does.
tight=(--plain-reference --reference integrator.newton_tolerance=1e-7)

keep() { # NAME FOLDER
    mkdir -p "docs/studies/$1"
    cp "$2"/study.{csv,json} "docs/studies/$1"
}

asked() { # TABLE
    case " $only " in *" $1 "*) ;; *) return 1 ;; esac
}

study() { # TABLE SIZE FABRIC OPTIONS...
    local table=$1 size=$2 fabric=$3 name=twist-$2-$3-$1 folder=out/studies/twist-$2-$3
    shift 3
    asked "$table" || return 0
    # shellcheck disable=SC2086
    "$selvedge" study "scenes/study/twist-$size-$fabric.toml" --time cpu --resume \
        "${chosen[@]}" "$@" ${STUDY_OPTIONS:-} -o "$folder"
    keep "$name" "$folder"
}

stack() { # NAME SHEETS OPTIONS...
    local name=$1 sheets=$2 folder=out/studies/stack-$1
    shift 2
    # shellcheck disable=SC2086
    "$selvedge" study "scenes/study/stack-$sheets.toml" --time cpu --resume --jobs 2 \
        --plain-reference --reference integrator.max_step=5e-4 \
        --reference integrator.newton_tolerance=1e-4 --reference solver.tolerance=1e-4 --vary integrator.max_step=1e-3,2e-3,4e-3 \
        "$@" ${STUDY_OPTIONS:-} -o "$folder"
    keep "stack-$name" "$folder"
}

garment() { # NAME BODY
    local name=$1 edge=${EDGE:-0.02} threads=${THREADS:-1} time=cpu folder
    folder=out/studies/garment-$name-$edge
    if test "$threads" -gt 1; then
        time=wall folder=$folder-$threads-threads
    fi
    local base=${GARMENTS:?a folder with garments/*.json and bodies/*.obj}
    mkdir -p out/studies
    cat > "out/studies/$name-$edge.toml" <<EOF
name = "$name"
[simulation]
duration = ${DURATION:-0.1}
[assemble]
seam_time = 0.1
settle_time = 0.05
coarsest = 0
[mesh]
edge_length = $edge
[fabric.garment]
library = "cotton-jersey"
[[cloth]]
kind = "pattern"
file = "$(realpath "$base")/garments/$name.json"
fabric = "garment"
hold = ["auto"]
[[body]]
kind = "mesh"
file = "$(realpath "$base")/bodies/$2.obj"
EOF
    # shellcheck disable=SC2086
    "$selvedge" study "out/studies/$name-$edge.toml" --time $time --resume --jobs "${JOBS:-1}" --plain-reference \
        --set "assembly.threads=$threads" --vary "$features" ${STUDY_OPTIONS:-} -o "$folder"
    local kept=${folder#out/studies/}
    keep "${kept/-0.02/}" "$folder"
}

yarns() { # SCENE DURATION STEPS
    local scene=$1 duration=$2 steps=$3 folder=out/studies/yarn-$1 table
    shift 3
    for table in "" -preconditioner -precision; do
        case $table in
        -preconditioner) set -- --vary solver.preconditioner=node-ic,node-jacobi ;;
        -precision) set -- --vary solver.precision=f64,mixed ;;
        *) set -- --vary "integrator.max_step=$steps" --vary solver.tolerance=1e-1,1e-2,1e-3 ;;
        esac
        # shellcheck disable=SC2086
        "$selvedge" study "scenes/yarn/$scene.toml" --time cpu --resume \
            --set "simulation.duration=$duration" --set assembly.threads=1 --plain-reference \
            --reference integrator.max_step=2.5e-4 --reference solver.tolerance=1e-4 \
            "$@" ${STUDY_OPTIONS:-} -o "$folder"
        keep "yarn-$scene$table" "$folder"
        test -n "$table" || python3 docs/studies/pareto.py "$folder/study.html" "docs/images/pareto-${scene%%-*}.svg"
    done
}

features="solver.matrix&solver.precision&solver.preconditioner&assembly.reorder&assembly.scatter=\
reassembled&f64&none&none&atomics,dual&f64&none&none&atomics,dual&mixed&none&none&atomics,\
dual&mixed&block-jacobi&none&atomics,dual&mixed&block-jacobi&rcm&atomics,\
dual&mixed&block-jacobi&rcm&coloured,dual&mixed&auto&rcm&coloured"

if asked stack; then
    sheet='cloth.0.points=[34,34]' bending=fabric.sheet.bending.rigidity
    stack baseline 1
    stack coarse 1 --set "$sheet"
    stack stiff-stretch 1 --set fabric.sheet.membrane.stiffness=5e4
    stack compliant-bending 1 --set $bending=5e-6
    stack stiff-bending 1 --set $bending=5e-4
    stack two 2
    stack three 3
fi
if asked yarns; then
    yarns rib-stretch 2 4e-3,2e-3,1e-3,5e-4
    yarns pullover 0.02 2e-3,1e-3,5e-4
fi
if asked garments; then
    for name in ${NAMES:-g005 g016 g018 g033 g046 g061 g071 g072 hoody_mean shirt_mean}; do
        garment "$name" mean_all
    done
fi

for size in "${sizes[@]}"; do
    for fabric in ${FABRICS:-soft stiff}; do
        study matrix "$size" "$fabric" "${tight[@]}" --vary solver.matrix=reassembled,dual
        study precision "$size" "$fabric" "${tight[@]}" --vary solver.precision=f64,mixed
        study preconditioner "$size" "$fabric" "${tight[@]}" --vary \
            solver.preconditioner=none,diagonal,block-jacobi,incomplete-cholesky,chebyshev,multigrid
        study reorder "$size" "$fabric" "${tight[@]}" --vary assembly.reorder=none,rcm
        study scatter "$size" "$fabric" "${tight[@]}" --set assembly.threads=2 \
            --vary assembly.scatter=atomics,coloured
        study cumulative "$size" "$fabric" "${tight[@]}" --vary "$features"
        study linear "$size" "$fabric" "${tight[@]}" \
            --vary integrator.newton_tolerance=1e-5,1e-4,1e-3,1e-2,1e-1 \
            --vary solver.tolerance=1e-3,1e-2,1e-1
        study newton "$size" "$fabric" "${tight[@]}" \
            --vary integrator.newton_tolerance=1e-7,1e-6,1e-5,1e-4,1e-3,1e-2,1e-1 \
            --vary integrator.step_splitting=${SPLITTINGS:-0.25,0.5,0.75}
    done
done
test -n "${NO_PAGE:-}" || "$selvedge" study --document docs/studies/accuracy-vs-time.in.md -o docs/accuracy-vs-time.md
