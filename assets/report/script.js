// Reports: sliders between two pictures, pictures in full size, tables that sort.

addEventListener("DOMContentLoaded", () => {
  for (const pair of document.querySelectorAll(".compare")) {
    const slider = pair.querySelector("input");
    const move = () => pair.style.setProperty("--at", `${slider.value}%`);
    slider.addEventListener("input", move);
    move();
  }

  // A click shows a picture in full size; the wheel enlarges it, pixel by pixel.
  const dialog = document.createElement("dialog");
  dialog.innerHTML = "<div><img alt=''></div><p>Scroll to enlarge, drag to move, click to close</p>";
  document.body.append(dialog);
  const frame = dialog.querySelector("div");
  const large = dialog.querySelector("img");
  let width = 0;
  let dragged = 0;
  for (const picture of document.querySelectorAll("img")) {
    if (picture === large || picture.closest(".compare")) continue;
    picture.addEventListener("click", () => {
      large.src = picture.src;
      large.alt = picture.alt;
      width = Math.max(picture.naturalWidth, Math.min(900, window.innerWidth * 0.85));
      large.style.width = `${width}px`;
      dialog.showModal();
    });
  }
  frame.addEventListener("wheel", (event) => {
    event.preventDefault();
    const box = large.getBoundingClientRect();
    const x = (event.clientX - box.left) / box.width;
    const y = (event.clientY - box.top) / box.height;
    const next = Math.min(Math.max(width * Math.exp(-event.deltaY / 400), 100), 20000);
    const before = { left: frame.scrollLeft, top: frame.scrollTop };
    large.style.width = `${next}px`;
    frame.scrollLeft = before.left + x * (next - width);
    frame.scrollTop = before.top + y * (next - width) * (box.height / box.width);
    width = next;
  }, { passive: false });
  frame.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    frame.scrollLeft -= event.movementX;
    frame.scrollTop -= event.movementY;
    dragged += Math.hypot(event.movementX, event.movementY);
  });
  dialog.addEventListener("pointerdown", () => (dragged = 0));
  large.addEventListener("dragstart", (event) => event.preventDefault());
  dialog.addEventListener("click", () => dragged < 5 && dialog.close());

  // A click on a heading sorts its column: numbers by size, the rest by the alphabet.
  for (const table of document.querySelectorAll("table")) {
    const [head, ...rows] = table.rows;
    if (rows.length < 3 || !head || [...head.cells].some((cell) => cell.tagName !== "TH")) continue;
    [...head.cells].forEach((cell, column) => {
      cell.classList.add("sorts");
      cell.addEventListener("click", () => {
        const down = cell.getAttribute("aria-sort") !== "descending";
        for (const other of head.cells) other.removeAttribute("aria-sort");
        cell.setAttribute("aria-sort", down ? "descending" : "ascending");
        const key = (row) => row.cells[column]?.textContent.trim() ?? "";
        const number = (text) => parseFloat(text.replace(/,/g, "").replace("−", "-").replace("< ", ""));
        rows.sort((a, b) => {
          const [x, y] = [number(key(a)), number(key(b))];
          const order = isNaN(x) || isNaN(y) ? key(a).localeCompare(key(b)) : x - y;
          return down ? -order : order;
        });
        head.parentElement.append(...rows);
      });
    });
  }
});
