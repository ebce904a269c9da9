/// When a sliding contact counts as sticking.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StickRule {
    /// At every iterate of a step: the spring pulls with at most the limit.
    #[default]
    Iterate,
    /// Once, at the start of a step [Cirio2017]: a spring that sticks then
    /// may pull with more than the limit at the step's end.
    Start,
}

/// One anchored spring in a step.
pub(super) struct Law {
    pub stick: StickRule,
    pub stiffness: f64,
    /// `d_f/dt`
    pub viscosity: f64,
    pub limit: f64,
    pub d: f64,
    pub d_start: f64,
}

#[derive(Clone, Copy, Default)]
pub(super) struct Pull {
    pub value: f64,
    pub gradient: f64,
    pub second: f64,
    /// Whether the anchor follows.
    pub slips: bool,
}

impl Law {
    #[inline(always)]
    pub fn pull(&self) -> Pull {
        let second = self.stiffness + self.viscosity;
        let force = self.stiffness * self.d + self.viscosity * (self.d - self.d_start);
        let slips = match self.stick {
            StickRule::Iterate => force.abs() > self.limit,
            StickRule::Start => self.stiffness * self.d_start.abs() > self.limit,
        };
        if self.limit <= 0.0 {
            return Pull {
                slips: true,
                ..Pull::default()
            };
        }
        if !slips {
            return Pull {
                value: 0.5 * force * force / second,
                gradient: force,
                second,
                slips,
            };
        }
        let gradient = match self.stick {
            StickRule::Iterate => self.limit.copysign(force),
            StickRule::Start => self.limit.copysign(self.d_start),
        };
        Pull {
            value: (gradient * force - 0.5 * self.limit * self.limit) / second,
            gradient,
            second: 0.0,
            slips,
        }
    }

    /// How far the anchor goes after the step.
    pub fn follow(&self) -> f64 {
        if !self.pull().slips {
            return 0.0;
        }
        let most = self.limit.max(0.0) / self.stiffness;
        // A spring that came back within its limit stays.
        match self.d.abs() > most {
            true => self.d - most.copysign(self.d),
            false => 0.0,
        }
    }
}
