"""The time within the planned stride at which a controller is, and the detection of heel strikes.

The clock advances with time and is corrected where a phase variable is planned to move fast enough. A heel strike in the
second half of a swing restarts it.
"""

CORRECTION_RATE_1_S = 30.0
LARGEST_CORRECTION = 1.0
LANDING = 0.5
LOADED_N = 50.0
UNLOADED_N = 20.0


class FootContact:
    """Whether a foot is loaded, and whether it has been off the ground since its last heel strike."""

    def __init__(self) -> None:
        self.loaded = True
        self._lifted = False

    def update(self, force_n: float) -> None:
        if force_n > LOADED_N:
            self.loaded = True
        elif force_n < UNLOADED_N:
            self.loaded = False
            self._lifted = True

    def take_heel_strike(self) -> bool:
        strike = self.loaded and self._lifted
        if strike:
            self._lifted = False
        return strike


class StrideClock:
    """A clock that starts with the stride."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def restart_at(self, planned_s: float, swing_s: tuple[float, float], foot: FootContact) -> bool:
        """Restarts at the planned time of a heel strike if the foot lands late in its swing."""
        is_late = self.time_s >= swing_s[0] + LANDING * (swing_s[1] - swing_s[0])
        strikes = is_late and foot.take_heel_strike()
        if strikes:
            self.time_s = planned_s
        return strikes

    def advance(self, period_s: float, end_s: float, phase_error: float, planned_rate: float, slowest: float) -> None:
        """Advances at most to `end_s`. `phase_error` is the measured minus the planned phase variable."""
        correction = 0.0
        if abs(planned_rate) >= slowest:
            late_s = phase_error / planned_rate
            correction = min(max(CORRECTION_RATE_1_S * late_s, -LARGEST_CORRECTION), LARGEST_CORRECTION)
        self.time_s = max(min(self.time_s + period_s * (1.0 + correction), end_s), self.time_s)
