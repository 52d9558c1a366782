// @ts-check
// *Undo* of the answer that was just saved. The button counts the seconds down and then goes away, or says that it retracts.
// Without this script it stays.

/** Time between two looks at the clock, ms. */
const TICK = 200;
const form = /** @type {HTMLFormElement | null} */ (document.querySelector("form[data-undo]"));
const given = /** @type {HTMLElement | null} */ (document.querySelector("[data-undo-seconds]"));

/** @param {HTMLFormElement} form @param {() => void} end */
function countDown(form, end) {
  const button = /** @type {HTMLButtonElement} */ (form.querySelector("button"));
  const shown = /** @type {HTMLElement} */ (form.querySelector("[data-left]"));
  let left = 1000 * Number(given?.dataset.undoSeconds ?? 0);
  let last = performance.now();
  const look = () => {
    const now = performance.now();
    // The countdown stops while the form has the keyboard focus.
    if (!form.contains(document.activeElement)) left -= now - last;
    last = now;
    shown.textContent = ` (${Math.ceil(Math.max(left, 0) / 1000)} s)`;
    if (left > 0) return;
    clearInterval(clock);
    if (form.dataset.undo) button.textContent = form.dataset.undo;
    else form.hidden = true;
    end();
  };
  const clock = setInterval(look, TICK);
  look();
  // Stop the countdown, so that its end does not replace the page during the undo.
  form.addEventListener("submit", () => clearInterval(clock));
  document.addEventListener("keydown", (event) => {
    const field = /** @type {Element} */ (event.target).closest("input, textarea");
    if (event.key !== "z" || !(event.ctrlKey || event.metaKey) || field || left <= 0) return;
    event.preventDefault();
    button.click();
  });
}

/** The end of the time to undo the answer; never, if it is undone. @type {Promise<void>} */
export const over = new Promise((end) => (form ? countDown(form, end) : end()));
