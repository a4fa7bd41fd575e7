/* What the theme makes only while a page is shown, for keyboards and screen readers: boxes in which wide tables scroll,
   and regions without a name of their own. */
new MutationObserver(function () {
  document.querySelectorAll(".md-typeset__scrollwrap:not([tabindex])").forEach(function (box) {
    box.tabIndex = 0;
    box.setAttribute("role", "group");
    box.setAttribute("aria-label", "Table");
  });
  document.querySelectorAll(".md-code__nav:not([role])").forEach(function (buttons) {
    buttons.setAttribute("role", "none");
  });
  document.querySelectorAll(".md-nav[aria-labelledby]").forEach(function (nav) {
    var label = document.getElementById(nav.getAttribute("aria-labelledby"));
    var link = nav.parentElement.querySelector("a");
    if (label && link && !label.textContent.trim()) {
      nav.removeAttribute("aria-labelledby");
      nav.setAttribute("aria-label", link.textContent.trim());
    }
  });
}).observe(document.documentElement, { childList: true, subtree: true });
