/// Active contacts between features, for inspection and drawing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactSet {
    /// Four nodes each.
    pub nodes: Vec<[u32; 4]>,
    /// Weights of the nodes, which sum to zero; the gap vector is `Σ wᵢ xᵢ`.
    pub weights: Vec<[f64; 4]>,
    /// Unit direction in which the gap opens.
    pub normal: Vec<[f64; 3]>,
    /// Gap \[m\]; negative when the features have passed through each other.
    pub gap: Vec<f64>,
}

impl ContactSet {
    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Whether there is no contact.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Removes all contacts and keeps the memory.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.weights.clear();
        self.normal.clear();
        self.gap.clear();
    }
}

/// Forces and curvatures of active contacts, friction included.
///
/// A contact acts through one vector on its gap. Node `i` receives the force
/// `wᵢ f` \[N\]; the matrix of second derivatives is `w wᵀ ⊗ K`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ContactResponse {
    /// Four nodes each.
    pub nodes: Vec<[u32; 4]>,
    /// Weights of the nodes; they sum to zero.
    pub weights: Vec<[f64; 4]>,
    /// Force on the gap vector \[N\].
    pub force: Vec<[f64; 3]>,
    /// Symmetric positive semidefinite approximation of `-∂force/∂gap` [N/m],
    /// rates expressed through end positions; empty when not asked for.
    pub curvature: Vec<[[f64; 3]; 3]>,
    /// Points in contact with bodies.
    pub body_nodes: Vec<u32>,
    /// Force on each of them \[N\].
    pub body_force: Vec<[f64; 3]>,
    /// As [`curvature`](Self::curvature), with respect to the point.
    pub body_curvature: Vec<[[f64; 3]; 3]>,
}

impl ContactResponse {
    /// Number of contacts of both kinds.
    pub fn len(&self) -> usize {
        self.nodes.len() + self.body_nodes.len()
    }

    /// Whether there is no contact.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Removes all contacts and keeps the memory.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.weights.clear();
        self.force.clear();
        self.curvature.clear();
        self.body_nodes.clear();
        self.body_force.clear();
        self.body_curvature.clear();
    }

    /// Appends the contacts of another response.
    pub fn extend(&mut self, other: &Self) {
        self.nodes.extend_from_slice(&other.nodes);
        self.weights.extend_from_slice(&other.weights);
        self.force.extend_from_slice(&other.force);
        self.curvature.extend_from_slice(&other.curvature);
        self.body_nodes.extend_from_slice(&other.body_nodes);
        self.body_force.extend_from_slice(&other.body_force);
        self.body_curvature.extend_from_slice(&other.body_curvature);
    }

    /// Heap memory held \[bytes\].
    pub fn heap_bytes(&self) -> usize {
        16 * self.nodes.capacity()
            + 32 * self.weights.capacity()
            + 24 * (self.force.capacity() + self.body_force.capacity())
            + 72 * (self.curvature.capacity() + self.body_curvature.capacity())
            + 4 * self.body_nodes.capacity()
    }
}
