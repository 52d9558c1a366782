// Lets a recording be chosen as a file: its text goes into the field that works without scripts, too.

for (const field of document.querySelectorAll("[data-recording]")) {
  const text = field.querySelector("textarea");
  const label = document.createElement("label");
  label.textContent = field.dataset.recording || "File";
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
