// @ts-check
// Follows the jobs of sections that show a result, and shows the results. Without this script a reload shows them.

import { showLocalTimes } from "./local_times.mjs";

const EVERY_MS = 1000;

/** Replaces a section by the one of a fresh page.
 * @param {HTMLElement} section */
const reload = async (section) => {
  const answer = await fetch(location.pathname).catch(() => null);
  if (!answer?.ok) return false;
  const fresh = new DOMParser().parseFromString(await answer.text(), "text/html").getElementById(section.id);
  if (fresh) showLocalTimes(fresh);
  if (fresh) section.replaceChildren(...fresh.childNodes);
  return true;
};

/** @param {HTMLElement} section */
const follow = async (section) => {
  const answer = await fetch(`/api/v1/jobs/${section.dataset.job}`).catch(() => null);
  const job = answer?.ok ? await answer.json() : null;
  const bar = section.querySelector("progress");
  if (job && bar && job.progress !== null) bar.value = job.progress * bar.max;
  const hasBegun = job?.state === "running" && job.progress !== null && !bar;
  const hasEnded = job ? !["queued", "running"].includes(job.state) : answer?.status === 404;
  const isShown = hasBegun || hasEnded ? await reload(section) : false;
  if (!(hasEnded && isShown)) setTimeout(() => follow(section), EVERY_MS);
};

for (const section of document.querySelectorAll("section[data-job]")) void follow(/** @type {HTMLElement} */ (section));
