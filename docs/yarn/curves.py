"""Tables and plots of the yarn experiments from the CSV files of measure.sh.

Standard library only. Usage: curves.py RESULTS IMAGES
"""

import csv
import math
import sys
from pathlib import Path

TERMS = ["stitch wrapping [J]", "yarn bending [J]", "yarn stretch [J]"]
WINDOW = 0.05  # s, moving mean of the forces


def steps(folder, pin):
    """Time, way of a pin along x [mm], force on it [N], energies [J]."""
    with open(folder / "run.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    time = [float(r["time [s]"]) for r in rows]
    place = [1e3 * float(r[f"pin.{pin} place x [m]"]) for r in rows]
    force = [float(r[f"pin.{pin} force x [N]"]) for r in rows]
    energy = {t: [float(r[t]) for r in rows] for t in TERMS if t in rows[0]}
    return time, place, smooth(time, force), energy


def smooth(time, values):
    """Mean over WINDOW around every step."""
    sums, out, low, high = [0.0], [], 0, 0
    for v in values:
        sums.append(sums[-1] + v)
    for t in time:
        while time[low] < t - WINDOW / 2:
            low += 1
        while high < len(time) and time[high] <= t + WINDOW / 2:
            high += 1
        out.append((sums[high] - sums[low]) / (high - low))
    return out


def plot(path, title, xlabel, ylabel, curves):
    """Line plot as SVG; curves are (name, points)."""
    width, height, left, bottom, top = 560, 320, 60, 45, 30
    xs = [x for _, c in curves for x, _ in c]
    ys = [y for _, c in curves for _, y in c]
    x0, x1, y0, y1 = min(xs), max(xs), min(0, min(ys)), max(ys)
    at = lambda x, y: (
        left + (x - x0) / (x1 - x0) * (width - left - 15),
        height - bottom - (y - y0) / (y1 - y0) * (height - bottom - top),
    )
    colours = ["#1b6ca8", "#c8553d", "#3a7d44", "#7b4ea3", "#8a6d1f"]
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        f'<text x="{left}" y="18" font-size="14">{title}</text>',
    ]
    for k in range(6):
        x, y = x0 + k / 5 * (x1 - x0), y0 + k / 5 * (y1 - y0)
        px, py = at(x, y)
        out.append(f'<line x1="{left}" x2="{width - 15}" y1="{py:.1f}" y2="{py:.1f}" stroke="#ddd"/>')
        out.append(f'<text x="{left - 6}" y="{py + 4:.1f}" text-anchor="end">{y:.3g}</text>')
        out.append(f'<text x="{px:.1f}" y="{height - bottom + 16}" text-anchor="middle">{x:.3g}</text>')
    out.append(f'<text x="{(left + width) / 2}" y="{height - 8}" text-anchor="middle">{xlabel}</text>')
    out.append(f'<text x="14" y="{height / 2}" transform="rotate(-90 14 {height / 2})" text-anchor="middle">{ylabel}</text>')
    for k, (name, points) in enumerate(curves):
        thin = points[:: max(1, len(points) // 300)]
        line = " ".join("{:.1f},{:.1f}".format(*at(x, y)) for x, y in thin)
        colour = colours[k % len(colours)]
        out.append(f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
        out.append(f'<text x="{left + 12}" y="{top + 16 + 15 * k}" fill="{colour}">{name}</text>')
    path.write_text("\n".join(out) + "\n</svg>\n")


def rib(results, images):
    time, place, force, energy = steps(results / "rib-stretch", 1)
    start = min(range(len(place)), key=lambda i: place[i])
    low = place[start]
    pulled = range(start, len(place))
    terms = [t for t in TERMS if t in energy]
    names = [t.removesuffix(" [J]") for t in terms]
    print("| distance [mm] | force [N] | " + " | ".join(f"{n} [mJ]" for n in names) + " | grows most |")
    print("|---|---|" + "---|" * (len(terms) + 1))
    last = start
    # Closer where the curve turns.
    ways = [*range(10, 61, 10), *range(64, 200, 4)]
    for way in [w for w in ways if w <= place[-1] - low]:
        i = min(pulled, key=lambda i: abs(place[i] - low - way))
        grown = {t: energy[t][i] - energy[t][last] for t in terms}
        most = max(terms, key=lambda t: grown[t]).removesuffix(" [J]")
        most = most if max(grown.values()) > 0 else "–"
        cells = " | ".join(f"{1e3 * (energy[t][i] - energy[t][start]):.3f}" for t in terms)
        print(f"| {way} | {force[i]:.4f} | {cells} | {most} |")
        last = i
    curve = [(place[i] - low, force[i]) for i in pulled]
    plot(images / "rib-stretch.svg", "2×2 rib stretched across", "distance [mm]", "force [N]", [("right pin", curve)])


def width(folder):
    """Width in mm of the rectangle with the same second moment along x."""
    with open(folder / "final.obj") as file:
        x = [float(line.split()[1]) for line in file if line.startswith("v ")]
    mean = sum(x) / len(x)
    return 1e3 * math.sqrt(12 * sum((a - mean) ** 2 for a in x) / len(x))


def overstretch(results):
    print("| friction | width before [mm] | under 0.3 N [mm] | after [mm] | never pulled [mm] | permanent [%] |")
    print("|---|---|---|---|---|---|")
    for mu in ["0", "0.1", "0.3", "1"]:
        widths = [width(results / f"overstretch-{mu}-{of}") for of in ["1", "2", "8", "alone"]]
        before, pulled, after, alone = widths
        print(f"| {mu} | {before:.2f} | {pulled:.2f} | {after:.2f} | {alone:.2f} | {100 * (after / alone - 1):.1f} |")


def capstan(results):
    time, place, force, _ = steps(results / "capstan", 2)
    print(f"capstan: {force[-1]:.5f} N at {place[-1]:.3f} mm")


if __name__ == "__main__":
    results, images = Path(sys.argv[1]), Path(sys.argv[2])
    capstan(results)
    rib(results, images)
    overstretch(results)
