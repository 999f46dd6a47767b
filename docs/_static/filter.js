// A field before a table hides the rows that lack one of the words typed into it.
document.addEventListener("DOMContentLoaded", () => {
  for (const field of document.querySelectorAll("input.filter")) {
    const table = field.closest("section").querySelector("table");
    const rows = [...table.querySelectorAll("tbody tr")];
    const texts = rows.map((row) => row.textContent.toLowerCase());
    field.addEventListener("input", () => {
      const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      rows.forEach((row, k) => {
        row.hidden = !words.every((word) => texts[k].includes(word));
      });
    });
  }
});
