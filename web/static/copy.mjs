// @ts-check
// Adds a button that copies a link or token which is shown only once. Without this script it can be selected.

for (const secret of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("code.secret[data-copy]"))) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = "button quiet";
  button.textContent = "Copy";
  const said = document.createElement("span");
  said.setAttribute("role", "status");
  said.className = "help";
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(secret.textContent ?? "");
      said.textContent = " Copied.";
    } catch {
      // Browsers allow the clipboard only on secure pages.
      getSelection()?.selectAllChildren(secret);
      said.textContent = " Selected. Copy it with Ctrl+C.";
    }
  });
  secret.after(" ", button, said);
}
