// A field above the tables of a long page: what is typed there leaves the rows that hold all of its words.
document.addEventListener("DOMContentLoaded", () => {
  const content = document.querySelector(".md-content__inner");
  const tables = content ? [...content.querySelectorAll("table:not([class])")] : [];
  if (!tables.some((table) => table.tBodies[0] && table.tBodies[0].rows.length > 15)) return;
  const field = document.createElement("input");
  field.type = "search";
  field.placeholder = "Filter rows: robot, kind, source ...";
  field.setAttribute("aria-label", "Filter the rows of all tables of this page");
  field.className = "rows-filter";
  content.querySelector("h1").after(field);
  field.addEventListener("input", () => {
    const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const table of tables) {
      for (const row of table.tBodies[0].rows) {
        const text = `${row.dataset.under || ""} ${row.textContent}`.toLowerCase();
        row.hidden = !words.every((word) => text.includes(word));
      }
    }
  });
  for (const table of tables) {
    let before = table.closest(".md-typeset__scrollwrap") || table;
    while (before && !/^H[2-6]$/.test(before.tagName)) before = before.previousElementSibling;
    for (const row of table.tBodies[0].rows) row.dataset.under = before ? before.textContent : "";
  }
});
