// @ts-check
// Loads the explanation of a trial without a gait as soon as it exists. Without this script a reload shows it.

import { showLocalTimes } from "./local_times.mjs";

const section = /** @type {HTMLElement | null} */ (document.getElementById("explanation"));

if (section) {
  const { study, trial, after } = section.dataset;
  const source = new EventSource(`/api/v1/studies/${study}/events?after=${after}`);

  /** @param {MessageEvent} event */
  const show = async (event) => {
    if (JSON.parse(event.data).payload.trial_id !== trial) return;
    source.close();
    const answer = await fetch(location.pathname).catch(() => null);
    if (!answer?.ok) return;
    const fresh = new DOMParser().parseFromString(await answer.text(), "text/html").getElementById("explanation");
    if (fresh) showLocalTimes(fresh);
    if (fresh) section.replaceChildren(...fresh.childNodes);
  };
  /** Shows how long the explanation has been running, and how much is left. */
  const follow = async () => {
    const answer = await fetch(location.pathname).catch(() => null);
    if (!answer?.ok) return;
    const fresh = new DOMParser().parseFromString(await answer.text(), "text/html").querySelector("[data-progress]");
    if (fresh) section.querySelector("[data-progress]")?.replaceWith(fresh);
  };
  const timer = setInterval(() => (section.querySelector("[data-progress]") ? void follow() : clearInterval(timer)), 15_000);
  for (const kind of ["trial_explained", "trial_not_explained"]) source.addEventListener(kind, show);
}
