// View of the page: full, or compact at the address /?view=compact. Not a module, so that it runs before the
// first paint.
(() => {
  const isCompact = new URLSearchParams(location.search).get("view") === "compact";
  document.documentElement.dataset.view = isCompact ? "compact" : "full";
  addEventListener("DOMContentLoaded", () => {
    const link = document.getElementById("view");
    link.href = isCompact ? "/" : "/?view=compact";
    link.textContent = isCompact ? "Full view" : "Compact view";
  });
})();
