// @ts-check
// Sends the form of an answer and stays on the page if the service cannot be reached. The tab keeps the entry until the service
// has it: across reloads, lost connections and sign-ins. It keeps the idempotency key of the form as well, so an answer that is
// sent twice counts once. Without this script the browser sends the form.

const PREFIX = "answer ";
const form = /** @type {HTMLFormElement | null} */ (document.querySelector("form[data-answer]"));

if (new URLSearchParams(location.search).has("saved")) {
  for (const key of Object.keys(sessionStorage)) if (key.startsWith(PREFIX)) sessionStorage.removeItem(key);
}

if (form) {
  const key = PREFIX + form.dataset.answer;
  const notice = /** @type {HTMLElement} */ (form.querySelector("[data-unsent]"));
  const save = /** @type {HTMLButtonElement} */ (form.querySelector("[type=submit]"));
  const fields = () => [...new FormData(form)].map(([name, value]) => [name, String(value)]);
  let sending = false;

  for (const [name, value] of JSON.parse(sessionStorage.getItem(key) ?? "[]")) {
    const field = form.elements.namedItem(name);
    if (field && "value" in field) field.value = value;
  }
  form.addEventListener("input", () => sessionStorage.setItem(key, JSON.stringify(fields())));

  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (sending) return;
    sending = true;
    notice.hidden = true;
    const reply = await fetch(form.action, { method: "POST", body: new URLSearchParams(fields()) }).catch(() => null);
    sending = false;
    if (!reply || reply.status >= 500) {
      notice.textContent = "The service cannot be reached. Your answer may not have been saved. This page keeps it: send it again when the service is back. It counts only once.";
      notice.hidden = false;
      save.textContent = "Send again";
      return;
    }
    if (reply.status !== 401) sessionStorage.removeItem(key);
    // A refusal has its own page; the browser gets there by sending the form.
    if (reply.redirected && reply.ok) location.assign(reply.url);
    else form.submit();
  });
}
