// @ts-check
// Keys 1, 2 and 3 choose the answers in their order. The user can turn them off (WCAG 2.1.4), and the browser remembers that.
// Without this script the page does not mention the keys.

const OFF = "answer keys off";
const form = /** @type {HTMLFormElement | null} */ (document.querySelector("form[data-answer]"));
const choice = /** @type {HTMLElement | null} */ (form?.querySelector("[data-keys]") ?? null);
const box = /** @type {HTMLInputElement | null} */ (choice?.querySelector("input") ?? null);

if (form && choice && box) {
  choice.hidden = false;
  box.checked = localStorage.getItem(OFF) === null;
  const hint = () => {
    for (const key of /** @type {NodeListOf<HTMLElement>} */ (form.querySelectorAll("[data-key]"))) key.hidden = !box.checked;
  };
  hint();
  box.addEventListener("change", () => {
    if (box.checked) localStorage.removeItem(OFF);
    else localStorage.setItem(OFF, "1");
    hint();
  });

  document.addEventListener("keydown", (event) => {
    const place = ["1", "2", "3"].indexOf(event.key);
    if (place < 0 || !box.checked || event.ctrlKey || event.altKey || event.metaKey) return;
    // A focused field keeps its keys, except the choice of an answer.
    const field = /** @type {Element} */ (event.target).closest("input, select, textarea, button");
    if (field && field.getAttribute("name") !== "answer") return;
    const answer = /** @type {HTMLInputElement} */ (form.querySelectorAll(".answer-option input")[place]);
    answer.click();
    answer.focus();
  });
}
