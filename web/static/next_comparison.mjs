// @ts-check
// Reloads the page when the study changes or a gait is certified, to show the next comparison. If the user is typing, it offers a link
// instead. It never reloads while an answer can still be undone, or while a form is being sent.

import { holdsEdits } from "./edited_fields.mjs";
import { over } from "./undo.mjs";

const place = /** @type {HTMLElement | null} */ (document.querySelector("[data-going-on]"));

if (place) {
  const source = new EventSource(`/api/v1/studies/${place.dataset.study}/events?after=${place.dataset.after}`);
  let leaving = false;
  document.addEventListener("submit", () => (leaving = true));
  const update = async () => {
    await over;
    if (leaving) return;
    if (!holdsEdits(document.body)) {
      location.reload();
      return;
    }
    const link = document.createElement("a");
    link.href = location.href;
    link.textContent = "Reload this page";
    place.replaceChildren("The next comparison may be ready. ", link, "; what you typed here will be lost.");
  };
  source.addEventListener("study_changed", update);
  // After an answer the study changes with the next comparison; before the first one, each certificate changes what the page says.
  if (!place.closest(".notice.good")) source.addEventListener("gait_certified", update);
}
