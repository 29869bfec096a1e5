// Colour theme: light, dark, or the system setting. Not a module, so that it runs before the first paint.
(() => {
  const KEY = "theme";
  const root = document.documentElement;
  const storedTheme = () => {
    try {
      return localStorage.getItem(KEY) ?? "";
    } catch {
      return ""; // the browser may forbid storage
    }
  };
  const apply = (theme) => {
    if (theme) root.dataset.theme = theme;
    else delete root.dataset.theme;
    document.dispatchEvent(new Event("theme"));
  };
  apply(storedTheme());
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () =>
    apply(root.dataset.theme ?? ""),
  );
  addEventListener("DOMContentLoaded", () => {
    const choice = document.getElementById("theme");
    choice.value = root.dataset.theme ?? "";
    choice.addEventListener("change", () => {
      apply(choice.value);
      try {
        localStorage.setItem(KEY, choice.value);
      } catch {
        // the browser may forbid storage: the choice is then lost at a reload
      }
    });
  });
})();
