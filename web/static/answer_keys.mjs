// @ts-check
// Keys 1, 2 and 3 choose an answer, in the order in which the answers stand. They can be turned off (WCAG 2.1.4); that is kept
// in this browser. Without this script no key is promised.

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
    // A key belongs to the field that has the focus; an answer may be changed with it.
    const field = /** @type {Element} */ (event.target).closest("input, select, textarea, button");
    if (field && field.getAttribute("name") !== "answer") return;
    const answer = /** @type {HTMLInputElement} */ (form.querySelectorAll(".verdict input")[place]);
    answer.click();
    answer.focus();
  });
}
