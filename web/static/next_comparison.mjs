// @ts-check
// After an answer: reloads the page when the study changes, to show the next comparison. If the user is typing, it offers a link
// instead.

import { holdsEdits } from "./edited_fields.mjs";

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
    link.textContent = "Reload this page";
    place.replaceChildren("The next comparison may be ready. ", link, "; what you typed here will be lost.");
  });
}
