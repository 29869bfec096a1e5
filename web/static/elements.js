// Helpers for DOM elements. They write to the DOM only if the content changes, to avoid needless layout.

export const byId = (id) => document.getElementById(id);

/** Set the text of an element. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Set the text of an element and show the element; hide the element if the text is empty. */
export function showText(element, text) {
  setText(element, text);
  element.hidden = !text;
}

/** Show an error beside a field and mark the field as invalid; remove both if the text is empty. */
export function showFieldError(id, text, fieldId = id) {
  const box = byId(`${id}-error`);
  showText(box, text);
  byId(fieldId).setAttribute("aria-invalid", String(Boolean(text)));
  if (text) box.scrollIntoView({ block: "nearest" });
}

/** Create an element with a class and child nodes or texts. */
export function create(tag, className, ...children) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  element.append(...children);
  return element;
}

/** Split a text at backticks and return child nodes. Text between backticks becomes a code element. */
export const withCode = (text) =>
  text.split("`").map((part, index) => (index % 2 ? create("code", "", part) : part));

/** Show a number with its unit, and a sentence with the same content for screen readers. */
export function showReading(element, number, unit, sentence) {
  if (!element.firstChild) {
    const value = create("span", "value", create("span", "number"), create("span", "unit"));
    value.setAttribute("aria-hidden", "true");
    element.append(value, create("span", "visually-hidden"));
  }
  const [value, spoken] = element.children;
  setText(value.children[0], number);
  setText(value.children[1], unit);
  setText(spoken, sentence);
}

/** Show rows of texts in a table body and reuse the cells. `headerColumn` is the column of the row header. */
export function showRows(body, rows, headerColumn = 0) {
  while (body.rows.length > rows.length) body.deleteRow(-1);
  rows.forEach((texts, index) => {
    const row = body.rows[index] ?? body.insertRow();
    texts.forEach((text, column) =>
      setText(row.cells[column] ?? addCell(row, column === headerColumn), text),
    );
  });
}

function addCell(row, isHeader) {
  const cell = create(isHeader ? "th" : "td");
  if (isHeader) cell.scope = "row";
  return row.appendChild(cell);
}
