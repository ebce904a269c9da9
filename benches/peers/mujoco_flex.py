"""Runs MuJoCo's flex on the scene of scenes/bench/sphere-N.toml.

    pip install mujoco numpy
    python benches/peers/mujoco_flex.py 51

Prints CPU seconds per simulated second, the deepest penetration of the sphere
and the mean and largest |edge strain| at the end, to be read beside the
`summary.json` of `selvedge run scenes/bench/sphere-51.toml`.
"""

import argparse
import time

import mujoco
import numpy as np

SIDE, DENSITY, RADIUS, DROP = 1.0, 0.2, 0.3, 0.01
STRETCH, POISSON, BENDING, FRICTION = 5000.0, 0.3, 5e-5, 0.3
# A plate with E t = STRETCH and E t^3 / 12 (1 - nu^2) = BENDING.
THICKNESS = np.sqrt(12 * (1 - POISSON**2) * BENDING / STRETCH)
YOUNG = STRETCH / THICKNESS


def model_xml(points: int, dt: float, gap: float) -> str:
    spacing = SIDE / (points - 1)
    return f"""
<mujoco>
  <option timestep="{dt}" solver="CG" integrator="discrete" tolerance="1e-6"/>
  <size memory="4G"/>
  <worldbody>
    <geom name="ball" type="sphere" size="{RADIUS}" friction="{FRICTION} 0 0"/>
    <flexcomp name="cloth" type="grid" dim="2" count="{points} {points} 1"
              spacing="{spacing} {spacing} {spacing}" pos="0 0 {RADIUS + DROP}"
              radius="{gap}" mass="{DENSITY * SIDE**2}">
      <elasticity young="{YOUNG}" poisson="{POISSON}" thickness="{THICKNESS}" elastic2d="both"/>
      <contact selfcollide="auto" friction="{FRICTION} 0 0"/>
    </flexcomp>
  </worldbody>
</mujoco>"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("points", type=int, nargs="?", default=51)
    parser.add_argument("--dt", type=float, default=2e-3, help="step [s]")
    parser.add_argument("--seconds", type=float, default=1.0, help="simulated time [s]")
    parser.add_argument("--radius", type=float, default=1e-3, help="flex radius [m]")
    args = parser.parse_args()

    model = mujoco.MjModel.from_xml_string(model_xml(args.points, args.dt, args.radius))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    edges = model.flex_edge.reshape(-1, 2)
    rest = np.linalg.norm(
        data.flexvert_xpos[edges[:, 0]] - data.flexvert_xpos[edges[:, 1]], axis=1
    )

    start = time.process_time()
    steps = round(args.seconds / args.dt)
    for _ in range(steps):
        mujoco.mj_step(model, data)
    cpu = time.process_time() - start

    x = data.flexvert_xpos
    length = np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1)
    strain = np.abs(length / rest - 1)
    penetration = RADIUS - np.linalg.norm(x, axis=1).min()
    print(f"mujoco {mujoco.__version__}, {args.points} x {args.points} points, dt {args.dt} s")
    print(f"cpu_s_per_simulated_s {cpu / args.seconds:.2f}")
    print(f"max_penetration_m {max(penetration, 0.0):.2e}")
    print(f"mean_abs_edge_strain {strain.mean():.2e}  max {strain.max():.2e}")
    print(f"finite {bool(np.isfinite(x).all())}")


if __name__ == "__main__":
    main()
