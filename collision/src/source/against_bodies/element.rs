use std::ops::Range;

use super::{Guard, Pass, Search};
use crate::vec3::{Mat3, Vec3};
use crate::{ContactResponse, LaggedResponse, Repulsion};

/// What of the cloth meets bodies: its points or its triangles.
pub trait BodyElement: Element {}

impl<E: Element> BodyElement for E {}

/// A body and an element of the cloth, in the order of candidates and anchors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BodyPair {
    pub body: u32,
    pub element: u32,
}

/// An element that may come near a body within a step; `W` are the weights of
/// its corners where it is expected to touch.
#[derive(Clone, Copy, Debug)]
pub struct Candidate<W> {
    pub of: BodyPair,
    pub weights: W,
}

/// What friction remembers of a touching element: a point of it, and a place in
/// the body's frame (anchored) or the normal force of the last step (lagged)
/// \[N\].
#[derive(Clone, Copy, Debug)]
pub struct Anchor<W> {
    pub of: BodyPair,
    pub weights: W,
    pub place: Vec3,
}

/// A touching element.
#[derive(Clone, Copy, Debug)]
pub struct Touch<W> {
    pub of: BodyPair,
    /// Weights of its corners at the point that touches.
    pub weights: W,
    /// Distance of that point \[m\], and its gradient as the element can follow
    /// it.
    pub distance: f64,
    pub slope: Vec3,
    /// Velocity of the surface there [m/s].
    pub velocity: Vec3,
    pub repulsion: Repulsion,
    /// Unit normal.
    pub normal: Vec3,
    /// Normal force that friction goes by \[N\], its size and as a vector.
    pub normal_force: f64,
    pub pressing: Vec3,
    /// The part that another contact has already: a point, its energy \[J\] and
    /// what its force is lowered by \[N\].
    pub corner: Option<(u32, f64, Vec3)>,
}

/// A body's distance is not finite at an element.
pub struct NotFinite;

/// Scratch `S` and results of one task.
#[derive(Clone, Debug, Default)]
pub struct Task<W, S> {
    pub scratch: S,
    pub candidates: Vec<Candidate<W>>,
    /// What was learnt of the distances of elements.
    pub guards: Vec<(u32, Guard)>,
    /// Fast arrivals and their stiffness [N/m].
    pub impacts: Vec<(BodyPair, f64)>,
    /// First element that a body runs over within the step.
    pub overrun: Option<Overrun>,
    pub response: ContactResponse,
    pub memory: Vec<Anchor<W>>,
    pub energy: f64,
    pub deepest: f64,
    pub active: usize,
    pub deep: usize,
    pub bad: Option<BodyPair>,
}

/// An element that a body runs over, how far, and how far it may \[m\].
#[derive(Clone, Copy, Debug)]
pub struct Overrun {
    pub of: BodyPair,
    pub depth: f64,
    pub limit: f64,
}

pub(super) type CandidateOf<E> = Candidate<<E as Element>::Weights>;
pub(super) type AnchorOf<E> = Anchor<<E as Element>::Weights>;
pub(super) type TaskOf<E> = Task<<E as Element>::Weights, <E as Element>::Scratch>;

/// Weights of the corners of an element; none for a point.
pub trait Weights: Copy + Default + Send + Sync + AsRef<[f64]> + AsMut<[f64]> {}

impl<const N: usize> Weights for [f64; N] where Self: Default {}

/// The geometry of one kind of element.
pub trait Element: Send + Sync + Sized {
    /// Name in reports.
    const NAME: &'static str;
    /// Candidates that a task evaluates.
    const CHUNK: usize;
    /// Whether all candidates of a task are of the same body.
    const ONE_BODY: bool;

    type Weights: Weights;
    /// Buffers of a task.
    type Scratch: Default + Send + Sync;

    /// Elements that are looked at in a detection.
    fn searched(&self) -> usize;

    /// Elements that are numbered.
    fn total(&self) -> usize;

    /// A point of an element, which errors name.
    fn first_point(&self, element: u32) -> u32;

    /// Points of the elements.
    fn points(&self) -> impl Iterator<Item = u32>;

    /// Appends those of some elements that may touch a body, and what is known
    /// of them then.
    fn search(look: &Search<'_, Self>, range: Range<usize>, task: &mut TaskOf<Self>);

    /// Prepares for [`touch`](Self::touch) of some candidates.
    fn prepare(pass: &Pass<'_, Self>, all: &[CandidateOf<Self>], scratch: &mut Self::Scratch);

    /// How candidate `i` of those prepared touches, if it does.
    fn touch(
        pass: &Pass<'_, Self>,
        c: &CandidateOf<Self>,
        i: usize,
        scratch: &Self::Scratch,
    ) -> Result<Option<Touch<Self::Weights>>, NotFinite>;

    /// Position of a point of an element.
    fn position(&self, element: u32, weights: &Self::Weights, q: &[f64]) -> Vec3;

    /// Mean of the values of points, at a point of an element.
    fn mean(&self, element: u32, weights: &Self::Weights, values: &[f64]) -> f64;

    /// `Σ wᵢ²/mᵢ` from the inverse masses of points [1/kg].
    fn inverse_mass(&self, element: u32, weights: &Self::Weights, inverse_masses: &[f64]) -> f64;

    /// Appends the force of a contact and, unless there is none, its curvature;
    /// with lagged friction that acts at weights of its own.
    fn push(
        &self,
        touch: &Touch<Self::Weights>,
        force: Vec3,
        curvature: Option<Mat3>,
        lagged: Option<(Self::Weights, LaggedResponse)>,
        out: &mut ContactResponse,
    );

    /// Heap memory held \[bytes\], without the scratch of tasks.
    fn heap_bytes(&self) -> usize;

    /// Heap memory of the scratch of a task \[bytes\].
    fn scratch_bytes(scratch: &Self::Scratch) -> usize;
}

impl<W, S> Task<W, S> {
    /// Forgets what a search found.
    pub fn begin_search(&mut self) {
        self.candidates.clear();
        self.guards.clear();
        self.impacts.clear();
        self.overrun = None;
    }

    /// Heap memory held without the scratch \[bytes\].
    pub fn heap_bytes(&self) -> usize {
        self.response.heap_bytes()
            + size_of::<Anchor<W>>() * self.memory.capacity()
            + size_of::<Candidate<W>>() * self.candidates.capacity()
            + size_of::<(u32, Guard)>() * self.guards.capacity()
            + size_of::<(BodyPair, f64)>() * self.impacts.capacity()
    }
}
