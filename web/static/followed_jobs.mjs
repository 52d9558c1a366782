// @ts-check
// Follows the simulation of walks with a gait, and shows the result. Without this script a reload shows it.

import { showLocalTimes } from "./local_times.mjs";

const section = document.getElementById("simulated-walks");
const EVERY_MS = 1000;

/** Replaces the section by the one of a fresh page. */
const reload = async () => {
  const answer = await fetch(location.pathname).catch(() => null);
  if (!answer?.ok) return false;
  const fresh = new DOMParser().parseFromString(await answer.text(), "text/html").getElementById("simulated-walks");
  if (fresh) showLocalTimes(fresh);
  if (fresh) section?.replaceChildren(...fresh.childNodes);
  return true;
};

const follow = async () => {
  const answer = await fetch(`/api/v1/jobs/${section?.dataset.job}`).catch(() => null);
  const job = answer?.ok ? await answer.json() : null;
  const bar = section?.querySelector("progress");
  if (job && bar && job.progress !== null) bar.value = job.progress * bar.max;
  const hasBegun = job?.state === "running" && !bar;
  const hasEnded = job ? !["queued", "running"].includes(job.state) : answer?.status === 404;
  const isShown = hasBegun || hasEnded ? await reload() : false;
  if (!(hasEnded && isShown)) setTimeout(follow, EVERY_MS);
};

if (section) follow();
