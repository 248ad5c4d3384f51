// light or dark, as the reader last chose here; without this the page follows the system
(() => {
  const root = document.documentElement;
  const button = document.querySelector(".theme");
  const dark = () =>
    (root.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";
  try {
    const chosen = localStorage.getItem("touchdown-theme");
    if (chosen === "light" || chosen === "dark") root.dataset.theme = chosen;
  } catch { /* a browser may forbid it to a file */ }
  button.hidden = false;
  button.addEventListener("click", () => {
    root.dataset.theme = dark() ? "light" : "dark";
    try {
      localStorage.setItem("touchdown-theme", root.dataset.theme);
    } catch { /* as above */ }
  });
})();
