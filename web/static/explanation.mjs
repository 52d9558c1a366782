// @ts-check
// Loads the explanation of a trial without a gait as soon as it exists. Without this script a reload shows it.

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
    if (fresh) section.replaceChildren(...fresh.childNodes);
  };
  for (const kind of ["trial_explained", "trial_not_explained"]) source.addEventListener(kind, show);
}
