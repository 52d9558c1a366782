// @ts-check
// Sends the form of an answer and stays on the page when the service cannot be reached. What is chosen and written is kept in
// this tab until the service has it: over a reload, a lost connection, signing in again. The key of the form is kept, too, so
// what is sent twice counts once. Without this script the form is sent as any other.

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
      notice.textContent = "There is no connection to the service: nothing was stored, as far as can be told from here. What you chose and wrote stays; send it again when the service is back. It counts once.";
      notice.hidden = false;
      save.textContent = "Send it again";
      return;
    }
    if (reply.status !== 401) sessionStorage.removeItem(key);
    // A refusal is a page of its own: sent once more as a form, the same answer leads to it.
    if (reply.redirected && reply.ok) location.assign(reply.url);
    else form.submit();
  });
}
