// @ts-check
// Who gives the answers: asked once in a browser session. A user who signed in is named by the service, and nobody else is put
// in that place. Without this script the name is asked on every page.

const KEY = "answering person";
const place = /** @type {HTMLDetailsElement | null} */ (document.querySelector("details.person"));

if (place) {
  const source = /** @type {HTMLSelectElement} */ (place.querySelector("[name=source]"));
  const author = /** @type {HTMLInputElement} */ (place.querySelector("[name=author]"));
  const shown = /** @type {HTMLElement} */ (place.querySelector("[data-person]"));
  const user = place.dataset.user ?? "";
  /** @type {{source: string, author: string} | null} */
  const kept = JSON.parse(sessionStorage.getItem(KEY) ?? "null");

  const show = () => {
    const named = author.value.trim();
    shown.textContent = named ? `${source.selectedOptions[0].text.toLowerCase()}, ${named}` : "(enter a name)";
  };

  if (kept && !user && !author.value) {
    source.value = kept.source;
    author.value = kept.author;
    place.open = false;
  }
  show();
  place.addEventListener("input", show);
  source.addEventListener("change", () => {
    // The name of the user is not the code of the subject.
    if (!user) return;
    if (source.value === "clinician") author.value = user;
    else if (author.value === user) author.value = kept?.source === "subject" ? kept.author : "";
    show();
  });
  author.addEventListener("invalid", () => (place.open = true));
  author.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    // Enter ends the entry of the name, and answers nothing.
    event.preventDefault();
    if (author.reportValidity()) place.open = false;
  });
  author.form?.addEventListener("submit", () => {
    sessionStorage.setItem(KEY, JSON.stringify({ source: source.value, author: author.value }));
  });
}
