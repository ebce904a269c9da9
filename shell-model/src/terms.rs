//! From a mesh and fabrics to terms of a plan.

use selvedge_energy::{Batch, EnergyBatch};

use crate::bending::{AngleLaw, QuadraticRest};
use crate::fabric::Fabric;
use crate::mesh::{Hinge, ShellMesh};
use crate::{
    Attachment, BendingHinge, BendingQuadratic, Damping, DampingKind, DirectionalRigidity,
    HingeNorm, HingeRest, IncrementalDamping, MembraneGuard, MembraneStVk, ModelError, PlainAngle,
    PointDrag, RateDamping, RigidTrims, SharedScalar, SharedTargets, TangentAngle, TrimBody,
    TrimThread, Undamped, WeightedSpring,
};

/// A term of a plan.
pub type Term = Box<dyn EnergyBatch>;

/// Choices of [`bending_term`].
#[derive(Clone, Copy, Debug)]
pub struct BendingOptions<'a> {
    /// Internal friction.
    pub damping: DampingKind,
    /// The energy.
    pub model: BendingModel,
    /// Magnify the anisotropy so that the sheet, not the single hinge, shows
    /// the fabric's law; see [`DirectionalRigidity::calibrated`].
    pub calibrated: bool,
    /// Meaning of the fabric's rigidity.
    pub norm: HingeNorm,
    /// Rest angle of every hinge \[rad\], in the mesh's order; flat if `None`.
    pub rest_angles: Option<&'a [f64]>,
}

impl Default for BendingOptions<'_> {
    fn default() -> Self {
        Self {
            damping: DampingKind::Rate,
            model: BendingModel::Hinge,
            calibrated: true,
            norm: HingeNorm::Plate,
            rest_angles: None,
        }
    }
}

/// Energies of bending.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum BendingModel {
    /// [`BendingHinge`] in the angle.
    #[default]
    Hinge,
    /// [`BendingHinge`] in `2 tan(θ/2)`.
    HingeTangent,
    /// [`BendingQuadratic`]; flat rest shape, no friction.
    Quadratic,
}

/// Lumped masses `m_i = Σ ρ A/3` of the mesh's points \[kg\]. Isolated points
/// have none.
///
/// # Errors
/// [`ModelError::FabricOutOfRange`]; [`ModelError::Fabric`] for a density
/// that is not positive and finite.
pub fn lumped_masses(mesh: &ShellMesh, fabrics: &[Fabric]) -> Result<Vec<f64>, ModelError> {
    check_fabrics(mesh, fabrics)?;
    let mut masses = vec![0.0; mesh.points()];
    for (t, points) in mesh.triangles().iter().enumerate() {
        let share = fabrics[usize::from(mesh.fabric()[t])].density * mesh.rest_area(t) / 3.0;
        for p in points {
            masses[*p as usize] += share;
        }
    }
    Ok(masses)
}

/// [`MembraneStVk`] over all triangles. Friction whose time is zero in every
/// fabric is left out whatever `damping` says.
///
/// # Errors
/// [`ModelError::FabricOutOfRange`]; [`ModelError::Fabric`] for moduli that are
/// not positive semidefinite (zero is allowed) or a negative `β_s`.
pub fn membrane_term(
    mesh: &ShellMesh,
    fabrics: &[Fabric],
    damping: DampingKind,
) -> Result<Term, ModelError> {
    check_fabrics(mesh, fabrics)?;
    let laws: Vec<_> = fabrics
        .iter()
        .map(|f| (f.membrane, f.membrane_damping))
        .collect();
    fn batch<D: Damping>(mesh: &ShellMesh, laws: &[(crate::fabric::MembraneModuli, f64)]) -> Term {
        Box::new(Batch::<_, 3, 9>::new(
            "membrane",
            MembraneStVk::<D>::new(mesh, laws),
        ))
    }
    let any = fabrics.iter().any(|f| f.membrane_damping > 0.0);
    Ok(match damping {
        DampingKind::Rate if any => batch::<RateDamping>(mesh, &laws),
        DampingKind::Incremental if any => batch::<IncrementalDamping>(mesh, &laws),
        _ => batch::<Undamped>(mesh, &laws),
    })
}

/// [`MembraneGuard`] at a tenth of the rest area with a tenth of the softer
/// modulus.
///
/// # Errors
/// As [`membrane_term`].
pub fn membrane_guard_term(mesh: &ShellMesh, fabrics: &[Fabric]) -> Result<Term, ModelError> {
    check_fabrics(mesh, fabrics)?;
    let stiffness: Vec<f64> = fabrics
        .iter()
        .map(|f| 0.1 * f.membrane.warp.min(f.membrane.weft))
        .collect();
    let guard = MembraneGuard::new(mesh, &stiffness, MembraneGuard::ONSET);
    Ok(Box::new(Batch::<_, 3, 9>::new("membrane guard", guard)))
}

/// Bending over all hinges. Friction whose time is zero in every fabric is
/// left out whatever `options` say.
///
/// # Errors
/// [`ModelError::FabricOutOfRange`]; [`ModelError::Length`] for rest angles
/// that are not one a hinge; [`ModelError::NotFinite`] for a rest angle;
/// [`ModelError::Fabric`] for a rigidity that is negative in some direction
/// (zero is allowed) or a negative `β_b`.
pub fn bending_term(
    mesh: &ShellMesh,
    fabrics: &[Fabric],
    options: &BendingOptions<'_>,
) -> Result<Term, ModelError> {
    let rest = hinge_rest(mesh, fabrics, options)?;
    if options.model == BendingModel::Quadratic {
        let rows: Vec<QuadraticRest> = mesh
            .hinges()
            .iter()
            .zip(&rest)
            .map(|(hinge, rest)| {
                let [one, two] = mesh.wings(hinge);
                QuadraticRest {
                    points: hinge.points,
                    stiffness: rest.stiffness,
                    feet: [one.foot, 1.0 - two.foot],
                    heights: rest.heights,
                }
            })
            .collect();
        return Ok(Box::new(Batch::<_, 4, 12>::new(
            "bending",
            BendingQuadratic::new(&rows),
        )));
    }
    fn batch<D: Damping, L: AngleLaw>(rest: &[HingeRest]) -> Term {
        Box::new(Batch::<_, 4, 12>::new(
            "bending",
            BendingHinge::<D, L>::new(rest),
        ))
    }
    fn with_law<L: AngleLaw>(damping: DampingKind, rest: &[HingeRest]) -> Term {
        match damping {
            DampingKind::Off => batch::<Undamped, L>(rest),
            DampingKind::Rate => batch::<RateDamping, L>(rest),
            DampingKind::Incremental => batch::<IncrementalDamping, L>(rest),
        }
    }
    let any = fabrics.iter().any(|f| f.bending_damping > 0.0);
    let damping = if any {
        options.damping
    } else {
        DampingKind::Off
    };
    Ok(match options.model {
        BendingModel::HingeTangent => with_law::<TangentAngle>(damping, &rest),
        _ => with_law::<PlainAngle>(damping, &rest),
    })
}

/// Rest data of every hinge,
///
/// ```text
/// k_e = c_b B(ψ_e) l̄²/(Ā_1 + Ā_2)
/// ```
/// with `ψ_e` the angle between the warp and the normal of the edge. Where
/// the wings differ (a seam), `B`, `l̄` and `β_b` are means of both.
///
/// # Errors
/// As [`bending_term`].
pub fn hinge_rest(
    mesh: &ShellMesh,
    fabrics: &[Fabric],
    options: &BendingOptions<'_>,
) -> Result<Vec<HingeRest>, ModelError> {
    check_fabrics(mesh, fabrics)?;
    let hinges = mesh.hinges();
    if let Some(angles) = options.rest_angles {
        let (expected, found) = (hinges.len(), angles.len());
        if expected != found {
            return Err(ModelError::Length {
                what: "rest angles",
                expected,
                found,
            });
        }
        if let Some(index) = angles.iter().position(|a| !a.is_finite()) {
            return Err(ModelError::NotFinite {
                what: "rest angle",
                index,
            });
        }
    }
    let laws: Vec<DirectionalRigidity> = fabrics
        .iter()
        .map(|f| {
            let law = DirectionalRigidity::from(&f.bending);
            if options.calibrated {
                law.calibrated().unwrap_or(law)
            } else {
                law
            }
        })
        .collect();
    let rest = |(e, hinge): (usize, &Hinge)| {
        let wings = mesh.wings(hinge);
        let fabric = |w: usize| usize::from(mesh.fabric()[hinge.triangles[w] as usize]);
        let mean = |f: &dyn Fn(usize) -> f64| 0.5 * (f(0) + f(1));
        // The bending direction is the normal of the edge.
        let rigidity = mean(&|w| {
            let [c, s] = wings[w].direction;
            laws[fabric(w)].along([-s, c]).max(0.0)
        });
        let length = mean(&|w| wings[w].length);
        let areas = wings[0].area + wings[1].area;
        HingeRest {
            points: hinge.points,
            stiffness: options.norm.factor() * rigidity * length * length / areas,
            angle: options.rest_angles.map_or(0.0, |angles| angles[e]),
            length,
            heights: [wings[0].height, wings[1].height],
            damping: mean(&|w| fabrics[fabric(w)].bending_damping),
        }
    };
    Ok(hinges.iter().enumerate().map(rest).collect())
}

/// Fabrics too anisotropic for the calibration of hinges, which
/// [`bending_term`] therefore takes as they are; worth a warning.
pub fn uncalibrated(fabrics: &[Fabric]) -> Vec<usize> {
    (0..fabrics.len())
        .filter(|i| {
            DirectionalRigidity::from(&fabrics[*i].bending)
                .calibrated()
                .is_none()
        })
        .collect()
}

/// [`PointDrag`] with `α` of the fabrics, weighted by mass where fabrics meet,
/// or `None` when no fabric has drag.
///
/// # Errors
/// As [`lumped_masses`].
pub fn drag_term(mesh: &ShellMesh, fabrics: &[Fabric]) -> Result<Option<Term>, ModelError> {
    check_fabrics(mesh, fabrics)?;
    let mut coefficients = vec![0.0; mesh.points()];
    for (t, points) in mesh.triangles().iter().enumerate() {
        let fabric = &fabrics[usize::from(mesh.fabric()[t])];
        for p in points {
            coefficients[*p as usize] += fabric.drag * fabric.density * mesh.rest_area(t) / 3.0;
        }
    }
    let drag = PointDrag::new(&coefficients);
    let any = coefficients.iter().any(|c| *c != 0.0);
    Ok(any.then(|| Box::new(Batch::<_, 1, 3>::new("drag", drag)) as Term))
}

/// Seam springs: each point sewn to `(1−w) x_j + w x_k`.
pub fn seam_term(pairs: &[(u32, [u32; 2], f64)], stiffness: SharedScalar) -> Term {
    Box::new(Batch::<_, 3, 9>::new(
        "seam",
        WeightedSpring::seam(pairs, stiffness),
    ))
}

/// Seam springs from point to point.
pub fn joint_term(pairs: &[[u32; 2]], stiffness: SharedScalar) -> Term {
    Box::new(Batch::<_, 2, 6>::new(
        "joint",
        WeightedSpring::joint(pairs, stiffness),
    ))
}

/// Springs from points to places in triangles: buttonholes, pockets.
pub fn patch_term(pairs: &[(u32, [u32; 3], [f64; 3])], stiffness: SharedScalar) -> Term {
    Box::new(Batch::<_, 4, 12>::new(
        "buttonhole",
        WeightedSpring::patch(pairs, stiffness),
    ))
}

/// Springs of `stiffness` [N/m] from points to moving targets.
///
/// # Errors
/// [`ModelError::Length`] when there is not one target a point.
pub fn attachment_term(
    points: &[u32],
    stiffness: f64,
    targets: SharedTargets,
) -> Result<Term, ModelError> {
    let (expected, found) = (points.len(), targets.len());
    if expected != found {
        return Err(ModelError::Length {
            what: "attachment targets",
            expected,
            found,
        });
    }
    let attachment = Attachment::new(points, vec![stiffness; points.len()], targets);
    Ok(Box::new(Batch::<_, 1, 3>::new("attachment", attachment)))
}

/// Threads that hold rigid trims.
///
/// # Errors
/// [`ModelError::Parameter`] for a thread of a body that does not exist.
pub fn trim_term(bodies: &[TrimBody], threads: &[TrimThread]) -> Result<Term, ModelError> {
    if let Some(thread) = threads.iter().find(|t| t.body >= bodies.len()) {
        return Err(ModelError::Parameter {
            what: "body of a trim's thread",
            value: thread.body as f64,
            allowed: "the index of a body",
        });
    }
    Ok(Box::new(Batch::<_, 5, 15>::new(
        "trim",
        RigidTrims::new(bodies, threads),
    )))
}

/// Energies need less than [`Fabric::validate`] asks: zero stiffness is fine.
fn check_fabrics(mesh: &ShellMesh, fabrics: &[Fabric]) -> Result<(), ModelError> {
    let fabric_of = mesh.fabric().iter().enumerate();
    if let Some((triangle, &fabric)) = fabric_of
        .into_iter()
        .find(|(_, f)| usize::from(**f) >= fabrics.len())
    {
        return Err(ModelError::FabricOutOfRange {
            triangle,
            fabric,
            fabrics: fabrics.len(),
        });
    }
    for f in fabrics {
        let c = &f.membrane;
        let semidefinite = c.coupling * c.coupling <= c.warp * c.weft;
        let least = DirectionalRigidity::from(&f.bending).min();
        let round_off = 1e-12 * (f.bending.warp + f.bending.weft);
        for (what, value, fine, allowed) in [
            ("density", f.density, f.density > 0.0, "positive and finite"),
            ("membrane.warp", c.warp, c.warp >= 0.0, "zero or positive"),
            ("membrane.weft", c.weft, c.weft >= 0.0, "zero or positive"),
            (
                "membrane.shear",
                c.shear,
                c.shear >= 0.0,
                "zero or positive",
            ),
            (
                "membrane.coupling",
                c.coupling,
                semidefinite,
                "at most √(warp·weft)",
            ),
            (
                "smallest bending rigidity",
                least,
                least >= -round_off,
                "zero or positive",
            ),
            (
                "membrane_damping",
                f.membrane_damping,
                f.membrane_damping >= 0.0,
                "zero or positive",
            ),
            (
                "bending_damping",
                f.bending_damping,
                f.bending_damping >= 0.0,
                "zero or positive",
            ),
            ("drag", f.drag, f.drag >= 0.0, "zero or positive"),
        ] {
            if !(fine && value.is_finite()) {
                return Err(ModelError::Fabric {
                    fabric: f.name.clone(),
                    what,
                    value,
                    allowed,
                });
            }
        }
    }
    Ok(())
}
