// @ts-check
// Keeps a study page current: recorded events bring the changed part from the server, iterations are written in place.
// Without this script the page is right after a reload.

const live = /** @type {HTMLElement | null} */ (document.getElementById("live"));

if (live) {
  const study = live.dataset.study;
  const source = new EventSource(`/api/v1/studies/${study}/events?after=${live.dataset.after}`);
  let pending = false;
  let again = false;

  /** Brings the changing part; asked for meanwhile, once more afterwards. */
  const refresh = async () => {
    if (pending) {
      again = true;
      return;
    }
    pending = true;
    try {
      const answer = await fetch(`/studies/${study}/live`);
      if (answer.ok) {
        const focused = document.activeElement?.closest("#live") ? document.activeElement.getAttribute("value") : null;
        live.innerHTML = await answer.text();
        if (focused) {
          /** @type {HTMLElement | null} */ (live.querySelector(`button[value="${focused}"]`))?.focus();
        }
      } else if (answer.status === 409) {
        // The subject withdrew: what is on this page is not shown any more.
        location.reload();
      }
    } finally {
      pending = false;
      if (again) {
        again = false;
        void refresh();
      }
    }
  };

  for (const kind of ["study_changed", "trial_queued", "trial_started", "trial_ended", "feedback_given", "feedback_retracted"]) {
    source.addEventListener(kind, () => void refresh());
  }
  source.addEventListener("progress", (event) => {
    const p = JSON.parse(event.data);
    const text = live.querySelector(`[data-trial="${p.trial_id}"] [data-text]`);
    if (text && p.objective !== null && p.constraint_violation !== null) {
      text.textContent =
        `iteration ${p.iteration}, objective ${p.objective.toFixed(4)}, violation ${p.constraint_violation.toExponential(1)}`;
    }
  });
}
