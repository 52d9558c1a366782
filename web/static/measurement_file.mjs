// Adds a file chooser and a drop zone to a text field for a measurement file, and check boxes to the preview of its strides.
// Without this script the text can be pasted, and the numbers of rejected strides can be typed.

/** The format that the ending of a file name stands for; the formats of a form that fit are listed first. */
const FORMATS = { csv: ["camargo", "csv"], mot: ["opensim"], sto: ["opensim"] };

for (const field of document.querySelectorAll("[data-file]")) {
  const text = field.querySelector("textarea");
  const form = field.closest("form");
  const kept = text.required ? form.querySelector("[data-file-name]") : null;
  const label = document.createElement("label");
  label.textContent = field.dataset.file || "Measurement file";
  const input = document.createElement("input");
  input.type = "file";
  input.accept = ".mot,.sto,.csv,text/plain,text/csv";
  label.append(input);
  const shown = document.createElement("p");
  shown.className = "help";
  shown.setAttribute("role", "status");
  shown.textContent = kept?.value ? `Loaded: ${kept.value}. You can also drop a file here.` : "You can also drop a file here.";
  const box = document.createElement("div");
  box.className = "field drop";
  box.append(label, shown);
  field.before(box);

  const load = async (file) => {
    if (!file) return;
    if (file.name.toLowerCase().endsWith(".c3d")) {
      shown.textContent = field.dataset.c3d;
      return;
    }
    text.value = await file.text();
    shown.textContent = `Loaded: ${file.name}, ${Math.ceil(file.size / 1000)} kB.`;
    if (!text.required) return;
    if (kept) kept.value = file.name;
    const name = document.querySelector("#name");
    if (name && !name.value) name.value = file.name.replace(/\.[^.]*$/, "");
    const format = form.querySelector("select[name=format]");
    const fitting = FORMATS[file.name.split(".").pop().toLowerCase()] ?? [];
    if (!format || !fitting.length || fitting.includes(format.value)) return;
    format.value = fitting[fitting.length - 1];
  };
  input.addEventListener("change", () => load(input.files[0]));
  box.addEventListener("dragover", (event) => event.preventDefault());
  box.addEventListener("drop", (event) => {
    event.preventDefault();
    void load(event.dataTransfer.files[0]);
  });
}

const rejected = document.querySelector("#rejected_strides");
for (const row of rejected ? document.querySelectorAll("[data-strides] tbody tr") : []) {
  const number = row.cells[0].textContent;
  const numbers = () => rejected.value.split(",").map((part) => part.trim()).filter(Boolean);
  const choice = document.createElement("label");
  choice.className = "choice";
  const box = document.createElement("input");
  box.type = "checkbox";
  box.checked = numbers().includes(number);
  box.addEventListener("change", () => {
    const others = numbers().filter((known) => known !== number);
    rejected.value = (box.checked ? [...others, number] : others).sort((a, b) => a - b).join(", ");
  });
  choice.append(box, ` reject stride ${number}`);
  row.cells[3].append(" ", choice);
}
