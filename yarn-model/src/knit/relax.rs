use super::LoopGraph;

/// Weight of the directions of rows and wales beside that of the distances. A
/// net of distances alone shears freely, and rows squeezed by decreases buckle
/// in zigzags; at 1 no spring longer than half its rest length can buckle.
const UPRIGHT: f64 = 1.0;
const ROUNDS: usize = 60;
const ITERATIONS: usize = 200;

struct Spring {
    from: u32,
    to: u32,
    rest: f64,
    /// Where `to` lies from `from` in an undisturbed cloth.
    upright: [f64; 2],
}

/// Centres of the loops in the plane \[m\], along the row and upwards.
///
/// Loops side by side want to be `course` apart, a loop and its parents `row`;
/// the centres minimise
///
/// ```text
/// Σ ½ (|x_b − x_a| − rest)² + ½ w |x_b − x_a − upright|²,   w = 1
/// ```
/// by turns in the directions and in the places, a linear solve. A chart without
/// increases and decreases gives the exact grid: loop `j` of the chart's row
/// `r` at `(j course, r row)`.
pub fn relaxed_centres(graph: &LoopGraph, course: f64, row: f64) -> Vec<[f64; 2]> {
    let first = graph.row(1).len() as f64;
    let grid = |l: &super::KnitLoop| {
        let count = graph.row(l.row as usize).len() as f64;
        let x = f64::from(l.column) + 0.5 * (first - count);
        [x * course, (f64::from(l.row) - 1.0) * row]
    };
    let mut x: Vec<[f64; 2]> = graph.loops.iter().map(grid).collect();
    if graph.is_regular() {
        return x;
    }
    let springs = springs(graph, course, row);
    for _ in 0..ROUNDS {
        let before = x.clone();
        solve(&springs, &mut x);
        let moved = x.iter().zip(&before).map(|(a, b)| length(minus(*a, *b)));
        if moved.fold(0.0, f64::max) < 1e-5 * course {
            break;
        }
    }
    // The first row of the chart starts where the grid would.
    let row = graph.row(1);
    let mut shift = [0.5 * (first - 1.0) * course, 0.0];
    for l in row {
        for k in 0..2 {
            shift[k] -= x[l as usize][k] / first;
        }
    }
    for p in &mut x {
        *p = [p[0] + shift[0], p[1] + shift[1]];
    }
    x
}

fn springs(graph: &LoopGraph, course: f64, row: f64) -> Vec<Spring> {
    let mut springs = Vec::with_capacity(2 * graph.loops.len());
    for (l, this) in graph.loops.iter().enumerate() {
        let l = l as u32;
        if l + 1 < graph.row(this.row as usize).end {
            springs.push(Spring {
                from: l,
                to: l + 1,
                rest: course,
                upright: [course, 0.0],
            });
        }
        for (k, parent) in this.parent_range().enumerate() {
            let siblings = graph.loops[parent as usize].children;
            let aside = f64::from(this.sibling) - 0.5 * (f64::from(siblings) - 1.0);
            let aside = aside - (k as f64 - 0.5 * (f64::from(this.parents) - 1.0));
            springs.push(Spring {
                from: parent,
                to: l,
                rest: row,
                upright: [aside * course, row],
            });
        }
    }
    springs
}

/// One round: directions from `x`, then conjugate gradients from `x`.
fn solve(springs: &[Spring], x: &mut [[f64; 2]]) {
    let mut residual = vec![[0.0; 2]; x.len()];
    let mut scale = 0.0;
    for s in springs {
        let d = minus(x[s.to as usize], x[s.from as usize]);
        let l = length(d).max(1e-6 * s.rest);
        let mut f = [0.0; 2];
        for k in 0..2 {
            f[k] = d[k] * (s.rest / l - 1.0) + UPRIGHT * (s.upright[k] - d[k]);
        }
        scale += s.rest * s.rest;
        spread(s, f, &mut residual);
    }
    let mut direction = residual.clone();
    let mut product = vec![[0.0; 2]; x.len()];
    let mut rr = dot(&residual, &residual);
    for _ in 0..ITERATIONS {
        if rr <= 1e-16 * scale {
            return;
        }
        product.fill([0.0; 2]);
        for s in springs {
            let d = minus(direction[s.from as usize], direction[s.to as usize]);
            spread(s, d.map(|d| -(1.0 + UPRIGHT) * d), &mut product);
        }
        // Minus the Laplacian: `spread` adds at `to` what it takes at `from`.
        let step = rr / dot(&direction, &product);
        for i in 0..x.len() {
            for k in 0..2 {
                x[i][k] += step * direction[i][k];
                residual[i][k] -= step * product[i][k];
            }
        }
        let next = dot(&residual, &residual);
        let keep = next / rr;
        rr = next;
        for i in 0..x.len() {
            for k in 0..2 {
                direction[i][k] = residual[i][k] + keep * direction[i][k];
            }
        }
    }
}

fn spread(s: &Spring, f: [f64; 2], out: &mut [[f64; 2]]) {
    for k in 0..2 {
        out[s.to as usize][k] += f[k];
        out[s.from as usize][k] -= f[k];
    }
}

fn dot(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| a[0] * b[0] + a[1] * b[1])
        .sum()
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn length(a: [f64; 2]) -> f64 {
    a[0].hypot(a[1])
}
