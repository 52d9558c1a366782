//! Detection of heel strikes and foot lift from the vertical force on a foot.

/// Force above which a foot counts as loaded, N.
const LOADED_N: f64 = 50.0;
/// Force below which it counts as unloaded, N. Gait laboratories use 20 N.
const UNLOADED_N: f64 = 20.0;

/// Whether a foot is loaded, and whether it has been off the ground since the last heel strike.
#[derive(Debug, Clone, Copy)]
pub(super) struct FootContact {
    pub(super) loaded: bool,
    lifted: bool,
}

impl FootContact {
    pub(super) fn new(loaded: bool) -> Self {
        Self { loaded, lifted: !loaded }
    }

    pub(super) fn update(&mut self, force_n: f64) {
        if force_n > LOADED_N {
            self.loaded = true;
        } else if force_n < UNLOADED_N {
            self.loaded = false;
            self.lifted = true;
        }
    }

    /// Whether a heel strike is due: the foot is on the ground again. Only asked late in swing, because a foot that scuffs
    /// the ground has not landed.
    pub(super) fn take_heel_strike(&mut self) -> bool {
        let strike = self.loaded && self.lifted;
        if strike {
            self.lifted = false;
        }
        strike
    }
}
