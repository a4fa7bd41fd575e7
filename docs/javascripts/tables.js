/* A table that is too wide scrolls in a box that the theme makes: the keyboard has to reach it. */
new MutationObserver(function () {
  document.querySelectorAll(".md-typeset__scrollwrap:not([tabindex])").forEach(function (box) {
    box.tabIndex = 0;
    box.setAttribute("role", "region");
    box.setAttribute("aria-label", "Table");
  });
}).observe(document.documentElement, { childList: true, subtree: true });
