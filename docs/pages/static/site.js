// What the theme leaves open for the keyboard and for readers of the screen.
function names() {
  for (const heading of document.querySelectorAll('[role="heading"]')) heading.setAttribute("aria-level", "2");
  document.querySelector(".sidebar-drawer")?.setAttribute("aria-label", "All pages");
  document.querySelector(".toc-drawer")?.setAttribute("aria-label", "On this page");
  const found = document.getElementById("search-results");
  found?.before(Object.assign(document.createElement("h1"), { textContent: "Search" }));
}

// A box wider than its place is moved by arrow keys once the keyboard comes to it.
function reach() {
  for (const box of document.querySelectorAll("article :is(pre, table, .table-wrapper, .wide-picture, .formula)"))
    if (box.clientWidth && box.scrollWidth > box.clientWidth + 1) box.tabIndex = 0;
    else box.removeAttribute("tabindex");
}

addEventListener("DOMContentLoaded", names);
for (const event of ["load", "resize"]) addEventListener(event, reach);
// What was folded has its width once it is open.
addEventListener("toggle", reach, true);
