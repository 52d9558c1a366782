// @ts-check
// Whether the user is editing a part of the page, so that an update must not overwrite it.

const FIELDS = "input:not([type=hidden]), select, textarea";

/** @type {(field: Element) => boolean} Whether a field has the focus or a value other than its initial one. */
function isEdited(field) {
  if (field === document.activeElement) return true;
  if (field instanceof HTMLSelectElement) {
    return field.selectedIndex !== Math.max([...field.options].findIndex((option) => option.defaultSelected), 0);
  }
  if (field instanceof HTMLInputElement && /^(checkbox|radio)$/.test(field.type)) return field.checked !== field.defaultChecked;
  const { value, defaultValue } = /** @type {HTMLInputElement | HTMLTextAreaElement} */ (field);
  return value !== defaultValue;
}

/** @type {(part: Element) => boolean} Whether something in it is being edited. */
export const holdsEdits = (part) => [...part.querySelectorAll(FIELDS)].some(isEdited);
