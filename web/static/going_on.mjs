// @ts-check
// After an answer: loads the page again when the study has got further, so that the next comparison comes by itself. Where
// something is being typed, it offers that instead.

import { holdsEdits } from "./edited.mjs";

const place = /** @type {HTMLElement | null} */ (document.querySelector("[data-going-on]"));

if (place) {
  const source = new EventSource(`/api/v1/studies/${place.dataset.study}/events?after=${place.dataset.after}`);
  source.addEventListener("study_changed", () => {
    if (!holdsEdits(document.body)) {
      location.reload();
      return;
    }
    const link = document.createElement("a");
    link.href = location.href;
    link.textContent = "Load this page again";
    place.replaceChildren("The study has got further. ", link, ": what you are typing here is not kept then.");
  });
}
