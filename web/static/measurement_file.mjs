// Adds a file chooser to a text field for a measurement file. Without this script the text can be pasted.

for (const field of document.querySelectorAll("[data-file]")) {
  const text = field.querySelector("textarea");
  const label = document.createElement("label");
  label.textContent = field.dataset.file || "Measurement file";
  const input = document.createElement("input");
  input.type = "file";
  input.accept = ".mot,.sto,.csv,text/plain,text/csv";
  label.append(input);
  const box = document.createElement("div");
  box.className = "field";
  box.append(label);
  field.before(box);
  input.addEventListener("change", async () => {
    const [file] = input.files;
    if (!file) return;
    text.value = await file.text();
    const name = document.querySelector("#name");
    if (name && !name.value && text.required) name.value = file.name.replace(/\.[^.]*$/, "");
  });
}
