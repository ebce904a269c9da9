"""Times the IPC Toolkit on the folded sheet of the collision crate.

    pip install ipctk numpy scipy
    RAYON_NUM_THREADS=1 taskset -c 0 cargo run --release -p selvedge-collision \
        --example peer_folded_sheet -- /tmp/folded
    taskset -c 0 python benches/peers/ipc_toolkit.py /tmp/folded

Prints the processor seconds of candidates, of the collision set and of the projected
Hessian of the barrier on the mesh and points that the example has written, to
be read beside what the example prints. One thread.
"""

import argparse
import importlib.metadata
import time
from pathlib import Path

import ipctk
import numpy as np

# As in the example [m]; the stiffness has no part in the time.
THICKNESS, STIFFNESS = 1.2e-3, 100.0


def seconds(work):
    start = time.process_time()
    result = work()
    return time.process_time() - start, result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--broad-phase", default="LBVH", help="class of ipctk: LBVH, HashGrid, SweepAndPrune, ..."
    )
    args = parser.parse_args()

    ipctk.set_num_threads(1)
    x = np.fromfile(args.folder / "positions.f64").reshape(-1, 3)
    x = np.asfortranarray(x)
    faces = np.fromfile(args.folder / "triangles.u32", dtype=np.uint32).reshape(-1, 3)
    faces = faces.astype(np.int32)
    mesh = ipctk.CollisionMesh(x, ipctk.edges(faces), faces)
    potential = ipctk.BarrierPotential(THICKNESS, STIFFNESS)
    version = importlib.metadata.version("ipctk")
    print(f"ipctk {version}, {args.broad_phase}, {len(x)} points, {len(faces)} triangles")

    broad = getattr(ipctk, args.broad_phase)()
    candidates, collisions = ipctk.Candidates(), ipctk.NormalCollisions()
    found, _ = seconds(lambda: candidates.build(mesh, x, 0.5 * THICKNESS, broad))
    narrow, _ = seconds(lambda: collisions.build(candidates, mesh, x, THICKNESS))
    hessian, h = seconds(
        lambda: potential.hessian(collisions, mesh, x, ipctk.PSDProjectionMethod.CLAMP)
    )
    print(
        f"processor s: candidates {found:.3f}, with the collision set {found + narrow:.3f}; "
        f"projected Hessian {hessian:.3f} ({h.nnz} entries)"
    )
    print(
        f"{len(candidates.fv_candidates)} face-vertex and {len(candidates.ee_candidates)} "
        f"edge-edge candidates, {len(collisions)} collisions: "
        f"{len(collisions.fv_collisions)} fv, {len(collisions.ee_collisions)} ee, "
        f"{len(collisions.ev_collisions)} ev, {len(collisions.vv_collisions)} vv"
    )


if __name__ == "__main__":
    main()
