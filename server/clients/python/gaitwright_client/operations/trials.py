"""Operations with the tag `trials`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Literal, Optional, cast

from ..paging import Pages
from ..schemas import (
    AttemptResult,
    Certificate,
    ControllerFile,
    GaitDocument,
    GaitMotion,
    Iteration,
    Job,
    LocalOptimum,
    NewExecutionReport,
    SolveProblem,
    StudyId,
    Trial,
    TrialExecutionReport,
    TrialExplanation,
    TrialId,
    TrialSensitivities,
    TrialState,
)
from ..transport import Transport
from ..unpack import Unpack

ListTrialsSort = Literal[
    "number", "-number", "state", "-state", "gait_rmse_rad", "-gait_rmse_rad", "cost_of_transport",
    "-cost_of_transport", "iterations", "-iterations", "seconds_total", "-seconds_total", "a1", "-a1", "a2", "-a2",
    "a3", "-a3", "a4", "-a4", "a5", "-a5", "a6", "-a6", "a7", "-a7", "a8", "-a8",
]
ListTrialsRange = Literal["gait_rmse_rad", "cost_of_transport", "a1", "a2", "a3", "a4", "a5", "a6", "a7", "a8"]


class TrialsMethods(Transport):
    """Operations with the tag `trials`."""

    def list_trials(
        self,
        study_id: StudyId,
        *,
        state: Optional[TrialState] = None,
        sort: Optional[ListTrialsSort] = None,
        range: Optional[ListTrialsRange] = None,
        at_least: Optional[float] = None,
        at_most: Optional[float] = None,
        page_size: Optional[int] = None,
    ) -> Pages[Trial]:
        """List trials of a study.

        Sorted by number, unless `sort` names another column. A trial whose value in that column changes while a client
        reads the pages can be missing or occur twice. The number of a trial never changes.

        state: Only trials in this state.

        sort: Column to sort by, such as `gait_rmse_rad`. A leading minus sorts in descending order. Trials without a
        value come last.

        range: Only trials whose value in this column is between `at_least` and `at_most`. Trials without a value are
        left out.

        at_least: Minimum in the column `range`, in the unit of the column. Without it, the range has no lower end.

        at_most: Maximum in the column `range`. Without it, the range has no upper end.
        """
        return Pages(
            self,
            "/api/v1/studies/{id}/trials",
            {"id": study_id},
            query={"state": state, "sort": sort, "range": range, "at_least": at_least, "at_most": at_most, "limit": page_size},
        )

    def get_trials_csv(self, study_id: StudyId) -> str:
        """Download trials as CSV.

        One row for each trial: the value of each bound, state, Gait RMSE, cost of transport, violation, iterations,
        time and reason. Empty where there is no value yet.
        """
        return self.request_text("GET", "/api/v1/studies/{id}/trials.csv", {"id": study_id})

    def get_trial(self, trial_id: TrialId) -> Trial:
        """Get a trial.

        The action, state, reason and result of the trial. Values that do not exist are null.
        """
        return cast(Trial, self.request_json("GET", "/api/v1/trials/{id}", {"id": trial_id}))

    def list_attempts(self, trial_id: TrialId, *, page_size: Optional[int] = None) -> Pages[AttemptResult]:
        """List attempts at a trial.

        Results delivered by workers, including results that arrived too late to count. Sorted by attempt.
        """
        return Pages(self, "/api/v1/trials/{id}/attempts", {"id": trial_id}, query={"limit": page_size})

    def cancel_trial(self, trial_id: TrialId, *, idempotency_key: Optional[str] = None) -> Trial:
        """Cancel a trial.

        The solve stops within one iteration.
        """
        return cast(
            Trial,
            self.request_json(
                "POST",
                "/api/v1/trials/{id}/cancel",
                {"id": trial_id},
                key=idempotency_key,
            ),
        )

    def get_certificate(self, trial_id: TrialId) -> Certificate:
        """Get the certificate of a trial.

        The result of checking the gait independently of the optimiser.
        """
        return cast(Certificate, self.request_json("GET", "/api/v1/trials/{id}/certificate", {"id": trial_id}))

    def request_certificate(self, trial_id: TrialId, *, idempotency_key: Optional[str] = None) -> Job:
        """Request the certificate of a trial.

        The gait of the trial must have converged.
        """
        return cast(
            Job,
            self.request_json(
                "POST",
                "/api/v1/trials/{id}/certificate",
                {"id": trial_id},
                key=idempotency_key,
            ),
        )

    def get_controller_file(self, trial_id: TrialId, *, rate_hz: Optional[float] = None) -> ControllerFile:
        """Download the controller file of a trial.

        The gait must be walkable: converged, with a certificate, and without a safety report in force.

        rate_hz: Sampling rate, 10 to 5000 Hz. Default 200.
        """
        return cast(
            ControllerFile,
            self.request_json(
                "GET",
                "/api/v1/trials/{id}/controller.json",
                {"id": trial_id},
                query={"rate_hz": rate_hz},
            ),
        )

    def get_execution_report(self, trial_id: TrialId) -> TrialExecutionReport:
        """Get the execution report of a trial.

        The newest report of simulated walks with the gait. The simulation does not use the optimiser's model.
        """
        return cast(
            TrialExecutionReport,
            self.request_json(
                "GET",
                "/api/v1/trials/{id}/execution-report",
                {"id": trial_id},
            ),
        )

    def request_execution_report(
        self,
        trial_id: TrialId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewExecutionReport],
    ) -> Job:
        """Request the execution report of a trial.

        The gait of the trial must have converged. Walks on level ground, and on ground uneven by ±5 mm and by ±10 mm,
        are simulated. The same number of simulated walks and seed give the same report.

        Fields: optionally number_of_simulated_walks, seed.
        """
        return cast(
            Job,
            self.request_json(
                "POST",
                "/api/v1/trials/{id}/execution-report",
                {"id": trial_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_explanation(self, trial_id: TrialId) -> TrialExplanation:
        """Get the infeasibility explanation of a trial.

        Names the bounds that conflict, and relaxations that give a gait.
        """
        return cast(TrialExplanation, self.request_json("GET", "/api/v1/trials/{id}/explanation", {"id": trial_id}))

    def request_explanation(self, trial_id: TrialId, *, idempotency_key: Optional[str] = None) -> Job:
        """Request the explanation of a trial.

        The trial must have been solved by the service and not have converged.
        """
        return cast(
            Job,
            self.request_json(
                "POST",
                "/api/v1/trials/{id}/explanation",
                {"id": trial_id},
                key=idempotency_key,
            ),
        )

    def get_gait(self, trial_id: TrialId, *, local_optimum: Optional[int] = None) -> GaitDocument:
        """Get the gait of a trial.

        The trajectory in the format of the optimiser. A gait of another local optimum satisfies the bounds at the
        nodes.

        local_optimum: Number of another local optimum of the trial.
        """
        return cast(
            GaitDocument,
            self.request_json(
                "GET",
                "/api/v1/trials/{id}/gait",
                {"id": trial_id},
                query={"local_optimum": local_optimum},
            ),
        )

    def get_gait_csv(self, trial_id: TrialId) -> str:
        """Download the gait of a trial as CSV.

        Time, domain, coordinates and their derivatives, torques and ground forces; in a study with muscles,
        activations.
        """
        return self.request_text("GET", "/api/v1/trials/{id}/gait.csv", {"id": trial_id})

    def get_opensim_file(self, trial_id: TrialId, *, rate_hz: Optional[float] = None) -> str:
        """Download the gait as an OpenSim motion file.

        One stride from right heel strike, with a column for each coordinate.

        rate_hz: Sampling rate, 10 to 5000 Hz. Default 200.
        """
        return self.request_text("GET", "/api/v1/trials/{id}/gait.mot", {"id": trial_id}, query={"rate_hz": rate_hz})

    def list_iterations(self, trial_id: TrialId, *, page_size: Optional[int] = None) -> Pages[Iteration]:
        """List iterations of a solve.

        The iterations of the running solve so far, or the recorded ones of a solve that has ended. Sorted by iteration.
        """
        return Pages(self, "/api/v1/trials/{id}/iterations", {"id": trial_id}, query={"limit": page_size})

    def list_local_optima(self, trial_id: TrialId, *, page_size: Optional[int] = None) -> Pages[LocalOptimum]:
        """List local optima of a trial.

        The gaits to which the initial guesses of the cold start of the trial led; one of them is the result of the
        trial. Sorted by number. Each is a candidate for the root gait of a study: `solve_options.local_optimum_choice`
        can name its number. Empty after a warm start, without a gait, and in imported studies.
        """
        return Pages(self, "/api/v1/trials/{id}/local-optima", {"id": trial_id}, query={"limit": page_size})

    def get_stick_figures(self, trial_id: TrialId) -> GaitMotion:
        """Get the motion of a gait.

        Stick figures over one stride, for an animation.
        """
        return cast(GaitMotion, self.request_json("GET", "/api/v1/trials/{id}/motion", {"id": trial_id}))

    def get_solve_problem(self, trial_id: TrialId) -> SolveProblem:
        """Download the problem file of a trial.

        Everything that the solve depends on: subject, device, bounds, settings, reference gait, limits and warm start.
        """
        return cast(SolveProblem, self.request_json("GET", "/api/v1/trials/{id}/problem.json", {"id": trial_id}))

    def retry_trial(self, trial_id: TrialId, *, idempotency_key: Optional[str] = None) -> Job:
        """Retry a trial.

        Requeues a trial that ended without a result. The job of its solve can be followed and cancelled.
        """
        return cast(Job, self.request_json("POST", "/api/v1/trials/{id}/retry", {"id": trial_id}, key=idempotency_key))

    def get_sensitivities(self, trial_id: TrialId) -> TrialSensitivities:
        """Get the sensitivities of a trial.

        How the results of a gait change, to first order, with each tuned bound. Computed on request from the stored
        solution, for meshes of up to 80 intervals (the sum of `gait_settings.mesh`).
        """
        return cast(TrialSensitivities, self.request_json("GET", "/api/v1/trials/{id}/sensitivities", {"id": trial_id}))
