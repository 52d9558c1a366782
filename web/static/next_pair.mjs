// @ts-check
// Takes the next pair once the time to undo an answer is over, and asks again while there is none. The user can turn this off, and
// the browser remembers that. Without this script the user presses *Next pair*.

import { over } from "./undo.mjs";

const OFF = "next pair by itself off";
/** How often a page asks for a pair. */
const TRIES = 120;
/** Time between two looks whether the page is in front, ms. */
const LOOK = 1000;
const form = /** @type {HTMLFormElement | null} */ (document.querySelector("form[data-next]"));
const box = /** @type {HTMLInputElement | null} */ (document.querySelector("[data-by-itself]"));

/** @type {(ms: number) => Promise<void>} */
const pause = (ms) => new Promise((end) => setTimeout(end, ms));

if (form && box) {
  for (const part of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-auto]"))) part.hidden = false;
  box.checked = localStorage.getItem(OFF) === null;
  box.addEventListener("change", () => {
    if (box.checked) localStorage.removeItem(OFF);
    else localStorage.setItem(OFF, "1");
  });
  // A form that the user sends leads elsewhere.
  let leaving = false;
  document.addEventListener("submit", () => (leaving = true));

  /** Asks for the next pair. @returns {Promise<string | null>} Where it is; `null` while there is none. */
  const next = async () => {
    const reply = await fetch(form.action, { method: "POST" }).catch(() => null);
    if (!reply || reply.status >= 500) return null;
    if (!reply.ok) return "/rate";
    const waits = document.querySelector("[data-nothing]") && (await reply.text()).includes("data-nothing");
    return waits ? null : reply.url;
  };

  await over;
  for (let tries = 0; tries < TRIES; tries++) {
    await pause(1000 * Number(form.dataset.pause));
    while (document.hidden || !box.checked) await pause(LOOK);
    if (leaving) break;
    const address = await next();
    if (leaving) break;
    if (address) {
      location.assign(address);
      break;
    }
  }
}
