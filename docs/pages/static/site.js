// Words that a search marks are not looked for in the titles of icons, where nothing can be marked.
for (const title of document.querySelectorAll("svg title")) title.classList.add("nohighlight");

// What the theme leaves open for the keyboard and for readers of the screen.
function names() {
  for (const heading of document.querySelectorAll('[role="heading"]')) heading.setAttribute("aria-level", "2");
  document.querySelector(".sidebar-drawer")?.setAttribute("aria-label", "All pages");
  document.querySelector(".toc-drawer")?.setAttribute("aria-label", "On this page");
  // What is written on a fold says more than one name for all of them.
  for (const fold of document.querySelectorAll("summary[aria-label]")) fold.removeAttribute("aria-label");
  // A search looks for words, not for numbers.
  const found = document.getElementById("search-results"), make = (tag) => document.createElement(tag);
  const [, number, words] =
    /^\W*(?:eq\w*\W*)?([1-9]|[12]\d|3[0-5])\b(.*)/i.exec(new URLSearchParams(location.search).get("q")) ?? [];
  const href = "lessons/equations.html" + (number ? "#eq-" + number : "");
  const index = Object.assign(make("a"), { href, textContent: "the equation index" });
  const start = number ? `Equation (${number}) stands in ` : "By its number an equation is found in ";
  const way = Object.assign(make("p"), { textContent: start });
  way.append(index, ".");
  // Where the number is all that was asked for, no page is missing.
  found?.classList.toggle("by-number", Boolean(number) && !/\w/.test(words));
  found?.before(Object.assign(make("h1"), { textContent: "Search" }), way);
}

// On a narrow screen the lists at the sides are drawers: the labels that open them become buttons.  Escape closes a
// drawer, and so does a link to a place of the page, or a step of the keyboard, to what lies behind it.
function drawers() {
  for (const label of document.querySelectorAll(".nav-overlay-icon, .toc-overlay-icon")) {
    const box = document.getElementById(label.htmlFor), button = document.createElement("button");
    const drawer = document.querySelector(box.id === "__toc" ? ".toc-drawer" : ".sidebar-drawer");
    const say = () => button.setAttribute("aria-expanded", box.checked);
    Object.assign(button, { className: label.className, ariaLabel: drawer.ariaLabel });
    button.append(...label.childNodes);
    label.replaceWith(button);
    box.addEventListener("change", say);
    say();
    button.onclick = () => {
      box.click();
      const links = [...drawer.querySelectorAll("a, input")];
      if (box.checked) links.find((one) => one.offsetParent)?.focus({ preventScroll: true });
    };
    const open = () => box.checked && button.getClientRects().length;
    addEventListener("keydown", (event) => {
      if (event.key !== "Escape" || !open()) return;
      box.click();
      button.focus();
    });
    drawer.addEventListener("click", (event) => {
      if (event.target.closest('a[href^="#"]') && open()) box.click();
    });
    addEventListener("focusin", (event) => {
      if (event.target !== button && !drawer.contains(event.target) && open()) box.click();
    });
  }
}

// A box wider than its place is moved by arrow keys once the keyboard comes to it.
function reach() {
  // A formula in a line that is longer than the line becomes such a box: it moves, and not the page with it.
  // In a table the whole table moves.
  for (const formula of document.querySelectorAll("article mjx-container:not([display], table *)")) {
    let place = formula.parentElement;
    while (getComputedStyle(place).display === "inline") place = place.parentElement;
    const width = formula.firstElementChild?.getBoundingClientRect().width;
    formula.classList.toggle("long", place.clientWidth > 0 && width > place.clientWidth - 8);
  }
  const wide = "pre, table, .table-wrapper, .wide-picture, .formula, .math-wrapper, mjx-container";
  for (const box of document.querySelectorAll(`article :is(${wide})`))
    if (box.clientWidth && box.scrollWidth > box.clientWidth + 1) box.tabIndex = 0;
    else box.removeAttribute("tabindex");
}

// There they turn no page.
function still(event) {
  if (event.key.startsWith("Arrow") && event.target.closest?.('article [tabindex="0"]')) event.stopPropagation();
}

addEventListener("keydown", still, true);
addEventListener("DOMContentLoaded", names);
addEventListener("DOMContentLoaded", drawers);
// The page grows when formulas are set, pictures come and folds open, and with the window.
addEventListener("DOMContentLoaded", () => new ResizeObserver(reach).observe(document.body));
