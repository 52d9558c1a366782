// @ts-check
// Sends the form of an answer and stays on the page if the service cannot be reached. The tab keeps the entry until the service
// has it: across reloads, lost connections and sign-ins. It keeps the idempotency key of the form as well, so an answer that is
// sent twice counts once. Without this script the browser sends the form.

/** @typedef {[string, string][]} Fields */

const PREFIX = "answer ";
/** Where one press answers, a press within this time was meant for the page before, ms. */
const SETTLING_MS = 400;
const form = /** @type {HTMLFormElement | null} */ (document.querySelector("form[data-answer]"));

if (new URLSearchParams(location.search).has("saved")) {
  for (const key of Object.keys(sessionStorage)) if (key.startsWith(PREFIX)) sessionStorage.removeItem(key);
}

if (form) {
  const key = PREFIX + form.dataset.answer;
  const notice = /** @type {HTMLElement} */ (form.querySelector("[data-unsent]"));
  let sending = false;
  let settled = form.dataset.onePress === undefined;
  const settle = () => {
    settled = true;
    form.dataset.ready = "";
  };
  if (!settled) setTimeout(settle, SETTLING_MS);

  /** @param {HTMLElement | null} pressed @returns {Fields} */
  const fields = (pressed) => {
    /** @type {Fields} */
    const entered = [...new FormData(form)].map(([name, value]) => [name, String(value)]);
    return pressed instanceof HTMLButtonElement && pressed.name ? [...entered, [pressed.name, pressed.value]] : entered;
  };

  /** @param {Fields} entry */
  const keep = (entry) => sessionStorage.setItem(key, JSON.stringify(entry));

  /** @param {string} why @param {Fields} entry */
  const offer = (why, entry) => {
    const again = document.createElement("button");
    again.type = "button";
    again.className = "button quiet";
    again.textContent = "Send again";
    again.addEventListener("click", () => send(entry));
    notice.replaceChildren(`${why} This page keeps it: send it again when the service is back. It counts only once. `, again);
    notice.hidden = false;
  };

  /** @param {Fields} entry */
  const send = async (entry) => {
    if (sending) return;
    sending = true;
    notice.hidden = true;
    keep(entry);
    const reply = await fetch(form.action, { method: "POST", body: new URLSearchParams(entry) }).catch(() => null);
    if (!reply || reply.status >= 500) {
      sending = false;
      offer("The service is not available. Your answer may not have been saved.", entry);
      return;
    }
    if (reply.status !== 401) sessionStorage.removeItem(key);
    if (reply.redirected && reply.ok) {
      location.assign(reply.url);
      return;
    }
    // A refusal has its own page; the browser gets there by sending the form.
    const sent = new Set(fields(null).map(([name]) => name));
    for (const [name, value] of entry.filter(([name]) => !sent.has(name))) {
      const field = document.createElement("input");
      Object.assign(field, { type: "hidden", name, value });
      form.append(field);
    }
    form.submit();
  };

  /** @type {Fields} */
  const kept = JSON.parse(sessionStorage.getItem(key) ?? "[]");
  for (const [name, value] of kept) {
    const field = form.elements.namedItem(name);
    if (field instanceof HTMLElement && "value" in field) field.value = value;
    if (field instanceof HTMLTextAreaElement && value) field.closest("details")?.setAttribute("open", "");
  }
  if (kept.some(([name]) => name === "answer")) offer("Your answer may not have been saved.", kept);
  form.addEventListener("input", () => keep(fields(null)));

  form.addEventListener("submit", (event) => {
    event.preventDefault();
    if (settled) void send(fields(event.submitter));
  });
}
