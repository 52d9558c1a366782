// @ts-check
// Checks the form with the service while it is being filled in, by the same rules as on sending. Without this script the form is
// checked only on sending.

const form = /** @type {HTMLFormElement | null} */ (document.querySelector("form[data-check]"));

/** Time without typing before the form is checked, ms. */
const PAUSE = 350;

if (form) {
  const outlook = /** @type {HTMLElement} */ (form.querySelector("[data-outlook]"));
  const chosen = form.querySelector("[data-reference]");
  let drawn = "";
  let timer = 0;
  let asked = 0;

  const check = async () => {
    const turn = (asked += 1);
    const body = new URLSearchParams();
    for (const [name, value] of new FormData(form)) body.append(name, String(value));
    const answer = await fetch("/studies/new/check", { method: "POST", body }).catch(() => null);
    // A later check has its own answer.
    if (turn !== asked) return;
    if (answer?.status === 401) outlook.textContent = "You are no longer signed in. If you send the form, it is kept until you have signed in again.";
    if (!answer?.ok) return;
    /** @type {{ faults: { field: string, text: string }[], text: string, reference?: string }} */
    const { faults, text, reference } = await answer.json();
    for (const input of form.querySelectorAll("[aria-invalid]")) {
      input.removeAttribute("aria-invalid");
      if (input.getAttribute("aria-describedby") === outlook.id) input.removeAttribute("aria-describedby");
    }
    for (const { field } of faults) {
      const input = form.querySelector(`[name="${CSS.escape(field)}"]`);
      input?.setAttribute("aria-invalid", "true");
      if (!input?.hasAttribute("aria-describedby")) input?.setAttribute("aria-describedby", outlook.id);
      input?.closest("details")?.setAttribute("open", "");
    }
    outlook.classList.toggle("bad", faults.length > 0);
    outlook.textContent = text || faults.map((fault) => fault.text).join(" ");
    if (reference && reference !== drawn) {
      drawn = reference;
      chosen?.replaceChildren(...new DOMParser().parseFromString(reference, "text/html").body.childNodes);
    }
  };

  form.addEventListener("input", () => {
    clearTimeout(timer);
    timer = window.setTimeout(() => void check(), PAUSE);
  });
  // The fields of a new subject unfold when it is chosen.
  const subject = /** @type {HTMLSelectElement} */ (form.elements.namedItem("subject"));
  const description = form.querySelector("details[data-new-subject]");
  subject.addEventListener("change", () => description?.toggleAttribute("open", subject.value === "new"));
  description?.addEventListener("input", () => {
    subject.value = "new";
  });
  void check();
}
