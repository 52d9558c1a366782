// @ts-check
// After an answer: loads the page again when the study has got further, so that the next comparison comes by itself.

const place = /** @type {HTMLElement | null} */ (document.querySelector("[data-going-on]"));

if (place) {
  const source = new EventSource(`/api/v1/studies/${place.dataset.study}/events?after=${place.dataset.after}`);
  source.addEventListener("study_changed", () => location.reload());
}
