"use strict";
(function () {
  var status = document.getElementById("copied");

  function selected(code) {
    var range = document.createRange();
    var selection = window.getSelection();
    range.selectNodeContents(code);
    selection.removeAllRanges();
    selection.addRange(range);
    return document.execCommand("copy");
  }

  function copy(button) {
    var code = button.parentNode.querySelector("code");
    var text = button.getAttribute("data-copy") || code.textContent;
    function said(done) {
      button.textContent = done ? "Copied" : "Select it";
      status.textContent = done ? "Copied" : "It could not be copied";
      window.setTimeout(function () {
        button.textContent = "Copy";
        status.textContent = "";
      }, 2000);
    }
    if (!navigator.clipboard) {
      said(selected(code));
      return;
    }
    navigator.clipboard.writeText(text).then(
      function () { said(true); },
      function () { said(selected(code)); }
    );
  }

  document.querySelectorAll("button[data-copy]").forEach(function (button) {
    button.hidden = false;
    button.addEventListener("click", function () { copy(button); });
  });

  function reveal() {
    var name = window.location.hash.slice(1);
    var target = name ? document.getElementById(name) : null;
    for (var one = target; one; one = one.parentElement) {
      if (one.tagName === "DETAILS") { one.open = true; }
    }
    if (target) { target.scrollIntoView(); }
  }
  window.addEventListener("hashchange", reveal);
  reveal();

  var MOST = 64;
  var FINE = 4;

  // A timeline is as wide as it is zoomed in; how far it is scrolled says what is seen.
  function zoomable(timeline) {
    var scroll = timeline.querySelector(".scroll");
    var plane = timeline.querySelector(".plane");
    var zoom = 1;
    var held = null;

    function to(next, at) {
      var before = zoom;
      zoom = Math.min(Math.max(next, 1), MOST);
      plane.style.width = zoom * 100 + "%";
      plane.classList.toggle("wide", zoom >= FINE);
      scroll.scrollLeft = (scroll.scrollLeft + at) * zoom / before - at;
    }

    timeline.querySelector(".tools").hidden = false;
    timeline.querySelectorAll("[data-zoom]").forEach(function (button) {
      var factor = Number(button.getAttribute("data-zoom"));
      button.addEventListener("click", function () { to(zoom * factor, scroll.clientWidth / 2); });
    });
    scroll.addEventListener("keydown", function (event) {
      var factor = { "+": 2, "=": 2, "-": 0.5, "0": 0 }[event.key];
      if (factor === undefined || event.ctrlKey || event.metaKey) { return; }
      to(zoom * factor, scroll.clientWidth / 2);
      event.preventDefault();
    });
    scroll.addEventListener("wheel", function (event) {
      if (!event.ctrlKey) { return; }
      to(zoom * (event.deltaY < 0 ? 1.25 : 0.8), event.clientX - scroll.getBoundingClientRect().left);
      event.preventDefault();
    }, { passive: false });
    scroll.addEventListener("pointerdown", function (event) {
      if (event.pointerType === "mouse") { held = event.clientX; scroll.setPointerCapture(event.pointerId); }
    });
    scroll.addEventListener("pointermove", function (event) {
      if (held === null) { return; }
      scroll.scrollLeft -= event.clientX - held;
      held = event.clientX;
    });
    ["pointerup", "pointercancel"].forEach(function (name) {
      scroll.addEventListener(name, function () { held = null; });
    });
  }
  document.querySelectorAll("[data-timeline]").forEach(zoomable);

  var opened = [];
  window.addEventListener("beforeprint", function () {
    opened = Array.prototype.slice.call(document.querySelectorAll("details:not([open])"));
    opened.forEach(function (details) { details.open = true; });
  });
  window.addEventListener("afterprint", function () {
    opened.forEach(function (details) { details.open = false; });
  });
})();
