// @ts-check
// The left arrow or 1, 2, and the right arrow or 3 answer. The user can turn the keys off (WCAG 2.1.4), and the browser remembers
// that. Without this script the page does not mention the keys; on touch screens the styles hide them.

const OFF = "answer keys off";
/** Where a key has another meaning. */
const OTHERS = "input, select, textarea, [tabindex]";
const form = /** @type {HTMLFormElement | null} */ (document.querySelector("form[data-answer]"));
const choice = /** @type {HTMLElement | null} */ (document.querySelector("[data-keys]"));
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
    // A key that is held down answers once.
    if (!box.checked || event.repeat || event.ctrlKey || event.altKey || event.metaKey || event.shiftKey) return;
    if (/** @type {Element} */ (event.target).closest(OTHERS)) return;
    const buttons = /** @type {HTMLButtonElement[]} */ ([...form.querySelectorAll("button[aria-keyshortcuts]")]);
    const answer = buttons.find((button) => button.getAttribute("aria-keyshortcuts")?.split(" ").includes(event.key));
    if (!answer) return;
    event.preventDefault();
    answer.click();
  });
}
