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
    navigator.clipboard.writeText(code.textContent).then(
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

  var opened = [];
  window.addEventListener("beforeprint", function () {
    opened = Array.prototype.slice.call(document.querySelectorAll("details:not([open])"));
    opened.forEach(function (details) { details.open = true; });
  });
  window.addEventListener("afterprint", function () {
    opened.forEach(function (details) { details.open = false; });
  });
})();
